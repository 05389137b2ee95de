//! What the job of this service is given.

use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// Payload of [`crate::BUILD_MOTION_DATABASE`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BuildMotionDatabase {
    /// The database to build.
    pub motion_database: MotionDatabaseName,
    /// What it is built from, in order of name.
    pub files: Vec<InputFile>,
}

/// A motion database by id, name and version.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionDatabaseName {
    /// The row in `motion_databases`.
    pub id: Uuid,
    /// Name in its project.
    pub name: String,
    /// Version of that name, from 1.
    pub version: i32,
}

/// An uploaded file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InputFile {
    /// Name given by the user.
    pub name: String,
    /// `motion` or `skeleton`; both are read alike.
    #[serde(default)]
    pub role: String,
    /// Where it is in the object store.
    pub store_key: String,
    /// Size, bytes.
    pub bytes: u64,
    /// BLAKE3 of the content, hex.
    pub blake3: String,
}
