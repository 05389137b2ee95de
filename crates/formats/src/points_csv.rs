//! CSV of point trajectories: `time,left_wrist_x,left_wrist_y,left_wrist_z,…`.
//!
//! Seconds and metres, y up unless the options say otherwise; an empty cell or `nan` was not measured; lines that start with `#` are comments.
//! Columns may come in any order; a column `frame` is skipped. How sure a sample is may be said in `left_wrist_sigma`
//! (standard deviation of each coordinate, metres) or `left_wrist_confidence` (0 to 1).

use std::collections::HashMap;

use model::{Axis, PointTrajectories, counted};
use nalgebra::Vector3;

use crate::{
    Error, Place, PointsOptions, Read, Result,
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
    /// standard deviation of a point, metres
    Sigma(usize),
    /// confidence in a point, 0 to 1
    Confidence(usize),
}

/// Columns of a point in the order of [`Seen`].
const SUFFIXES: [&[u8]; 5] = [b"_x", b"_y", b"_z", b"_sigma", b"_confidence"];
/// Which of [`SUFFIXES`] a point has; the coordinates it must have.
type Seen = [bool; SUFFIXES.len()];

/// [`read_with`] the default options.
///
/// # Errors
/// As [`read_with`].
pub fn read(bytes: &[u8]) -> Result<Read<PointTrajectories>> {
    read_with(bytes, &PointsOptions::default())
}

/// Reads point trajectories. The frame rate is that of the times; frames without a row are missing.
///
/// A confidence divides the standard deviation: that of the sample if the file says it, else that of the options. At 0
/// the sample was not measured. Points are turned so that the options' `up`, else y, points up.
///
/// # Errors
/// If the header lacks the time or a coordinate of a point, a row has another number of cells than the header, a
/// cell is not a number, a standard deviation is not positive, a confidence is not from 0 to 1, or the times don't rise.
pub fn read_with(bytes: &[u8], options: &PointsOptions) -> Result<Read<PointTrajectories>> {
    let mut warnings = Warnings::default();
    let mut lines = Lines::new(bytes);
    let mut content = std::iter::from_fn(|| lines.find(|line| !line.text.is_empty() && line.text[0] != b'#'));
    let Some(header) = content.next() else {
        return Err(Error::whole_file("no line", "a header: time and three columns for each point"));
    };
    let separator = separator(header.text);
    let (columns, names) = columns(header, separator, &mut warnings)?;
    let up = options.up.unwrap_or(Axis::Y);
    if let Some(line) = line_that_contradicts(bytes, up) {
        let message =
            format!("the file says y is up; the {} that was asked for is taken instead", points::letter(up));
        warnings.add(Place::Line(line), message);
    }
    let max_frames = points::max_frames(bytes.len(), names.len());
    let mut times = Times::default();
    let mut positions = Vec::new();
    let has_sigmas = columns.iter().any(|c| matches!(c, Column::Sigma(_) | Column::Confidence(_)));
    let mut sigmas = Vec::new();
    // of one row, not said: no standard deviation, full confidence
    let mut said = vec![(f64::NAN, 1.0); names.len()];
    let mut not_whole = 0;
    for line in content {
        let start = positions.len();
        positions.resize(start + names.len(), Vector3::repeat(f64::NAN));
        let row = &mut positions[start..];
        said.fill((f64::NAN, 1.0));
        let mut cells = 0;
        for (cell, column) in line.text.split(|b| *b == separator).map(<[u8]>::trim_ascii).zip(&columns) {
            cells += 1;
            match column {
                Column::Time => times.push(line.number, cell)?,
                Column::Frame => {}
                Column::Coordinate(point, axis) => row[*point][*axis] = coordinate(line.number, cell)?,
                Column::Sigma(point) => said[*point].0 = sigma(line.number, cell)?,
                Column::Confidence(point) => said[*point].1 = confidence(line.number, cell)?,
            }
        }
        let found = line.text.split(|b| *b == separator).count();
        if found != columns.len() || cells != columns.len() {
            let expected = format!("{}, as many as in the header", columns.len());
            return Err(Error::at_line(line.number, format!("{found} cells"), expected));
        }
        not_whole +=
            row.iter().filter(|p| p.iter().any(|v| v.is_nan()) && !p.iter().all(|v| v.is_nan())).count();
        if has_sigmas {
            sigmas.extend(row.iter_mut().zip(&said).map(|(position, said)| trust(position, *said, options)));
        }
    }
    if positions.is_empty() {
        return Err(Error::at_line(header.number, "a header without rows", "rows"));
    }
    if not_whole > 0 {
        let message =
            format!("{} with only one or two coordinates taken as missing", counted(not_whole, "sample"));
        warnings.add(Place::File, message);
    }
    for position in &mut positions {
        *position = points::y_up(up, *position);
    }
    let grid = times.grid(None, max_frames, &mut warnings)?;
    let trajectories = points::place(names, &positions, &sigmas, &grid)?;
    Ok(warnings.beside(trajectories))
}

