//! What can go wrong with the object store.

use crate::Key;

/// An error of the object store.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The store can't be opened.
    #[error("object store {location} can't be opened: {reason}")]
    Open {
        /// The store's location as configured.
        location: String,
        /// Why not.
        reason: String,
    },
    /// The location is neither a folder nor a known URL.
    #[error("object store location {found:?} is not a folder, file:// or s3:// URL")]
    BadLocation {
        /// What was configured.
        found: String,
    },
    /// A key with empty, hidden or escaping parts.
    #[error(
        "object key {found:?} is not valid: parts must be made of letters, digits and -_.+ and not start with a dot"
    )]
    BadKey {
        /// The refused key.
        found: String,
    },
    /// There is no such object.
    #[error("object {key} is not in the store")]
    NotFound {
        /// The key asked for.
        key: Key,
    },
    /// The object exists and was to be created.
    #[error("object {key} exists already")]
    AlreadyExists {
        /// The key in question.
        key: Key,
    },
    /// The object is larger than the reader or the upload allows.
    #[error("object {key} is larger than the allowed {limit_bytes} bytes")]
    TooLarge {
        /// The key in question.
        key: Key,
        /// The limit, bytes.
        limit_bytes: u64,
    },
    /// Stored bytes are not those that were written.
    #[error("object {key} is damaged: blake3 is {found}, expected {expected}")]
    Corrupt {
        /// The key in question.
        key: Key,
        /// BLAKE3 recorded at write, hex.
        expected: String,
        /// BLAKE3 of the bytes read, hex.
        found: String,
    },
    /// An upload does not match the checksum its sender gave; nothing was stored.
    #[error("upload of {key} has blake3 {found}, its sender announced {expected}")]
    ChecksumMismatch {
        /// The key in question.
        key: Key,
        /// BLAKE3 announced, hex.
        expected: String,
        /// BLAKE3 received, hex.
        found: String,
    },
    /// The sender's stream broke off; nothing was stored.
    #[error("upload of {key} broke off after {bytes} bytes: {reason}")]
    Interrupted {
        /// The key in question.
        key: Key,
        /// Bytes received until then.
        bytes: u64,
        /// The stream's error.
        reason: String,
    },
    /// The backend failed: disk full, no permission, network.
    #[error("object store failed at {key}: {source}")]
    Backend {
        /// The key or prefix in question.
        key: String,
        /// The backend's error.
        source: object_store::Error,
    },
}

impl Error {
    /// Whether trying again later may help (backend trouble), as opposed to a fact about the object.
    pub fn is_transient(&self) -> bool {
        matches!(self, Self::Backend { .. } | Self::Interrupted { .. })
    }

    /// Trouble with the store's folder itself.
    pub(crate) fn from_io(error: std::io::Error) -> Self {
        let source = object_store::Error::Generic { store: "folder", source: Box::new(error) };
        Self::Backend { key: "its folder".to_owned(), source }
    }

    pub(crate) fn at(key: &Key) -> impl Fn(object_store::Error) -> Self + Send + use<> {
        let key = key.clone();
        move |source| match source {
            object_store::Error::NotFound { .. } => Self::NotFound { key: key.clone() },
            object_store::Error::AlreadyExists { .. } => Self::AlreadyExists { key: key.clone() },
            source => Self::Backend { key: key.to_string(), source },
        }
    }
}
