//! TRC: marker trajectories in tab-separated text.

use std::collections::HashMap;

use model::{Axis, PointTrajectories, counted};
use nalgebra::Vector3;

use crate::{
    Error, Place, PointsOptions, Read, Result,
    points::{self, PointNames},
    read::Warnings,
    text::{Line, Lines, Names, finite, number, push_number, quote},
    time_grid::Times,
};

/// Reads marker trajectories; y is up unless the options say otherwise.
///
/// Empty cells, `NaN`, cells that a row leaves out at its end, and markers at exactly 0 0 0 are missing. The number
/// of frames is that of the rows, the frame rate that of the header where the times agree with it; frames without
/// a row are missing.
///
/// # Errors
/// If the header or a row is not as the format wants it.
pub fn read(bytes: &[u8], options: &PointsOptions) -> Result<Read<PointTrajectories>> {
    let up = options.up.unwrap_or(Axis::Y);
    let mut warnings = Warnings::default();
    let mut lines = Lines::new(bytes);
    let header = Header::read(&mut lines, &mut warnings)?;
    let points = header.names.len();
    let max_frames = points::max_frames(bytes.len(), points);
    let mut rows = Rows { points, max_frames, ..Rows::default() };
    while let Some(line) = lines.next_untrimmed() {
        rows.push(line)?;
    }
    if rows.positions.is_empty() {
        return Err(Error::at_line(lines.number(), "the end of the file", "a row of a frame"));
    }
    if rows.short > 0 {
        let message =
            format!("{} cut short: the markers left out are taken as missing", counted(rows.short, "row"));
        warnings.add(Place::File, message);
    }
    let mut at_origin = 0;
    for position in &mut rows.positions {
        let is_origin = *position == Vector3::zeros();
        at_origin += usize::from(is_origin);
        let measured = if is_origin { Vector3::repeat(f64::NAN) } else { *position * header.metres };
        *position = points::y_up(up, measured);
    }
    if at_origin > 0 {
        let message = format!("{} at exactly 0 0 0 taken as missing", counted(at_origin, "sample"));
        warnings.add(Place::File, message);
    }
    header.check_rows(rows.positions.len() / points, &mut warnings);
    let grid = rows.times.grid(header.rate, max_frames, &mut warnings)?;
    let trajectories = points::place(header.names, &rows.positions, &[], &grid)?;
    Ok(warnings.beside(trajectories))
}

/// Writes marker trajectories: millimetres, y up; frames count from 1, times start at 0, and cells of samples that were not
/// measured are empty.
pub fn write(name: &str, trajectories: &PointTrajectories) -> String {
    let (rate, frames) = (trajectories.frame_rate(), trajectories.num_frames());
    let points = trajectories.num_points();
    let mut taken = Names::default();
    let name = name.replace(['\t', '\n', '\r'], " ");
    let mut out = format!(
        "PathFileType\t4\t(X/Y/Z)\t{name}\n\
         DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n\
         {rate}\t{rate}\t{frames}\t{points}\tmm\t{rate}\t1\t{frames}\nFrame#\tTime"
    );
    for name in trajectories.names() {
        out.push_str(&format!("\t{}\t\t", taken.unique_word(name, &[])));
    }
    out.push_str("\n\t");
    for point in 1..=points {
        out.push_str(&format!("\tX{point}\tY{point}\tZ{point}"));
    }
    out.push_str("\n\n");
    for frame in 0..frames {
        out.push_str(&format!("{}\t{}", frame + 1, frame as f64 / rate));
        for value in trajectories.frame(frame).iter().flatten() {
            out.push('\t');
            if value.is_finite() {
                push_number(&mut out, 1e3 * value);
            }
        }
        out.push('\n');
    }
    out
}

/// The rows read so far.
#[derive(Default)]
struct Rows {
    points: usize,
    max_frames: usize,
    times: Times,
    /// file units, shape `[rows, points]`
    positions: Vec<Vector3<f64>>,
    /// rows that end before the last marker
    short: usize,
}

