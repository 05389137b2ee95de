//! Packing folders of motion files into one archive to upload.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use formats::{
    archive::without_compression,
    motion_files::{FileUse, is_motion_file},
};

const ARCHIVES: [&str; 6] = [".zip", ".tar", ".tar.gz", ".tgz", ".tar.zst", ".tzst"];

/// Motions are uploaded in pieces of so many bytes: a server takes 512 MiB, and reads pieces one after the other.
const PIECE_BYTES: u64 = 128 << 20;

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

/// Archives as they are; loose files and what is in folders packed into one, or several if they are many.
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
            ensure!(
                uploads.iter().all(|upload: &Upload| upload.name != file_name),
                "two archives are called {file_name}; one would replace the other, so rename one"
            );
            uploads.push(Upload { name: file_name, file, num_files: 0 });
        } else if is_motion_file(&file_name) {
            single.push(path.clone());
        } else {
            bail!(
                "{} is neither a motion file (.asf, .amc, .bvh, also with .zst or .gz) nor an archive or a folder",
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
    // the order of a folder is no order
    loose.sort_by(|a, b| a.1.cmp(&b.1));
    let pieces = pieces(loose)?;
    for (number, piece) in pieces.iter().enumerate() {
        let name = match pieces.len() {
            1 => format!("{name}.tar"),
            _ => format!("{name}.{:03}.tar", number + 1),
        };
        uploads.push(Upload { name, file: write_tar(piece)?, num_files: piece.len() });
    }
    if uploads.is_empty() {
        bail!("no motion files (.asf, .amc, .bvh, also with .zst or .gz) in {}", listed(paths));
    }
    Ok(uploads)
}

/// Motions in pieces that a server takes; in each all that tells of motions, skeletons and indices.
fn pieces(files: Vec<(PathBuf, PathBuf)>) -> anyhow::Result<Vec<Vec<(PathBuf, PathBuf)>>> {
    let is_motion = |(_, name): &(PathBuf, PathBuf)| {
        let file = name.file_name().map(|n| n.to_string_lossy()).unwrap_or_default();
        matches!(FileUse::from_name(without_compression(&file)), FileUse::Motion(_))
    };
    let (motions, support): (Vec<_>, Vec<_>) = files.into_iter().partition(is_motion);
    let mut pieces: Vec<Vec<(PathBuf, PathBuf)>> = Vec::new();
    let mut bytes = 0;
    for file in motions {
        let size = fs::metadata(&file.0).with_context(|| file.0.display().to_string())?.len();
        if pieces.is_empty() || bytes + size > PIECE_BYTES {
            pieces.push(support.clone());
            bytes = 0;
        }
        bytes += size;
        if let Some(piece) = pieces.last_mut() {
            piece.push(file);
        }
    }
    if pieces.is_empty() && !support.is_empty() {
        pieces.push(support);
    }
    for piece in &mut pieces {
        piece.sort_by(|a, b| a.1.cmp(&b.1));
    }
    Ok(pieces)
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

fn has_extension(name: &str, extensions: &[&str]) -> bool {
    let lower = name.to_ascii_lowercase();
    extensions.iter().any(|extension| lower.ends_with(extension))
}

/// All motion files under `folder`, with their paths relative to `base`.
pub fn collect(base: &Path, folder: &Path, found: &mut Vec<(PathBuf, PathBuf)>) -> anyhow::Result<()> {
    collect_where(base, folder, &is_motion_file, found)
}

/// All files under `folder` whose names are wanted, with their paths relative to `base`; a file is one by itself.
pub fn collect_where(
    base: &Path,
    folder: &Path,
    is_wanted: &dyn Fn(&str) -> bool,
    found: &mut Vec<(PathBuf, PathBuf)>,
) -> anyhow::Result<()> {
    if !folder.is_dir() {
        found.push((folder.to_owned(), folder.strip_prefix(base)?.to_owned()));
        return Ok(());
    }
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let entry = entry?;
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            collect_where(base, &path, is_wanted, found)?;
        } else if is_wanted(&entry.file_name().to_string_lossy()) && path.is_file() {
            found.push((path.clone(), path.strip_prefix(base)?.to_owned()));
        }
    }
    Ok(())
}

