//! Recorded takes in a folder: ASF with AMC, or BVH, also compressed.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use formats::{
    archive::{self, Entry, Limits},
    motion_files::{self, FileUse, Pairing},
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

/// The takes of a folder.
#[derive(Debug)]
pub struct Takes {
    /// by name
    pub takes: Vec<Take>,
    /// motion files that are no takes: AMC, of which no ASF is the skeleton
    pub without_skeleton: Vec<PathBuf>,
}

impl Take {
    /// All takes under `folder`.
    ///
    /// # Errors
    /// If it is no folder, or can't be read.
    pub fn find_all(folder: &Path) -> anyhow::Result<Takes> {
        if !fs::metadata(folder).with_context(|| folder.display().to_string())?.is_dir() {
            bail!("{} is a file, expected a folder of recordings", folder.display());
        }
        let mut files = Vec::new();
        pack::collect(folder, folder, &mut files)?;
        let mut files: Vec<(String, PathBuf)> =
            files.into_iter().map(|(path, inner)| (plain_name(&inner), path)).collect();
        files.sort();
        let is_index = |name: &str| FileUse::from_name(name) == FileUse::Index;
        let is_skeleton = |name: &str| matches!(FileUse::from_name(name), FileUse::Skeleton(_));
        let indices: Vec<&PathBuf> =
            files.iter().filter(|(name, _)| is_index(name)).map(|(_, path)| path).collect();
        let skeletons: Vec<&(String, PathBuf)> = files.iter().filter(|(name, _)| is_skeleton(name)).collect();
        // as a motion database built from the folder pairs them
        let pairing = Pairing::new(skeletons.iter().map(|(name, _)| name.as_str()));
        let mut without_skeleton = Vec::new();
        let mut takes: Vec<Self> = files
            .iter()
            .filter_map(|(name, path)| {
                let FileUse::Motion(format) = FileUse::from_name(name) else { return None };
                let skeleton = if format.has_own_skeleton() {
                    None
                } else if let Some(index) = pairing.skeleton_of(name) {
                    Some(skeletons[index].1.clone())
                } else {
                    without_skeleton.push(path.clone());
                    return None;
                };
                let beside =
                    |index: &&&PathBuf| index.parent().is_some_and(|folder| path.starts_with(folder));
                let indices = indices.iter().filter(beside).map(|index| index.to_path_buf()).collect();
                Some(Self { name: stem(name).to_owned(), motion: path.clone(), skeleton, indices })
            })
            .collect();
        takes.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Takes { takes, without_skeleton })
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

/// The name without folders and ending.
fn stem(name: &str) -> &str {
    let file = name.rsplit_once('/').map_or(name, |(_, file)| file);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// The name with its folders, whatever it is compressed with.
fn plain_name(path: &Path) -> String {
    archive::without_compression(&path.to_string_lossy()).to_owned()
}

fn unpacked(path: &Path) -> anyhow::Result<Entry> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut entries = archive::entries(&name, &bytes, &Limits::default())?;
    // a file that is no archive is one entry
    entries.pop().with_context(|| format!("{}: nothing in it", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_are_paired_as_in_a_motion_database_of_the_folder() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let files = [
            "bodies/16.asf.gz",
            "bodies/ann.asf",
            "bodies/ann_2.asf",
            "takes/16_15.amc",
            "takes/ann_2_1.amc",
        ];
        for name in files.iter().chain(&["takes/walk.bvh", "takes/._16_15.amc", "takes/other.amc"]) {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().context("a folder")?)?;
            fs::write(path, "x")?;
        }
        let Takes { takes, without_skeleton } = Take::find_all(folder.path())?;
        let found: Vec<_> = takes
            .iter()
            .map(|take| {
                (take.name.as_str(), take.skeleton.as_deref().map(|path| path.ends_with("16.asf.gz")))
            })
            .collect();
        assert_eq!(found, [("16_15", Some(true)), ("ann_2_1", Some(false)), ("walk", None)]);
        assert_eq!(without_skeleton, [folder.path().join("takes/other.amc")]);
        assert_eq!(takes[1].skeleton, Some(folder.path().join("bodies/ann_2.asf")));
        Ok(())
    }
}
