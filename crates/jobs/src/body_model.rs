//! Runs that learn body models from scans.

pub use crate::versions::{BodyModelFile, SHIPPED, VersionName};
use crate::{
    InputFile,
    run_json::{FileReport, LearnedFrom, Request, Subject, VersionReport},
};
use queue::Job;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// The kind of such runs.
pub const RUN_KIND: &str = "body-model";

/// Learns a body model from uploaded scans. Taken by the shape-init service.
///
/// Its completing transaction sets `store_key`, `bytes`, `blake3`, `num_vertices`, `num_components`, `contents` and
/// `ready_at` of its row in `body_models`: from then on the model is ready.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BuildBodyModel {
    /// The model to build.
    pub body_model: VersionName,
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

impl Request for BuildBodyModel {
    fn run_kind(&self) -> &'static str {
        RUN_KIND
    }

    fn subject(&self) -> Subject<'_> {
        let VersionName { id, name, version } = &self.body_model;
        let files = FileReport::all(&self.files);
        Subject::BodyModel(VersionReport { id: *id, name, version: *version, blake3: None, files })
    }

    fn learned_from(&self) -> LearnedFrom<'_> {
        LearnedFrom::default()
    }

    fn parameters(&self) -> serde_json::Result<Value> {
        Ok(json!({ "components": self.components, "metres_per_unit": self.metres_per_unit }))
    }
}
