use std::collections::BTreeMap;

use multi_view::Parameters;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::{BodyModelFile, InputFile, InverseKinematics};

/// Kind of the first job of a run on cameras: [`PlanMultiView`], taken by the shape-init service.
pub const PLAN_MULTI_VIEW: &str = "plan-multi-view";

/// Finds pose and shape of a person in what several calibrated cameras saw.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanMultiView {
    /// The session.
    pub session_id: Uuid,
    /// Its name.
    pub session_name: String,
    /// The bodies that people may have.
    pub body_model: BodyModelFile,
    /// The session's files, in order of name.
    pub files: Vec<InputFile>,
    /// Cameras to use, by name; empty: all that the session has pictures of.
    #[serde(default)]
    pub cameras: Vec<String>,
    /// File, or `ARCHIVE/FOLDER`, → name of its camera, where names don't tell.
    #[serde(default)]
    pub camera_files: BTreeMap<String, String>,
    /// Axis of the calibration's world that points up, `x`, `y`, `z`, `-x`, …, where the file doesn't say it.
    #[serde(default)]
    pub up: Option<String>,
    /// Metres of one unit of the calibration, where the file doesn't say it.
    #[serde(default)]
    pub metres_per_unit: Option<f64>,
    /// All resolved.
    pub parameters: Parameters,
    /// The silhouettes are for inverse kinematics: no body is looked for in them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inverse_kinematics: Option<InverseKinematics>,
}