/// The comment above the header that says y up, as in files that this module wrote, where another axis is asked for.
fn line_that_contradicts(bytes: &[u8], up: Axis) -> Option<usize> {
    let mut comments = Lines::new(bytes).take_while(|line| line.text.starts_with(b"#"));
    let says_y_up = |line: &Line<'_>| line.text.to_ascii_lowercase().windows(4).any(|part| part == b"y up");
    comments.find(says_y_up).filter(|_| up != Axis::Y).map(|line| line.number)
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

fn sigma(line: usize, cell: &[u8]) -> Result<f64> {
    let value = coordinate(line, cell)?;
    if value <= 0.0 {
        return Err(Error::at_line(
            line,
            quote(cell),
            "a standard deviation above 0 m, nan or an empty cell",
        ));
    }
    Ok(value)
}

/// What is not said is certain.
fn confidence(line: usize, cell: &[u8]) -> Result<f64> {
    let value = coordinate(line, cell)?;
    if value.is_nan() {
        return Ok(1.0);
    }
    if !(0.0..=1.0).contains(&value) {
        return Err(Error::at_line(line, quote(cell), "a confidence from 0 to 1, nan or an empty cell"));
    }
    Ok(value)
}

/// Standard deviation of a sample, NaN for the run's default; what can't be trusted at all was not measured.
fn trust(position: &mut Vector3<f64>, (sigma, confidence): (f64, f64), options: &PointsOptions) -> f64 {
    if confidence == 1.0 && sigma.is_nan() {
        return f64::NAN;
    }
    let certain = if sigma.is_nan() { options.sigma_m } else { sigma };
    let found = certain / confidence;
    if found <= points::MAX_SIGMA {
        return found;
    }
    *position = Vector3::repeat(f64::NAN);
    f64::NAN
}

fn columns(header: Line<'_>, separator: u8, warnings: &mut Warnings) -> Result<(Vec<Column>, Vec<String>)> {
    let error = |found: String, expected: &str| Error::at_line(header.number, found, expected);
    let mut columns = Vec::new();
    let mut names = PointNames::default();
    let mut point_of = HashMap::<Vec<u8>, (usize, Seen)>::new();
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
                let suffix = SUFFIXES.iter().position(|s| lower.len() > s.len() && lower.ends_with(s));
                let suffix = suffix.ok_or_else(|| {
                    let expected = "time, or a name with _x, _y, _z, _sigma or _confidence";
                    error(format!("column {}", quote(cell)), expected)
                })?;
                let name = &cell[..cell.len() - SUFFIXES[suffix].len()];
                let (point, seen) = point_of.entry(name.to_vec()).or_insert_with(|| {
                    names.push(&String::from_utf8_lossy(name), Place::Line(header.number), warnings);
                    (names.list.len() - 1, Seen::default())
                });
                if std::mem::replace(&mut seen[suffix], true) {
                    return Err(error(format!("column {} twice", quote(cell)), "each column once"));
                }
                match suffix {
                    3 => Column::Sigma(*point),
                    4 => Column::Confidence(*point),
                    axis => Column::Coordinate(*point, axis),
                }
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
    let lacking =
        point_of.values().filter(|(_, seen)| !seen[..3].iter().all(|s| *s)).map(|(point, _)| *point).min();
    if let Some(point) = lacking {
        let found = format!("point {} without three coordinates", quote(names.list[point].as_bytes()));
        return Err(error(found, "columns _x, _y and _z for each point"));
    }
    Ok((columns, names.list))
}

/// Writes point trajectories; times start at 0, numbers have seven decimals (a tenth of a micrometre). Points of which a
/// standard deviation is known have a column of them, with all digits.
pub fn write(trajectories: &PointTrajectories) -> String {
    let mut out = String::from("# seconds and metres, y up; an empty cell was not measured\ntime");
    let mut taken = Names::reserved(&["time", "frame"]);
    let frames = 0..trajectories.num_frames();
    let has_sigma: Vec<bool> = (0..trajectories.num_points())
        .map(|point| {
            trajectories.has_sigmas() && frames.clone().any(|f| trajectories.sigma(f, point).is_some())
        })
        .collect();
    for (name, has_sigma) in trajectories.names().iter().zip(&has_sigma) {
        let name = taken.unique_word(name, &[',', ';', '"', '#']);
        out.push_str(&format!(",{name}_x,{name}_y,{name}_z"));
        if *has_sigma {
            out.push_str(&format!(",{name}_sigma"));
        }
    }
    out.push('\n');
    for frame in frames {
        out.push_str(&format!("{}", frame as f64 / trajectories.frame_rate()));
        for (point, position) in trajectories.frame(frame).iter().enumerate() {
            for value in position.iter() {
                out.push(',');
                if value.is_finite() {
                    crate::text::push_number(&mut out, *value);
                }
            }
            if has_sigma[point] {
                out.push(',');
                out.push_str(&trajectories.sigma(frame, point).map_or(String::new(), |s| s.to_string()));
            }
        }
        out.push('\n');
    }
    out
}
