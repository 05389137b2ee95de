//! Where PostgreSQL's programs are.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::Error;

/// The folder with `initdb`, `pg_ctl`, `postgres` and its major version.
#[derive(Debug, Clone)]
pub(crate) struct Programs {
    pub(crate) folder: PathBuf,
    pub(crate) major: String,
}

impl Programs {
    /// The newest installed, or the one that made the data.
    pub(crate) fn find(data_dir: &Path) -> Result<Self, Error> {
        let mut installed = Self::all();
        installed.sort_by_key(|programs| programs.major.parse::<u32>().unwrap_or(0));
        let Some(newest) = installed.last().cloned() else {
            return Err(Error::NotInstalled);
        };
        let Ok(found) = std::fs::read_to_string(data_dir.join("PG_VERSION")) else {
            return Ok(newest);
        };
        let found = found.trim().to_owned();
        installed.into_iter().find(|programs| programs.major == found).ok_or(Error::OtherVersion {
            data_dir: data_dir.to_owned(),
            found,
            installed: newest.major,
        })
    }

    fn all() -> Vec<Self> {
        let debian = std::fs::read_dir("/usr/lib/postgresql")
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path().join("bin"));
        let path = std::env::var_os("PATH").unwrap_or_default();
        let mut folders: Vec<PathBuf> = debian.chain(std::env::split_paths(&path)).collect();
        folders.dedup();
        folders.into_iter().filter_map(Self::in_folder).collect()
    }

    fn in_folder(folder: PathBuf) -> Option<Self> {
        // A link leads to where the rest of the installation is.
        let folder = folder.join("postgres").canonicalize().ok()?.parent()?.to_owned();
        if !["initdb", "pg_ctl"].iter().all(|program| folder.join(program).is_file()) {
            return None;
        }
        // "postgres (PostgreSQL) 15.14 (Debian …)"
        let output =
            Command::new(folder.join("postgres")).arg("--version").stdin(Stdio::null()).output().ok()?;
        let version = String::from_utf8_lossy(&output.stdout);
        let number = version.split_whitespace().nth(2)?;
        let major = number.chars().take_while(char::is_ascii_digit).collect();
        Some(Self { folder, major })
    }

    pub(crate) fn initdb(&self) -> PathBuf {
        self.folder.join("initdb")
    }

    pub(crate) fn pg_ctl(&self) -> PathBuf {
        self.folder.join("pg_ctl")
    }

    pub(crate) fn postgres(&self) -> PathBuf {
        self.folder.join("postgres")
    }
}
