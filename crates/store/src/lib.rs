//! Object store: where uploads, artefacts and results live, and how they are named.
//!
//! One [`Store`] serves every process. Objects are written whole or not at all (written beside, synced,
//! then renamed), their size and BLAKE3 are computed while they are written, and a reader says how much it
//! is ready to hold, so that no object can be larger than the memory meant for it.
//!
//! ```
//! # tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(async {
//! use store::{Location, Store, key};
//! let folder = tempfile::tempdir().unwrap();
//! let store = Store::open(&Location::folder(folder.path())).unwrap();
//! let key = key::motion_database(uuid::Uuid::nil(), 42, 1, "index.mdb").unwrap();
//! let stored = store.put(&key, "bytes of an index".into()).await.unwrap();
//! assert_eq!(stored.bytes, 17);
//! assert_eq!(store.get_checked(&key, &stored.blake3, 1024).await.unwrap(), "bytes of an index");
//! # });
//! ```
mod abandoned;
mod error;
pub mod key;
mod location;
mod orphans;
mod read;
mod write;

pub use error::Error;
pub use key::Key;
pub use location::Location;
pub use write::{Stored, UploadLimits};

use object_store::{ObjectStore, local::LocalFileSystem};
use std::{path::PathBuf, sync::Arc};

/// A handle on the object store; cheap to clone, shared by all tasks of a process.
#[derive(Debug, Clone)]
pub struct Store {
    backend: Arc<dyn ObjectStore>,
    /// of a store that is a folder
    folder: Option<PathBuf>,
}

impl Store {
    /// Opens the store at `location`; a folder is made when it is not there yet.
    ///
    /// # Errors
    /// [`Error::Open`] if the folder can't be made or read, or this build has no such backend.
    pub fn open(location: &Location) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Open { location: location.to_string(), reason };
        match location {
            Location::Folder(path) => {
                std::fs::create_dir_all(path).map_err(|e| refuse(e.to_string()))?;
                let backend = LocalFileSystem::new_with_prefix(path)
                    .map_err(|e| refuse(e.to_string()))?
                    // A row in PostgreSQL that names an object must never outlive the object in a power cut.
                    .with_fsync(true)
                    .with_automatic_cleanup(true);
                let folder = path.canonicalize().map_err(|e| refuse(e.to_string()))?;
                Ok(Self { backend: Arc::new(backend), folder: Some(folder) })
            }
            Location::S3 { .. } => Err(refuse("this build has no S3 backend; use a shared folder".into())),
        }
    }

    /// The file that holds an object, where the store is a folder. It may be mapped: objects are written under another
    /// name, renamed and never changed after. Whether there is one is not looked at.
    pub fn path(&self, key: &Key) -> Option<PathBuf> {
        self.folder.as_ref().map(|folder| folder.join(key.as_str()))
    }
}
