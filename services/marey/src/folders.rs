//! Folders that commands write to.

use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};

/// Makes a folder for a command's files alone, which must not be there unless it is empty.
///
/// # Errors
/// If it has something in it, which stays as it is.
pub fn empty_folder(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    if fs::read_dir(folder).with_context(|| folder.display().to_string())?.next().is_some() {
        bail!("{} is not empty; choose a new folder", folder.display());
    }
    Ok(())
}

/// Makes a folder for results: the one asked for, which must not be there unless it is empty, or the first free one of `name`,
/// `name-2`, `name-3` and so on. What was there before stays as it is.
pub fn new_folder(asked: Option<&Path>, name: &str) -> anyhow::Result<PathBuf> {
    if let Some(folder) = asked {
        empty_folder(folder)?;
        return Ok(folder.to_owned());
    }
    for number in 1_u64.. {
        let folder = PathBuf::from(if number == 1 { name.to_owned() } else { format!("{name}-{number}") });
        match fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error).with_context(|| folder.display().to_string()),
        }
    }
    bail!("no name is free after {name}")
}

/// Removes a folder of drawn inputs with all that is in it, if it is there.
pub fn remove(folder: &Path) -> anyhow::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| folder.display().to_string())
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_demo_has_a_folder_of_its_own() -> anyhow::Result<()> {
        let place = tempfile::tempdir()?;
        let name = place.path().join("marey-demo").display().to_string();
        let first = new_folder(None, &name)?;
        fs::write(first.join("picture.svg"), "first")?;
        for number in 2..4 {
            assert_eq!(new_folder(None, &name)?.display().to_string(), format!("{name}-{number}"));
        }
        assert_eq!(fs::read(first.join("picture.svg"))?, b"first");
        let asked = place.path().join("a/b");
        assert_eq!(new_folder(Some(&asked), &name)?, asked);
        assert_eq!(new_folder(Some(&asked), &name)?, asked, "it is still empty");
        let refused = new_folder(Some(&first), &name).unwrap_err().to_string();
        assert!(refused.contains("is not empty"), "{refused}");
        Ok(())
    }
}
