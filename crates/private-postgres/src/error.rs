//! Why a cluster cannot be started or stopped.

use std::path::PathBuf;

/// What can go wrong with a private cluster.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No PostgreSQL server is installed.
    #[error(
        "no initdb and pg_ctl in /usr/lib/postgresql/*/bin or PATH: install PostgreSQL (Debian: postgresql)"
    )]
    NotInstalled,
    /// The server does not run as root, and there is nobody else to run it.
    #[error("running as root, and /etc/passwd has no user postgres or nobody to run the server")]
    NoServerUser,
    /// A socket's path has a short limit, set by the kernel.
    #[error("socket path {path} has {found} bytes, the limit is {limit}: choose a shorter folder")]
    SocketPathTooLong {
        /// The path.
        path: PathBuf,
        /// Its length, bytes.
        found: usize,
        /// The longest possible, bytes.
        limit: usize,
    },
    /// Another process runs a cluster in this folder.
    #[error(
        "{0} is in use: another Marey runs on this folder; stop it, or choose another folder (--data-dir)"
    )]
    InUse(PathBuf),
    /// The data were written by another major version of PostgreSQL.
    #[error("{data_dir} was made by PostgreSQL {found}, but only {installed} is installed")]
    OtherVersion {
        /// The data folder.
        data_dir: PathBuf,
        /// Version of the data.
        found: String,
        /// Version of the binaries, or none.
        installed: String,
    },
    /// A folder above is closed to the user that runs the server.
    #[error(
        "{folder} cannot be entered by user {user}, who runs the server: choose a folder elsewhere or open it"
    )]
    NotTraversable {
        /// The closed folder.
        folder: PathBuf,
        /// Who runs the server.
        user: String,
    },
    /// A file or folder could not be made or changed.
    #[error("{path}: {source}")]
    Io {
        /// Where.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The server refused.
    #[error("database: {0}")]
    Database(#[from] sqlx::Error),
    /// One of PostgreSQL's programs failed.
    #[error("{program} failed: {output}")]
    Program {
        /// Which.
        program: &'static str,
        /// What it printed, and the end of the server's log with its path.
        output: String,
    },
}

impl Error {
    pub(crate) fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }
}
