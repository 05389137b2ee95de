use super::IndexFile;
use super::layout::{HEAD, wrong};
use crate::graph::NOBODY;
use crate::segments::Segments;
use crate::{Error, Result};

pub fn verify(file: &IndexFile) -> Result<()> {
    // What lies between the sections is covered by no checksum: it must be zeros.
    let mut at = HEAD;
    for section in &file.sections {
        let Some(bytes) = file.bytes.get(section.range()) else {
            return Err(wrong(
                format!("section {} past the end", section.name),
                section.offset,
                "it within the file",
            ));
        };
        if section.offset < at || section.offset - at >= HEAD {
            return Err(wrong(
                format!("section {}", section.name),
                section.offset,
                format!("it at byte {at}"),
            ));
        }
        if let Some(odd) = file.bytes[at..section.offset].iter().position(|b| *b != 0) {
            return Err(wrong("a number", at + odd, "zeros between the sections"));
        }
        at = section.offset + section.bytes;
        let found = blake3::hash(bytes).to_hex().to_string();
        if found != section.blake3 {
            return Err(Error::Checksum {
                part: section.name.clone(),
                found,
                expected: section.blake3.clone(),
            });
        }
    }
    let end = at.next_multiple_of(HEAD).min(file.bytes.len());
    if let Some(odd) = file.bytes[at..end].iter().position(|b| *b != 0) {
        return Err(wrong("a number", at + odd, "zeros after the sections"));
    }
    let single = |v: &f32| f64::from(*v);
    check_finite("coordinate", file.database.coordinates.iter().map(single))?;
    check_finite("proportion", file.database.clips.iter().flat_map(|c| c.proportions.iter().copied()))?;
    check_finite("zero pose", file.database.clips.iter().flat_map(|c| c.zero_pose.iter().map(single)))?;
    let Some(windows) = &file.windows else { return Ok(()) };
    check_finite("feature", windows.features.iter().map(single))?;
    check_finite("principal axis", windows.axes.iter().chain(&windows.mean).copied())?;
    windows.segments.as_ref().map_or(Ok(()), |segments| check_segments(segments, windows.num_rows()))
}

fn check_finite(what: &str, mut all: impl Iterator<Item = f64>) -> Result<()> {
    match all.position(|v| !v.is_finite()) {
        Some(bad) => Err(wrong(format!("{what} {bad} is not finite"), HEAD, "numbers")),
        None => Ok(()),
    }
}

/// Every row is in one segment, and what the graph and the table of rows name is there.
fn check_segments(segments: &Segments, num_rows: usize) -> Result<()> {
    let odd = |found: String| Err(wrong(found, 0, "segments that agree with the rows"));
    let mut rows = 0;
    for segment in 0..segments.len() {
        let range = segments.rows(segment, num_rows);
        rows += range.len();
        if range.len() != segments.length[segment] as usize
            || range.is_empty()
            || range.clone().any(|row| segments.by_row[row] as usize != segment)
        {
            return odd(format!("segment {segment} with rows {range:?}"));
        }
    }
    if rows != num_rows {
        return odd(format!("{rows} rows in segments, {num_rows} in all"));
    }
    if let Some(bad) = segments.graph.iter().find(|n| **n != NOBODY && **n as usize >= segments.len()) {
        return odd(format!("neighbour {bad} of {} segments", segments.len()));
    }
    if let Some(bad) =
        segments.energy.iter().chain(segments.radius.iter()).find(|v| !(v.is_finite() && **v >= 0.0))
    {
        return odd(format!("a radius or energy of {bad}"));
    }
    Ok(())
}
