//! What the jobs of one run give each other within this service. Everything that decides the result is in here.

use jobs::{JobReport, PlanMultiView, Source};
use multi_view::CameraRecord;
use serde::{Deserialize, Serialize};

/// Payload of [`crate::MAKE_SILHOUETTES`], made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct MakeSilhouettes {
    /// index of the camera among those of the run
    pub index: usize,
    /// as it was calibrated
    pub camera: CameraRecord,
    /// its pictures
    pub source: Source,
    /// the empty scene
    pub plate: Option<Source>,
    /// all resolved
    pub parameters: multi_view::Parameters,
}

/// Payload of [`crate::INITIALISE_BODY`], made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct InitialiseBody {
    /// what the plan was given
    pub request: PlanMultiView,
    /// what was sloppy about the files
    pub warnings: Vec<String>,
    /// what the plan itself took
    pub plan: JobReport,
}
