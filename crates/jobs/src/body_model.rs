//! Runs that learn body models from scans.

use queue::Job;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::InputFile;

/// The kind of such runs.
pub const RUN_KIND: &str = "body-model";

/// Name of the body model that comes with the program; it has no row and no object.
pub const SHIPPED: &str = "shipped";

/// Learns a body model from uploaded scans. Taken by the shape-init service.
///
/// Its completing transaction sets `store_key`, `bytes`, `blake3`, `num_vertices`, `num_components`, `contents` and
/// `ready_at` of its row in `body_models`: from then on the model is ready.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BuildBodyModel {
    /// The model to build.
    pub body_model: BodyModelName,
    /// Archives and files of scans, in order of name.
    pub files: Vec<InputFile>,
    /// Most principal components.
    pub components: usize,
    /// Metres of one unit of the scans; `None` to find out.
    #[serde(default)]
    pub metres_per_unit: Option<f64>,
}

impl Job for BuildBodyModel {
    const KIND: &'static str = "build-body-model";
}

/// A body model by id, name and version.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BodyModelName {
    /// The row in `body_models`.
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
