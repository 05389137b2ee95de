//! CSV of point trajectories: `time,left_wrist_x,left_wrist_y,left_wrist_z,…`.
//!
//! Seconds and metres, y up; an empty cell or `nan` was not measured; lines that start with `#` are comments.
//! Columns may come in any order; a column `frame` is skipped.

use std::collections::HashMap;

use model::PointTrajectories;
use nalgebra::Vector3;

use crate::{
    Error, Place, Read, Result,
    points::{self, PointNames},
    read::Warnings,
    text::{Line, Lines, Names, number, quote},
    time_grid::Times,
};

/// What a column holds.
#[derive(Debug, Clone, Copy)]
enum Column {
    Time,
    Frame,
    /// point and coordinate 0, 1, 2
    Coordinate(usize, usize),
}

/// Reads point trajectories. The frame rate is that of the times; frames without a row are missing.
///
/// # Errors
/// If the header lacks the time or a coordinate of a point, a row has another number of cells than the header, a
/// cell is not a number, or the times don't rise.
pub fn read(bytes: &[u8]) -> Result<Read<PointTrajectories>> {
    let mut warnings = Warnings::default();
    let mut lines = Lines::new(bytes);
    let mut content = std::iter::from_fn(|| lines.find(|line| !line.text.is_empty() && line.text[0] != b'#'));
    let Some(header) = content.next() else {
        return Err(Error::of_file("no line", "a header: time and three columns for each point"));
    };
    let separator = separator(header.text);
    let (columns, names) = columns(header, separator, &mut warnings)?;
    let max_frames = points::max_frames(bytes.len(), names.len());
    let mut times = Times::default();
    let mut positions = Vec::new();
    let mut not_whole = 0;
    for line in content {
        let start = positions.len();
        positions.resize(start + names.len(), Vector3::repeat(f64::NAN));
        let row = &mut positions[start..];
        let mut cells = 0;
        for (cell, column) in line.text.split(|b| *b == separator).map(<[u8]>::trim_ascii).zip(&columns) {
            cells += 1;
            match column {
                Column::Time => times.push(line.number, cell)?,
                Column::Frame => {}
                Column::Coordinate(point, axis) => row[*point][*axis] = coordinate(line.number, cell)?,
            }
        }
        let found = line.text.split(|b| *b == separator).count();
        if found != columns.len() || cells != columns.len() {
            let expected = format!("{}, as many as in the header", columns.len());
            return Err(Error::at_line(line.number, format!("{found} cells"), expected));
        }
        not_whole +=
            row.iter().filter(|p| p.iter().any(|v| v.is_nan()) && !p.iter().all(|v| v.is_nan())).count();
    }
    if positions.is_empty() {
        return Err(Error::at_line(header.number, "a header without rows", "rows"));
    }
    if not_whole > 0 {
        let message = format!("{not_whole} samples lack one or two coordinates; they count as missing");
        warnings.add(Place::File, message);
    }
    let grid = times.grid(None, max_frames, &mut warnings)?;
    let trajectories = points::place(names, &positions, &grid)?;
    Ok(warnings.beside(trajectories))
}

/// Spreadsheets of some countries write semicolons.
fn separator(header: &[u8]) -> u8 {
    *b",;\t".iter().find(|s| header.contains(s)).unwrap_or(&b',')
}

fn coordinate(line: usize, cell: &[u8]) -> Result<f64> {
    if cell.is_empty() {
        return Ok(f64::NAN);
    }
    let value = number(cell).filter(|v| !v.is_infinite());
    value.ok_or_else(|| Error::at_line(line, quote(cell), "metres, nan or an empty cell"))
}

fn columns(header: Line<'_>, separator: u8, warnings: &mut Warnings) -> Result<(Vec<Column>, Vec<String>)> {
    let error = |found: String, expected: &str| Error::at_line(header.number, found, expected);
    let mut columns = Vec::new();
    let mut names = PointNames::default();
    let mut point_of = HashMap::<Vec<u8>, (usize, [bool; 3])>::new();
    let mut has_time = false;
    for cell in header.text.split(|b| *b == separator) {
        let cell = cell.trim_ascii();
        let cell = cell.strip_prefix(b"\"").and_then(|c| c.strip_suffix(b"\"")).unwrap_or(cell);
        columns.push(match cell.to_ascii_lowercase().as_slice() {
            b"time" | b"time_s" if has_time => return Err(error("two columns of time".into(), "one")),
            b"time" | b"time_s" => {
                has_time = true;
                Column::Time
            }
            b"frame" => Column::Frame,
            lower => {
                let axis = match lower {
                    [_, .., b'_', b'x'] => 0,
                    [_, .., b'_', b'y'] => 1,
                    [_, .., b'_', b'z'] => 2,
                    _ => {
                        return Err(error(
                            format!("column {}", quote(cell)),
                            "time, or a name with _x, _y or _z",
                        ));
                    }
                };
                let name = &cell[..cell.len() - 2];
                let (point, seen) = point_of.entry(name.to_vec()).or_insert_with(|| {
                    names.push(&String::from_utf8_lossy(name), Place::Line(header.number), warnings);
                    (names.list.len() - 1, [false; 3])
                });
                if std::mem::replace(&mut seen[axis], true) {
                    return Err(error(format!("column {} twice", quote(cell)), "each column once"));
                }
                Column::Coordinate(*point, axis)
            }
        });
    }
    if !has_time {
        return Err(error("no column of time".into(), "one named time"));
    }
    if names.list.is_empty() {
        return Err(error("no points".into(), "three columns for each point"));
    }
    // the first in the order of the header, so that the message is always the same
    let lacking = point_of.values().filter(|(_, seen)| *seen != [true; 3]).map(|(point, _)| *point).min();
    if let Some(point) = lacking {
        let found = format!("point {} without three coordinates", quote(names.list[point].as_bytes()));
        return Err(error(found, "columns _x, _y and _z for each point"));
    }
    Ok((columns, names.list))
}

/// Writes point trajectories; times start at 0, numbers have seven decimals (a tenth of a micrometre).
pub fn write(trajectories: &PointTrajectories) -> String {
    let mut out = String::from("# seconds and metres, y up; an empty cell was not measured\ntime");
    let mut taken = Names::reserved(&["time", "frame"]);
    for name in trajectories.names() {
        let name = taken.unique_word(name, &[',', ';', '"', '#']);
        out.push_str(&format!(",{name}_x,{name}_y,{name}_z"));
    }
    out.push('\n');
    for frame in 0..trajectories.num_frames() {
        out.push_str(&format!("{}", frame as f64 / trajectories.frame_rate()));
        for position in trajectories.frame(frame) {
            for value in position.iter() {
                out.push(',');
                if value.is_finite() {
                    crate::text::push_number(&mut out, *value);
                }
            }
        }
        out.push('\n');
    }
    out
}
