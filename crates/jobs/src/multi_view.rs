//! Runs on calibrated cameras: plan, silhouettes a camera, the shape of the person, and following them.

mod silhouettes;
mod tracking;

use multi_view::Parameters;
use queue::Job;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

pub use silhouettes::{
    CameraClips, CameraReport, CameraSummary, ClipPlace, MakeSilhouettes, Members, Source, SourceKind,
    StoredClip, clip_name, frame_rate, matches_name, picture_name, report_name,
};
pub use tracking::{DrawOverlay, FitShape, MergeTracks, TRACKED, TrackChunk, TrackingSession};

use crate::{
    CameraChoice, JobReport, SessionInputs,
    body_model::BodyModelFile,
    inverse_kinematics::{self, InverseKinematics},
    run_json::{LearnedFrom, Request, Subject, Timings},
};

/// The kind of such runs.
pub const RUN_KIND: &str = "multi-view";

/// Reads a session's calibration, finds out whose file is whose, and plans the rest of the run. Taken by the shape-init
/// service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanMultiView {
    /// The session; `up` is of the calibration's world.
    #[serde(flatten)]
    pub inputs: SessionInputs,
    /// The bodies that people may have.
    pub body_model: BodyModelFile,
    /// Which cameras.
    #[serde(flatten)]
    pub choice: CameraChoice,
    /// All resolved.
    pub parameters: Parameters,
    /// The silhouettes are for inverse kinematics: no body is looked for in them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inverse_kinematics: Option<InverseKinematics>,
}

impl Job for PlanMultiView {
    const KIND: &'static str = "plan-multi-view";
}

impl Request for PlanMultiView {
    fn run_kind(&self) -> &'static str {
        match self.inverse_kinematics {
            Some(_) => inverse_kinematics::RUN_KIND,
            None => RUN_KIND,
        }
    }

    fn subject(&self) -> Subject<'_> {
        self.inputs.subject()
    }

    fn learned_from(&self) -> LearnedFrom<'_> {
        LearnedFrom { body_model: Some(&self.body_model), ..LearnedFrom::default() }
    }

    fn parameters(&self) -> serde_json::Result<Value> {
        serde_json::to_value(&self.parameters)
    }

    fn reading(&self) -> Value {
        json!({ "up": self.inputs.up, "cameras": self.choice })
    }

    fn seeds(&self) -> Vec<u64> {
        // only the search by particles draws any
        if self.parameters.track { vec![self.parameters.seed] } else { Vec::new() }
    }
}

/// The first stages of a run that has cameras: its plan, and the silhouettes of each camera. Runs without cameras have no plan.
pub fn timings<'a>(plan: Option<&'a JobReport>, cameras: &'a [CameraReport]) -> Timings<'a> {
    let timings = plan.into_iter().fold(Timings::default(), |timings, plan| timings.one("plan", plan));
    timings.all("cameras", cameras.iter().map(|camera| &camera.job))
}
