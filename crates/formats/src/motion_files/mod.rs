//! From the files of an archive to motions: AMC with its ASF, and BVH.

mod file_use;
mod index;
mod pairing;
mod path;
mod skeletons;

use model::Motion;

use crate::{
    Error, Place, Read, Result, Warning, amc,
    archive::{Entry, without_compression},
    bvh,
    text::Names,
};
use index::Indices;
use path::Path;
use skeletons::Skeletons;

pub use file_use::FileUse;
pub use pairing::Pairing;

/// What to do with a file that can't be read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Broken {
    /// give up and name it
    #[default]
    Refuse,
    /// leave it out, with a warning
    Skip,
}

/// What the files may not say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// frames per second of AMC files for which neither `index.csv` nor the file has another; 120 by default, as in
    /// the CMU database
    pub amc_frame_rate: f64,
    /// unit of BVH files
    pub bvh: bvh::Options,
    /// what to do with a file that can't be read
    pub broken: Broken,
}

impl Default for Options {
    fn default() -> Self {
        Self { amc_frame_rate: 120.0, bvh: bvh::Options::default(), broken: Broken::default() }
    }
}

/// A motion and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFile {
    /// name of the file without folders and ending, `16_15`
    pub name: String,
    /// the person, `16`: column `subject` of `index.csv`, else the name before the first `_`
    pub subject: String,
    /// what is done, column `action` of `index.csv`; empty if unknown
    pub action: String,
    /// the motion
    pub motion: Motion,
}

/// Whether a file of that name is one that [`clips`] makes something of: motion, a skeleton or an index, also packed by
/// Zstandard or gzip.
pub fn is_motion_file(name: &str) -> bool {
    FileUse::from_name(without_compression(name)) != FileUse::None
}

/// The motions of all AMC and BVH files, in the order of their paths.
///
/// AMC files are on the skeletons that [`Pairing`] finds for them. Files named `index.csv` may give the columns `file`
/// or `trial`, and `action`, `subject` and `fps` (of AMC).
/// Hidden files and all others are left alone.
///
/// # Errors
/// If a file can't be read and is not to be skipped, or there is no motion. The file is named.
pub fn clips(entries: &[Entry], options: &Options) -> Result<Read<Vec<MotionFile>>> {
    let mut files: Vec<(Path<'_>, &Entry)> = entries.iter().map(|e| (Path::from_name(&e.name), e)).collect();
    files.retain(|(path, _)| !path.is_hidden());
    files.sort_by(|(_, a), (_, b)| a.name.cmp(&b.name));
    let mut warnings = Vec::new();
    let indices = Indices::read(&files)?;
    let skeletons = Skeletons::new(&files);
    let mut names = Names::default();
    let mut clips = Vec::new();
    for (path, entry) in &files {
        let FileUse::Motion(format) = FileUse::from_path(path) else { continue };
        let row = indices.row(path);
        let read = format.read_alone(&entry.bytes, &options.bvh).unwrap_or_else(|| {
            let stated = row.and_then(|r| r.frame_rate).or_else(|| amc::stated_frame_rate(&entry.bytes));
            skeletons.read_amc(entry, stated.unwrap_or(options.amc_frame_rate))
        });
        let read = match (read, options.broken) {
            (Ok(read), _) => read,
            (Err(e), Broken::Refuse) => return Err(named(e, &entry.name)),
            (Err(e), Broken::Skip) => {
                let message = format!("{} is left out", named(e, &entry.name));
                warnings.push(Warning { place: Place::File, message });
                continue;
            }
        };
        let in_file = read.warnings.iter().map(|w| format!("{}: {w}", entry.name));
        warnings.extend(in_file.map(|message| Warning { place: Place::File, message }));
        let name = names.unique(path.stem);
        if name != path.stem {
            let message =
                format!("{}: two motions are named {}; the second was renamed {name}", entry.name, path.stem);
            warnings.push(Warning { place: Place::File, message });
        }
        let subject = row.map(|r| r.subject.clone()).filter(|s| !s.is_empty());
        clips.push(MotionFile {
            subject: subject.unwrap_or_else(|| path.subject().to_owned()),
            action: row.map(|r| r.action.clone()).unwrap_or_default(),
            name,
            motion: read.value,
        });
    }
    if clips.is_empty() {
        let skipped = warnings.iter().map(|w| w.message.as_str()).next();
        let found = match (skipped, files.len()) {
            (Some(skipped), _) => skipped.to_owned(),
            (None, 0) => "no file".to_owned(),
            (None, 1) => "one file, which is no motion".to_owned(),
            (None, several) => format!("{several} files, no motion among them"),
        };
        return Err(Error::whole_file(found, "at least one AMC file with its ASF file, or a BVH file"));
    }
    Ok(Read { value: clips, warnings })
}

fn named(error: Error, file: &str) -> Error {
    match error {
        // the file that is broken is the ASF, which is named already
        Error::InFile { .. } => error,
        other => other.in_file(file),
    }
}
