//! Packing folders of motion files into one archive to upload.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};

const ARCHIVES: [&str; 6] = [".zip", ".tar", ".tar.gz", ".tgz", ".tar.zst", ".tzst"];
const MOTION_FILES: [&str; 3] = [".asf", ".amc", ".bvh"];

/// What to upload for a motion database.
#[derive(Debug)]
pub struct Upload {
    /// its name there
    pub name: String,
    /// its content
    pub file: File,
    /// motion files in it, if it was packed here
    pub num_files: usize,
}

/// Archives as they are; loose files and what is in folders packed into one.
pub fn pack(name: &str, paths: &[PathBuf]) -> anyhow::Result<Vec<Upload>> {
    let mut uploads = Vec::new();
    let mut loose = Vec::new();
    let mut single = Vec::new();
    for path in paths {
        let file_name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() {
            collect(path, path, &mut loose)?;
        } else if has_extension(&file_name, &ARCHIVES) {
            let file = open(path)?;
            uploads.push(Upload { name: file_name, file, num_files: 0 });
        } else if is_motion_file(&file_name) {
            single.push(path.clone());
        } else {
            bail!(
                "{} is no archive, no motion file (.asf, .amc, .bvh, also with .zst or .gz) and no folder",
                path.display()
            );
        }
    }
    // files given one by one keep their folders as far as these differ
    let above = common_folder(&single);
    for path in single {
        let name = path.strip_prefix(&above)?.to_owned();
        loose.push((path, name));
    }
    if !loose.is_empty() {
        // the order of a folder is no order
        loose.sort_by(|a, b| a.1.cmp(&b.1));
        let num_files = loose.len();
        let file = write_tar(&loose)?;
        uploads.push(Upload { name: format!("{name}.tar"), file, num_files });
    }
    if uploads.is_empty() {
        bail!("there are no motion files (.asf, .amc, .bvh, also with .zst or .gz) in what was given");
    }
    Ok(uploads)
}

fn common_folder(files: &[PathBuf]) -> PathBuf {
    let folders = || files.iter().map(|file| file.parent().unwrap_or(Path::new("")));
    let first = folders().next().unwrap_or(Path::new(""));
    first
        .ancestors()
        .find(|above| folders().all(|folder| folder.starts_with(above)))
        .unwrap_or(Path::new(""))
        .to_owned()
}

/// Whether a file holds motion or a skeleton by its name, or says more of those beside it.
pub fn is_motion_file(name: &str) -> bool {
    name.eq_ignore_ascii_case("index.csv")
        || has_extension(
            name.strip_suffix(".zst").or(name.strip_suffix(".gz")).unwrap_or(name),
            &MOTION_FILES,
        )
}

fn has_extension(name: &str, extensions: &[&str]) -> bool {
    let lower = name.to_ascii_lowercase();
    extensions.iter().any(|extension| lower.ends_with(extension))
}

/// All motion files under `folder`, with their paths relative to `base`.
pub fn collect(base: &Path, folder: &Path, found: &mut Vec<(PathBuf, PathBuf)>) -> anyhow::Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let entry = entry?;
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            collect(base, &path, found)?;
        } else if is_motion_file(&entry.file_name().to_string_lossy()) && path.is_file() {
            found.push((path.clone(), path.strip_prefix(base)?.to_owned()));
        }
    }
    Ok(())
}

fn write_tar(files: &[(PathBuf, PathBuf)]) -> anyhow::Result<File> {
    let mut builder = tar::Builder::new(tempfile::tempfile()?);
    for (path, name) in files {
        let mut file = open(path)?;
        let mut header = tar::Header::new_gnu();
        header.set_size(file.metadata()?.len());
        header.set_mode(0o644);
        builder.append_data(&mut header, name, &mut file).with_context(|| path.display().to_string())?;
    }
    let mut file = builder.into_inner()?;
    std::io::Seek::rewind(&mut file)?;
    Ok(file)
}

fn open(path: &Path) -> anyhow::Result<File> {
    File::open(path).with_context(|| path.display().to_string())
}
