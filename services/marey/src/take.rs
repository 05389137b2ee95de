//! Recorded takes in a folder: ASF with AMC, or BVH, also compressed.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use formats::{
    archive::{self, Entry, Limits},
    motion_files,
};
use model::Motion;

use crate::pack;

/// A take: a motion file, and its skeleton's when that is another.
#[derive(Debug, Clone)]
pub struct Take {
    /// such as `16_15`
    pub name: String,
    /// AMC or BVH
    pub motion: PathBuf,
    /// ASF; none for BVH
    pub skeleton: Option<PathBuf>,
    /// files named `index.csv` that may say more of it, its frame rate above all
    pub indices: Vec<PathBuf>,
}

/// A take as text and as motion.
#[derive(Debug)]
pub struct Recording {
    /// the motion at its own frame rate
    pub motion: Motion,
    /// the motion file, unpacked
    pub motion_text: Vec<u8>,
    /// the skeleton's file, unpacked
    pub skeleton_text: Option<Vec<u8>>,
}

impl Take {
    /// All takes under `folder`, by name. AMC files without an ASF are left out.
    pub fn find_all(folder: &Path) -> anyhow::Result<Vec<Self>> {
        let mut files = Vec::new();
        pack::collect(folder, folder, &mut files)?;
        let indices: Vec<PathBuf> = files
            .iter()
            .map(|(path, _)| path.clone())
            .filter(|path| kind(path).as_deref() == Some("csv"))
            .collect();
        let skeletons: Vec<&PathBuf> =
            files.iter().map(|(path, _)| path).filter(|path| kind(path).as_deref() == Some("asf")).collect();
        let mut takes: Vec<Self> = files
            .iter()
            .filter_map(|(path, _)| {
                let skeleton = match kind(path)?.as_str() {
                    "bvh" => None,
                    "amc" => Some(skeleton_of(path, &skeletons)?.clone()),
                    _ => return None,
                };
                let beside = |index: &&PathBuf| index.parent().is_some_and(|folder| path.starts_with(folder));
                let indices = indices.iter().filter(beside).cloned().collect();
                Some(Self { name: stem(path), motion: path.clone(), skeleton, indices })
            })
            .collect();
        takes.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(takes)
    }

    /// The name up to `_`: whose take it is.
    pub fn performer(&self) -> &str {
        self.name.split('_').next().unwrap_or_default()
    }

    /// Reads it.
    pub fn read(&self) -> anyhow::Result<Recording> {
        let motion = unpacked(&self.motion)?;
        let skeleton = self.skeleton.as_deref().map(unpacked).transpose()?;
        let mut entries = vec![motion.clone()];
        entries.extend(skeleton.clone());
        for index in &self.indices {
            entries.push(unpacked(index)?);
        }
        let clips = motion_files::clips(&entries, &motion_files::Options::default())?.value;
        let clip =
            clips.into_iter().next().with_context(|| format!("{}: no motion", self.motion.display()))?;
        Ok(Recording {
            motion: clip.motion,
            motion_text: motion.bytes,
            skeleton_text: skeleton.map(|entry| entry.bytes),
        })
    }
}

/// The performer's: the ASF whose name is the take's up to `_`, or the only one in its folder.
fn skeleton_of<'a>(motion: &Path, skeletons: &[&'a PathBuf]) -> Option<&'a PathBuf> {
    let beside: Vec<&PathBuf> = skeletons.iter().copied().filter(|s| s.parent() == motion.parent()).collect();
    let name = stem(motion);
    let performer = name.split('_').next().unwrap_or_default();
    beside
        .iter()
        .find(|skeleton| stem(skeleton) == performer)
        .or(if beside.len() == 1 { beside.first() } else { None })
        .copied()
}

/// `asf`, `amc` or `bvh`, whatever it is compressed with.
fn kind(path: &Path) -> Option<String> {
    let name = plain_name(path);
    name.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase())
}

fn stem(path: &Path) -> String {
    let name = plain_name(path);
    name.rsplit_once('.').map_or(name.clone(), |(stem, _)| stem.to_owned())
}

fn plain_name(path: &Path) -> String {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    name.strip_suffix(".zst").or(name.strip_suffix(".gz")).map_or(name.clone(), str::to_owned)
}

fn unpacked(path: &Path) -> anyhow::Result<Entry> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut entries = archive::entries(&name, &bytes, &Limits::default())?;
    // a file that is no archive is one entry
    entries.pop().with_context(|| format!("{}: nothing in it", path.display()))
}
