use std::collections::HashMap;

use super::{FileUse, Path};
use crate::{
    Error, Result,
    archive::{Entry, without_compression},
    session::MotionFormat,
    text::{Lines, finite, name, quote},
};

/// One motion as `index.csv` describes it.
#[derive(Debug, Clone, Default)]
pub(super) struct Row {
    pub(super) subject: String,
    pub(super) action: String,
    /// frames per second
    pub(super) frame_rate: Option<f64>,
}

/// All files named `index.csv`; each is for the motions of its folder and below.
pub(super) struct Indices<'e> {
    /// deepest folder first
    list: Vec<(&'e str, HashMap<String, Row>)>,
}

impl<'e> Indices<'e> {
    pub(super) fn read(files: &[(Path<'e>, &'e Entry)]) -> Result<Self> {
        let mut list = Vec::new();
        for (path, entry) in files {
            if FileUse::from_path(path) == FileUse::Index {
                let rows = rows(&entry.bytes).map_err(|e| e.in_file(&entry.name))?;
                list.push((path.folder, rows));
            }
        }
        list.sort_by_key(|(folder, _)| std::cmp::Reverse(folder.len()));
        Ok(Self { list })
    }

    pub(super) fn row(&self, path: &Path<'_>) -> Option<&Row> {
        let stem = path.stem.to_lowercase();
        self.list.iter().filter(|(folder, _)| path.is_below(folder)).find_map(|(_, rows)| rows.get(&stem))
    }
}

/// Rows by the name of the motion in lower case.
fn rows(bytes: &[u8]) -> Result<HashMap<String, Row>> {
    let mut lines = Lines::new(bytes).filter(|line| !line.text.is_empty() && line.text[0] != b'#');
    let Some(header) = lines.next() else { return Ok(HashMap::new()) };
    let columns: Vec<_> = cells(header.text).iter().map(|c| c.to_ascii_lowercase()).collect();
    let column = |name: &[u8]| columns.iter().position(|c| c == name);
    let (file, trial) = (column(b"file"), column(b"trial"));
    if file.is_none() && trial.is_none() {
        return Err(Error::at_line(header.number, quote(header.text), "a column named file or trial"));
    }
    let (subject, action, fps) = (column(b"subject"), column(b"action"), column(b"fps"));
    let mut rows = HashMap::new();
    for line in lines {
        let cells = cells(line.text);
        let cell =
            |column: Option<usize>| column.and_then(|c| cells.get(c)).map(Vec::as_slice).unwrap_or_default();
        let file_name = name(if cell(trial).is_empty() { cell(file) } else { cell(trial) }).to_lowercase();
        if file_name.is_empty() {
            continue;
        }
        let frame_rate = match cell(fps) {
            b"" => None,
            text => Some(
                finite(text)
                    .filter(|rate| (1e-6..=1e6).contains(rate))
                    .ok_or_else(|| Error::at_line(line.number, quote(text), "fps: frames per second"))?,
            ),
        };
        let row = Row { subject: name(cell(subject)), action: name(cell(action)), frame_rate };
        rows.insert(stem(&file_name).to_owned(), row);
    }
    Ok(rows)
}

/// `16/16_15.amc.zst` is `16_15`.
fn stem(file: &str) -> &str {
    let file = file.rsplit('/').next().unwrap_or(file);
    let file = without_compression(file);
    match file.rsplit_once('.') {
        Some((stem, extension)) if MotionFormat::from_extension(extension).is_some() => stem,
        _ => file,
    }
}

/// Cells of a line of CSV; in quotes a comma is text; quotes themselves are dropped.
fn cells(line: &[u8]) -> Vec<Vec<u8>> {
    let mut cells = vec![Vec::new()];
    let mut is_quoted = false;
    for byte in line {
        match byte {
            b'"' => is_quoted = !is_quoted,
            b',' if !is_quoted => cells.push(Vec::new()),
            _ => {
                if let Some(cell) = cells.last_mut() {
                    cell.push(*byte);
                }
            }
        }
    }
    cells.iter().map(|cell| cell.trim_ascii().to_vec()).collect()
}
