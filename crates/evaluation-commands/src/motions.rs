//! Motion files of folders, as clips.

use std::{
    collections::{BTreeSet, HashSet},
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use formats::{
    archive::{self, Entry, Limits},
    motion_files::{self, Options, is_motion_file},
};
use motion_db::Clip;

/// Reads the motions of folders (ASF+AMC or BVH, also `.zst` or `.gz`), in the order of their names.
pub fn read(folders: &[PathBuf]) -> anyhow::Result<Vec<Clip>> {
    let mut clips: Vec<Clip> = Vec::new();
    let mut names = HashSet::new();
    for folder in folders {
        let mut files = Vec::new();
        collect(folder, &mut files)?;
        if files.is_empty() {
            bail!("found no .asf, .amc or .bvh file in {}", folder.display());
        }
        files.sort();
        // The same trial in two folders is one trial.
        clips.extend(clips_of(folder, &files)?.into_iter().filter(|clip| names.insert(clip.name.clone())));
    }
    clips.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(clips)
}

/// The motion files of folders.
pub fn files(folders: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    folders.iter().try_for_each(|folder| collect(folder, &mut files))?;
    Ok(files)
}

/// Reads single motion files, in the order given; skeletons of AMC files are looked for beside them.
pub fn read_files(files: &[PathBuf]) -> anyhow::Result<Vec<Clip>> {
    let mut clips = Vec::new();
    for file in files {
        let folder = file.parent().unwrap_or(Path::new(""));
        let beside = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let mut needed = BTreeSet::from([file.clone()]);
        let entries =
            fs::read_dir(beside).with_context(|| format!("cannot read folder {}", beside.display()))?;
        for entry in entries {
            let name = entry?.file_name();
            let text = name.to_string_lossy().to_ascii_lowercase();
            if is_motion_file(&text) && (text == "index.csv" || text.contains(".asf")) {
                needed.insert(folder.join(name));
            }
        }
        clips.extend(clips_of(folder, &needed.into_iter().collect::<Vec<_>>())?);
    }
    Ok(clips)
}

/// The motions of some files of a folder.
fn clips_of(folder: &Path, files: &[PathBuf]) -> anyhow::Result<Vec<Clip>> {
    let mut entries: Vec<Entry> = Vec::new();
    for file in files {
        let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        let name = file.strip_prefix(folder).unwrap_or(file).to_string_lossy();
        entries.extend(archive::entries(&name, &bytes, &Limits::default())?);
    }
    let read = motion_files::clips(&entries, &Options::default())
        .with_context(|| format!("cannot read the motions of {}", folder.display()))?;
    for warning in &read.warnings {
        eprintln!("warning: {warning}");
    }
    let clip = |file: motion_files::MotionFile| Clip {
        name: file.name,
        subject: file.subject,
        action: file.action,
        motion: file.motion,
    };
    Ok(read.value.into_iter().map(clip).collect())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("cannot read folder {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.file_name().is_some_and(|name| is_motion_file(&name.to_string_lossy())) {
            files.push(path);
        }
    }
    Ok(())
}
