//! Which server to talk to: the one named, or the one that `marey up` started here.

use std::{
    fs,
    io::Write,
    os::unix::fs::{OpenOptionsExt, PermissionsExt},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

/// Folder in which `marey up` keeps its things unless told otherwise.
pub const DEFAULT_DATA_DIR: &str = ".marey";

/// A server and a key to it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Server {
    /// such as `http://127.0.0.1:8080`
    pub url: String,
    /// `mk_…`
    pub api_key: String,
    /// its PostgreSQL, when it runs here
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub database_url: Option<String>,
}

impl Server {
    /// The server named, or the one that was started in this folder or one above.
    pub fn find(url: Option<String>, api_key: Option<String>) -> anyhow::Result<Self> {
        match (url, api_key) {
            (Some(url), Some(api_key)) => Ok(Self { url, api_key, database_url: None }),
            (Some(url), None) => {
                // the key of a server started here also fits when it is named
                match Self::local()? {
                    Some(local) if local.url == url.trim_end_matches('/') => Ok(local),
                    _ => bail!("there is no API key for {url}: set MAREY_API_KEY or give --api-key"),
                }
            }
            (None, key) => {
                let local = Self::local()?.context(
                    "no server: start one with `marey up`, or set MAREY_URL and MAREY_API_KEY to use another",
                )?;
                Ok(Self { api_key: key.unwrap_or(local.api_key.clone()), ..local })
            }
        }
    }

    /// The server started in this folder or one above.
    pub fn local() -> anyhow::Result<Option<Self>> {
        let here = std::env::current_dir().context("the current folder")?;
        here.ancestors()
            .map(|folder| file(&folder.join(DEFAULT_DATA_DIR)))
            .find(|path| path.exists())
            .map(|path| Self::read(&path))
            .transpose()
    }

    /// The server whose data are in `data_dir`, if it ever ran.
    pub fn in_data_dir(data_dir: &Path) -> anyhow::Result<Option<Self>> {
        let path = file(data_dir);
        path.exists().then(|| Self::read(&path)).transpose()
    }

    fn read(path: &Path) -> anyhow::Result<Self> {
        let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    }

    /// Keeps it in `data_dir`, readable for nobody else.
    pub fn write(&self, data_dir: &Path) -> anyhow::Result<PathBuf> {
        let path = file(data_dir);
        let name = || path.display().to_string();
        let mut file = fs::OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&path)
            .with_context(name)?;
        // also when it was there before with other permissions
        file.set_permissions(fs::Permissions::from_mode(0o600)).with_context(name)?;
        file.write_all(&serde_json::to_vec_pretty(self)?).with_context(name)?;
        Ok(path)
    }
}

fn file(data_dir: &Path) -> PathBuf {
    data_dir.join("connection.json")
}
