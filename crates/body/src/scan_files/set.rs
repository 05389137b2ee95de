//! The files that a body model is learned from.

use formats::archive::Entry;
use model::counted;
use serde::{Deserialize, Serialize};

use super::{
    file_use::FileUse,
    meshes::{self, RawScan, stem},
    rig::{RigEntries, template},
    tables,
};
use crate::{Error, LearnOptions, Learned, Result, Scan, Subject, Template, learn};

/// Most scans of one model.
const MAX_SCANS: usize = 4096;
/// Most vertices of all scans together: twelve hundred times the shipped model's.
const MAX_VERTICES: usize = 8_000_000;
/// Heights of people who stand, metres.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.8..=2.6;

/// What files of scans do not say of themselves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScanOptions {
    /// metres of one unit of the scans; 1 when left out, for arrays whichever of 1, 0.01, 0.001 and 0.0001 makes people
    pub metres_per_unit: Option<f64>,
}

/// Scans and their template, read but not yet compared.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanSet {
    /// what all scans have in common
    pub template: Template,
    scans: Vec<RawScan>,
    subjects: Vec<Subject>,
    /// problems in the files, with their names
    pub warnings: Vec<String>,
}

impl ScanSet {
    /// Sorts the files out and reads them. Scans of other poses than the base pose are left out where a table says so.
    ///
    /// # Errors
    /// [`Error`] names the file that is wrong.
    pub fn read(mut entries: Vec<Entry>, options: &ScanOptions) -> Result<Self> {
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        let one = |which: FileUse| only(&entries, which);
        let mut warnings = Vec::new();
        let files: Vec<Entry> =
            entries.iter().filter(|e| FileUse::from_name(&e.name) == FileUse::Mesh).cloned().collect();
        let index = one(FileUse::Scans)?;
        let (mut scans, is_array) = match (one(FileUse::Vertices)?, files.is_empty()) {
            (Some(array), true) => (meshes::from_array(array, index)?, true),
            (None, false) => (meshes::from_files(&files, index, &mut warnings)?, false),
            (Some(array), false) => {
                let found = format!("{} and {} meshes", array.name, files.len());
                return Err(Error::ScanSet {
                    found,
                    expected: "scans in one way: an array or one file each".into(),
                });
            }
            (None, true) => {
                let found = format!("{}, no scan among them", counted(entries.len(), "file"));
                let expected = "one OBJ or PLY a scan, or vertices.npy with faces.npy".into();
                return Err(Error::ScanSet { found, expected });
            }
        };
        check_size(&scans)?;
        scale(&mut scans, options.metres_per_unit, is_array);
        let (rest, faces) = match (one(FileUse::TemplateMesh)?, one(FileUse::Faces)?) {
            (Some(entry), _) => {
                let mesh = meshes::mesh(entry, &mut warnings)?;
                (mesh.vertices, mesh.faces)
            }
            (None, faces) => first_mesh(&scans, faces)?,
        };
        let rig = RigEntries {
            rig: one(FileUse::Rig)?,
            skin_joints: one(FileUse::SkinJoints)?,
            skin_weights: one(FileUse::SkinWeights)?,
        };
        let template = template(&rest, &faces, &rig, &mut warnings)?;
        let people = tables::subjects(one(FileUse::Subjects)?)?;
        let subjects = scans.iter().map(|s| people.get(&s.subject).copied().unwrap_or_default()).collect();
        Ok(Self { template, scans, subjects, warnings })
    }

    /// Number of scans.
    pub fn num_scans(&self) -> usize {
        self.scans.len()
    }

    /// How many people tell their sex, and how many their age.
    pub fn num_told(&self) -> [usize; 2] {
        let count = |is_told: fn(&Subject) -> bool| self.subjects.iter().filter(|s| is_told(s)).count();
        [count(|s| s.sex.is_some()), count(|s| s.age_years.is_some())]
    }