/// Whether a file is an archive by its name.
pub fn is_archive(name: &str) -> bool {
    has_extension(name, &ARCHIVES)
}

/// Archives as they are; whatever else is wanted in one archive.
pub fn pack_where(
    name: &str,
    paths: &[PathBuf],
    is_wanted: &dyn Fn(&str) -> bool,
) -> anyhow::Result<Vec<Upload>> {
    let (mut uploads, mut loose) = (Vec::new(), Vec::new());
    for path in paths {
        let file_name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() {
            // folders side by side keep their names, so that files of one name don't meet
            let base = path.parent().unwrap_or(Path::new(""));
            collect_where(base, path, is_wanted, &mut loose)?;
        } else if is_archive(&file_name) {
            uploads.push(Upload { name: file_name, file: open(path)?, num_files: 0 });
        } else if is_wanted(&file_name) {
            loose.push((path.clone(), file_name.into()));
        } else {
            bail!("{} is neither a file of scans nor an archive or a folder", path.display());
        }
    }
    loose.sort_by(|a, b| a.1.cmp(&b.1));
    if !loose.is_empty() {
        uploads.push(Upload {
            name: format!("{name}.tar"),
            file: write_tar(&loose)?,
            num_files: loose.len(),
        });
    }
    if uploads.is_empty() {
        bail!("no scans (.obj, .ply, .npy) in {}", listed(paths));
    }
    Ok(uploads)
}

/// Files, each with its name in it, as an archive.
pub fn write_tar(files: &[(PathBuf, PathBuf)]) -> anyhow::Result<File> {
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

fn listed(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// Opens a file that is to be uploaded.
///
/// # Errors
/// If it can't be read, is empty, or is a pipe or device, which has no end that could be told.
pub fn open(path: &Path) -> anyhow::Result<File> {
    let named = || path.display().to_string();
    // before it is opened: that of a pipe waits for a writer
    let metadata = fs::metadata(path).with_context(named)?;
    ensure!(metadata.is_file(), "{} is not a file", path.display());
    ensure!(metadata.len() > 0, "{} is empty", path.display());
    File::open(path).with_context(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_broke_off_while_it_was_downloaded_is_left_out() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        for name in ["16.asf.part", "16_01.amc.part"] {
            fs::write(folder.path().join(name), "x")?;
        }
        let message = pack("walks", &[folder.path().to_owned()]).unwrap_err().to_string();
        assert!(message.starts_with("no motion files") && message.contains("in /"), "{message}");
        fs::write(folder.path().join("16.asf"), "x")?;
        assert_eq!(pack("walks", &[folder.path().to_owned()])?[0].num_files, 1);
        let alone = pack("walks", &[folder.path().join("16.asf.part")]).unwrap_err().to_string();
        assert!(alone.contains("16.asf.part is neither a motion file"), "{alone}");
        Ok(())
    }

    #[test]
    fn many_motions_go_in_pieces_each_with_all_skeletons() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        for name in ["16.asf", "index.csv", "16_01.amc", "16_02.amc", "16_03.bvh"] {
            fs::write(folder.path().join(name), "x")?;
        }
        // sparse: it takes no room
        File::options().write(true).open(folder.path().join("16_02.amc"))?.set_len(PIECE_BYTES)?;
        let mut found = Vec::new();
        collect(folder.path(), folder.path(), &mut found)?;
        found.sort();
        let names: Vec<Vec<String>> = pieces(found)?
            .iter()
            .map(|piece| piece.iter().map(|(_, name)| name.display().to_string()).collect())
            .collect();
        assert_eq!(
            names,
            [
                ["16.asf", "16_01.amc", "index.csv"],
                ["16.asf", "16_02.amc", "index.csv"],
                ["16.asf", "16_03.bvh", "index.csv"]
            ]
        );
        Ok(())
    }
}
