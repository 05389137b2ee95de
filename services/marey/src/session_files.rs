//! What to upload for a session: files as they are, folders of pictures packed, plates renamed.

use std::{
    collections::HashMap,
    fs::File,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use formats::FileRole;

use crate::pack;

/// A file of a session, ready to be sent.
#[derive(Debug)]
pub struct SessionFile {
    /// where it is here: a file, or the folder that was packed
    pub path: PathBuf,
    /// its name there
    pub name: String,
    /// what it is for, where its name doesn't tell
    pub role: Option<FileRole>,
    /// its content
    pub file: File,
}

/// Files as they are; of folders: `plates` as plates of the cameras that its files are named after, others packed as frames.
///
/// # Errors
/// If one can't be read, or two would have the same name there.
pub fn gather(paths: &[PathBuf]) -> anyhow::Result<Vec<SessionFile>> {
    let mut found = Vec::new();
    for path in paths {
        if path.is_dir() {
            found.extend(from_folder(path)?);
            continue;
        }
        let own = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        // the shell gives the files of plates/*
        let is_plate = path.parent().is_some_and(|folder| role_of(folder) == FileRole::Plate)
            && FileRole::is_picture_file(&own);
        let (name, role) = if is_plate { (plate_name(&own), Some(FileRole::Plate)) } else { (own, None) };
        found.push(SessionFile { path: path.clone(), name, role, file: pack::open(path)? });
    }
    check_names(&found)?;
    Ok(found)
}

/// That none would replace another there.
fn check_names(files: &[SessionFile]) -> anyhow::Result<()> {
    let mut by_name: HashMap<&str, &Path> = HashMap::new();
    for SessionFile { path, name, .. } in files {
        if let Some(other) = by_name.insert(name, path) {
            bail!(
                "{} and {} would both be {name} in the session, expected a name of its own for each",
                other.display(),
                path.display()
            );
        }
    }
    Ok(())
}

fn from_folder(folder: &Path) -> anyhow::Result<Vec<SessionFile>> {
    let mut pictures = Vec::new();
    pack::collect_where(folder, folder, &FileRole::is_picture_file, &mut pictures)?;
    if pictures.is_empty() {
        let endings = FileRole::picture_endings();
        bail!("{} holds no pictures ({endings}); name the files themselves", folder.display());
    }
    pictures.sort_by(|a, b| a.1.cmp(&b.1));
    let role = role_of(folder);
    if role == FileRole::Plate {
        return pictures
            .iter()
            .map(|(path, name)| {
                let own = name.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                Ok(SessionFile {
                    path: path.clone(),
                    name: plate_name(&own),
                    role: Some(role),
                    file: pack::open(path)?,
                })
            })
            .collect();
    }
    let canonical = folder.canonicalize().with_context(|| folder.display().to_string())?;
    let stem = canonical.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let file = pack::write_tar(&pictures)?;
    Ok(vec![SessionFile { path: folder.to_owned(), name: format!("{stem}.tar"), role: Some(role), file }])
}

/// `cam01.png` as `cam01.plate.png`, so that it is not taken for another file of the camera.
fn plate_name(name: &str) -> String {
    match name.rsplit_once('.') {
        Some((stem, ending)) if !stem.to_ascii_lowercase().ends_with("plate") => {
            format!("{stem}.plate.{ending}")
        }
        _ => name.to_owned(),
    }
}

fn role_of(folder: &Path) -> FileRole {
    FileRole::from_folder(&folder.file_name().map(|n| n.to_string_lossy()).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn folders_become_plates_or_archives_of_frames() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        for name in ["plates/cam1.png", "silhouettes/cam1/0000.png", "images/cam1/0000.jpg"] {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().context("a folder")?)?;
            std::fs::write(path, "x")?;
        }
        let paths = ["plates", "silhouettes", "images"].map(|name| folder.path().join(name));
        let found: Vec<_> = gather(&paths)?.into_iter().map(|file| (file.name, file.role)).collect();
        let expected = [
            ("cam1.plate.png".to_owned(), Some(FileRole::Plate)),
            ("silhouettes.tar".to_owned(), Some(FileRole::Masks)),
            ("images.tar".to_owned(), Some(FileRole::Images)),
        ];
        assert_eq!(found, expected);
        let single = gather(&[folder.path().join("plates/cam1.png")])?;
        assert_eq!((single[0].name.as_str(), single[0].role), ("cam1.plate.png", Some(FileRole::Plate)));
        Ok(())
    }

    #[test]
    fn files_of_the_same_name_are_refused() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let make = |name: &str| -> anyhow::Result<PathBuf> {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().context("a folder")?)?;
            fs::write(&path, "x")?;
            Ok(path)
        };
        let (one, two) = (make("take0/a.asf")?, make("rec2/a.asf")?);
        let message = gather(&[one.clone(), two.clone()]).unwrap_err().to_string();
        let expected = format!("{} and {} would both be a.asf in the session", one.display(), two.display());
        assert!(message.starts_with(&expected), "{message}");
        // a plate gets another name
        let (plate, picture) = (make("plates/cam1.png")?, make("cam1.plate.png")?);
        assert!(gather(&[plate, picture]).unwrap_err().to_string().contains("both be cam1.plate.png"));
        // folders are packed by their own names
        make("a/images/cam1/0000.jpg")?;
        make("b/images/cam1/0000.jpg")?;
        let folders = ["a/images", "b/images"].map(|name| folder.path().join(name));
        assert!(gather(&folders).unwrap_err().to_string().contains("both be images.tar"));
        Ok(())
    }
}
