//! Motion databases and body models, by version.

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::Object;

/// Name of the body model that comes with the program; it has no row and no object.
pub const SHIPPED: &str = "shipped";

/// One version of a body model or motion database, by id, name and number.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct VersionName {
    /// The row in the table of its kind.
    pub id: Uuid,
    /// Name in its project.
    pub name: String,
    /// Version of that name, from 1.
    pub version: i32,
}

/// A body model that is ready.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct BodyModelFile {
    /// The row in `body_models`; nil for the shipped one.
    pub id: Uuid,
    /// Name in its project, or [`SHIPPED`].
    pub name: String,
    /// Version of that name, from 1.
    pub version: i32,
    /// Where its file is in the object store; `None` for the shipped one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub store_key: Option<String>,
    /// BLAKE3 of its file, hex.
    pub blake3: String,
}

/// A motion database that is ready.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct MotionDatabaseFile {
    /// The row in `motion_databases`.
    pub id: Uuid,
    /// Name in its project.
    pub name: String,
    /// Version of that name, from 1.
    pub version: i32,
    /// Where its index file, or the list of them, is in the object store.
    pub store_key: String,
    /// BLAKE3 of that, hex.
    pub blake3: String,
    /// The GPLVM that was trained on it, for a run that uses one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gplvm: Option<Object>,
}