impl Rows {
    fn push(&mut self, line: Line<'_>) -> Result<()> {
        if line.text.trim_ascii().is_empty() {
            return Ok(());
        }
        let mut cells = cells(line.text).skip(1);
        let time = cells.next();
        let time =
            time.ok_or_else(|| Error::at_line(line.number, quote(line.text), "a frame number and a time"))?;
        self.times.push(line.number, time)?;
        let start = self.positions.len();
        if start / self.points >= self.max_frames {
            let found = format!("row {} of {}", start / self.points + 1, counted(self.points, "marker"));
            return Err(Error::at_line(line.number, found, "rows with a cell for each coordinate"));
        }
        self.positions.resize(start + self.points, Vector3::repeat(f64::NAN));
        let row = &mut self.positions[start..];
        let coordinates = 3 * self.points;
        let mut found = 0;
        for cell in cells {
            let value = coordinate(line.number, cell)?;
            match row.get_mut(found / 3) {
                Some(position) => position[found % 3] = value,
                None if value.is_nan() => {}
                None => {
                    let found = format!("more than {coordinates} coordinates");
                    let expected = format!("three for each of {}", counted(self.points, "marker"));
                    return Err(Error::at_line(line.number, found, expected));
                }
            }
            found += 1;
        }
        if found < coordinates {
            if found % 3 != 0 && !row[found / 3].iter().all(|v| v.is_nan()) {
                let found = format!("a row that ends after {found} of {coordinates} coordinates");
                return Err(Error::at_line(line.number, found, "three for each marker"));
            }
            self.short += 1;
        }
        Ok(())
    }
}

/// The cells of a line, without blanks around them.
fn cells(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|b| *b == b'\t').map(<[u8]>::trim_ascii)
}

fn coordinate(line: usize, cell: &[u8]) -> Result<f64> {
    if cell.is_empty() {
        return Ok(f64::NAN);
    }
    let value = number(cell).filter(|v| !v.is_infinite());
    value.ok_or_else(|| Error::at_line(line, quote(cell), "a number, NaN or an empty cell"))
}

/// The five lines before the rows.
struct Header {
    line: usize,
    rate: Option<f64>,
    metres: f64,
    frames: Option<u64>,
    names: Vec<String>,
}

impl Header {
    fn read(lines: &mut Lines<'_>, warnings: &mut Warnings) -> Result<Self> {
        let first = next_line(lines, "PathFileType")?;
        if !first.text.starts_with(b"PathFileType") {
            return Err(Error::at_line(first.number, quote(first.text), "PathFileType"));
        }
        let keys = next_line(lines, "DataRate and other keys")?;
        let line = next_line(lines, "the values of the keys")?;
        let values: HashMap<_, _> =
            cells(keys.text).map(<[u8]>::to_ascii_lowercase).zip(cells(line.text)).collect();
        let get = |key: &[u8]| values.get(key).copied().unwrap_or_default();
        let rate =
            match get(b"datarate") {
                b"" => None,
                cell => Some(finite(cell).filter(|r| (1e-6..=1e6).contains(r)).ok_or_else(|| {
                    Error::at_line(line.number, quote(cell), "DataRate: frames per second")
                })?),
            };
        let metres = points::metres_or_mm(get(b"units"), Place::Line(line.number), warnings)?;
        let count = |cell: &[u8]| std::str::from_utf8(cell).ok().and_then(|text| text.parse::<u64>().ok());
        let frames = count(get(b"numframes"));
        let markers = count(get(b"nummarkers"));

        let names_line = next_line(lines, "Frame#, Time and the names of the markers")?;
        let is_frame =
            cells(names_line.text).next().is_some_and(|c| c.to_ascii_lowercase().starts_with(b"frame"));
        if !is_frame {
            return Err(Error::at_line(names_line.number, quote(names_line.text), "Frame#"));
        }
        let mut names = PointNames::default();
        for cell in cells(names_line.text).skip(2).filter(|c| !c.is_empty()) {
            names.push(&String::from_utf8_lossy(cell), Place::Line(names_line.number), warnings);
        }
        let names = names.list;
        if names.is_empty() {
            return Err(Error::at_line(names_line.number, "no names of markers", "at least one"));
        }
        if markers != Some(names.len() as u64) {
            let declared = markers.map_or("an unknown number of".into(), |m| m.to_string());
            let message =
                format!("the file declares {} and names {}", counted(declared, "marker"), names.len());
            warnings.line(line.number, message);
        }
        let axes = next_line(lines, "X1, Y1, Z1 and so on")?;
        if !cells(axes.text).any(|c| c.eq_ignore_ascii_case(b"x1")) {
            return Err(Error::at_line(axes.number, quote(axes.text), "X1, Y1, Z1 and so on"));
        }
        Ok(Self { line: line.number, rate, metres, frames, names })
    }

    fn check_rows(&self, found: usize, warnings: &mut Warnings) {
        if self.frames != Some(found as u64) {
            let declared = self.frames.map_or("an unknown number of".into(), |n| n.to_string());
            let message = format!(
                "the file declares {} and has {found}; all {found} are read",
                counted(declared, "frame")
            );
            warnings.line(self.line, message);
        }
    }
}

/// The next line that is not empty.
fn next_line<'a>(lines: &mut Lines<'a>, expected: &str) -> Result<Line<'a>> {
    while let Some(line) = lines.next_untrimmed() {
        if !line.text.trim_ascii().is_empty() {
            return Ok(line);
        }
    }
    Err(Error::at_line(lines.number(), "the end of the file", expected))
}
