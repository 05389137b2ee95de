//! The meshes of scans: one a file, or all in two arrays.

use formats::archive::Entry;
use nalgebra::Vector3;

use super::tables::Table;
use crate::{Error, Result};

/// A scan as its file has it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RawScan {
    /// the file, or the row of the array
    pub name: String,
    /// who it is, as tables call them; empty if nobody says
    pub subject: String,
    pub vertices: Vec<Vector3<f64>>,
    /// none for arrays: they share theirs
    pub faces: Option<Vec<[u32; 3]>>,
}

/// Reads a mesh from OBJ or PLY; what was doubtful goes to `warnings`.
pub(crate) fn mesh(entry: &Entry, warnings: &mut Vec<String>) -> Result<model::Mesh> {
    let read = formats::mesh_files::read(&entry.name, &entry.bytes).map_err(Error::in_file(&entry.name))?;
    warnings.extend(read.warnings.into_iter().map(|w| format!("{}: {}", entry.name, w.message)));
    Ok(read.value)
}

/// Name of a file without folders and ending.
pub(crate) fn stem(name: &str) -> &str {
    let file = name.rsplit('/').next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// One scan a file; the person is the name up to `_`, unless `scans.csv` (columns `file`, `subject`, `pose`) says otherwise.
pub(crate) fn from_files(
    files: &[Entry],
    index: Option<&Entry>,
    warnings: &mut Vec<String>,
) -> Result<Vec<RawScan>> {
    let table = index.map(Table::read).transpose()?;
    let mut scans = Vec::new();
    for entry in files {
        let own = stem(&entry.name);
        let row = table.as_ref().and_then(|t| t.rows().find(|row| stem(row.get("file")) == own));
        if row.is_some_and(|row| !is_base(row.get("pose"))) {
            continue;
        }
        let mesh = mesh(entry, warnings)?;
        let subject = row.map(|row| row.get("subject")).filter(|subject| !subject.is_empty());
        let subject = subject.or(own.split('_').next()).unwrap_or_default().to_owned();
        scans.push(RawScan {
            name: entry.name.clone(),
            subject,
            vertices: mesh.vertices,
            faces: Some(mesh.faces),
        });
    }
    Ok(scans)
}

/// All scans in one array, shape `[scans, vertices, 3]`; `scans.csv` (columns `index`, `subject`, `pose`) says who they are.
pub(crate) fn from_array(array: &Entry, index: Option<&Entry>) -> Result<Vec<RawScan>> {
    let read = formats::npy::read(&array.bytes).map_err(Error::in_file(&array.name))?;
    let [count, vertices, 3] = read.shape[..] else {
        let found = format!("an array of shape {:?}", read.shape);
        return Err(Error::content(&array.name, found, "shape [scans, vertices, 3]"));
    };
    let wanted: Vec<(usize, String)> = match index {
        None => (0..count).map(|row| (row, String::new())).collect(),
        Some(index) => {
            let table = Table::read(index)?;
            let mut wanted = Vec::new();
            for row in table.rows().filter(|row| is_base(row.get("pose"))) {
                let number = row.number::<usize>("index")?.unwrap_or(usize::MAX);
                if number >= count {
                    let found = format!("index {:?}", row.get("index"));
                    return Err(Error::content(&index.name, found, format!("a number below {count}")));
                }
                wanted.push((number, row.get("subject").to_owned()));
            }
            wanted
        }
    };
    let numbers = 3 * vertices;
    let scan = |(row, subject): (usize, String)| {
        let own = read.values[row * numbers..(row + 1) * numbers].chunks_exact(3);
        let who = if subject.is_empty() { String::new() } else { format!(" ({subject})") };
        RawScan {
            name: format!("{} row {row}{who}", array.name),
            subject,
            vertices: own.map(Vector3::from_column_slice).collect(),
            faces: None,
        }
    };
    Ok(wanted.into_iter().map(scan).collect())
}

/// Whether a pose is the base pose by its name: models are learned from people who stand alike.
fn is_base(pose: &str) -> bool {
    pose.is_empty() || pose.to_ascii_lowercase().contains("base")
}