    /// The scans and what is known of their people.
    pub fn scans(&self) -> Vec<Scan<'_>> {
        self.scans
            .iter()
            .zip(&self.subjects)
            .map(|(scan, subject)| Scan {
                name: &scan.name,
                vertices: &scan.vertices,
                faces: scan.faces.as_deref(),
                subject: *subject,
            })
            .collect()
    }

    /// Learns a model.
    ///
    /// # Errors
    /// [`Error`] names the first scan that is not what it should be.
    pub fn learn(&self, options: &LearnOptions) -> Result<Learned> {
        learn(&self.scans(), &self.template, options)
    }
}

/// The only file of a use, if there is any.
fn only(entries: &[Entry], which: FileUse) -> Result<Option<&Entry>> {
    let mut found = entries.iter().filter(|entry| FileUse::from_name(&entry.name) == which);
    match (found.next(), found.next()) {
        (Some(first), Some(second)) => Err(Error::ScanSet {
            found: format!("{} and {}", first.name, second.name),
            expected: format!("one {}", first.name.rsplit('/').next().unwrap_or_default()),
        }),
        (first, _) => Ok(first),
    }
}

fn check_size(scans: &[RawScan]) -> Result<()> {
    let vertices: usize = scans.iter().map(|scan| scan.vertices.len()).sum();
    if scans.len() < 2 || scans.len() > MAX_SCANS || vertices > MAX_VERTICES {
        return Err(Error::ScanSet {
            found: format!(
                "{} in the base pose, of {vertices} vertices together",
                counted(scans.len(), "scan")
            ),
            expected: format!("2 to {MAX_SCANS} of at most {MAX_VERTICES}"),
        });
    }
    Ok(())
}

/// Brings scans to metres. Arrays are often whole numbers of a smaller unit: the one that makes a person of the first scan.
fn scale(scans: &mut [RawScan], metres_per_unit: Option<f64>, is_array: bool) {
    let guessed = || {
        let heights = scans.first().into_iter().flat_map(|scan| &scan.vertices).map(|v| v.y);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        [1.0, 0.01, 0.001, 0.0001].into_iter().find(|unit| HEIGHTS_M.contains(&((high - low) * unit)))
    };
    let unit = metres_per_unit.or_else(|| if is_array { guessed() } else { None }).unwrap_or(1.0);
    if unit != 1.0 {
        scans.iter_mut().flat_map(|scan| &mut scan.vertices).for_each(|vertex| *vertex *= unit);
    }
}

type Corners = Vec<[u32; 3]>;

/// The template's mesh where none was given: the first scan's vertices, and its faces or those of all scans.
fn first_mesh(scans: &[RawScan], faces: Option<&Entry>) -> Result<(Vec<nalgebra::Vector3<f64>>, Corners)> {
    let first = &scans[0];
    if let Some(own) = &first.faces {
        return Ok((first.vertices.clone(), own.clone()));
    }
    let Some(entry) = faces else {
        let found = format!("{} without faces.npy", stem(&first.name));
        return Err(Error::ScanSet {
            found,
            expected: "faces.npy of shape [faces, 3], or template.obj".into(),
        });
    };
    let array = formats::npy::read(&entry.bytes).map_err(Error::in_file(&entry.name))?;
    let [_, 3] = array.shape[..] else {
        let found = format!("an array of shape {:?}", array.shape);
        return Err(Error::content(&entry.name, found, "shape [faces, 3]"));
    };
    let limit = first.vertices.len() as f64;
    if let Some(bad) = array.values.iter().find(|&&corner| !(corner >= 0.0 && corner < limit)) {
        return Err(Error::content(
            &entry.name,
            bad.to_string(),
            format!("indices of vertices below {limit}"),
        ));
    }
    let faces = array.values.chunks_exact(3).map(|f| [f[0] as u32, f[1] as u32, f[2] as u32]).collect();
    Ok((first.vertices.clone(), faces))
}
