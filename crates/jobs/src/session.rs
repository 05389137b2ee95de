use std::collections::BTreeMap;

use formats::BvhOptions;
use model::Axis;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::{
    InputFile,
    run_json::{FileReport, SessionReport, Subject},
};

/// Metres of one unit of a BVH file, whose format has no unit, where nothing else is said.
pub fn bvh_centimetres() -> f64 {
    BvhOptions::default().metres_per_unit
}

/// The capture session of a run: the part that the payloads of all run kinds on sessions have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionInputs {
    /// The session.
    pub session_id: Uuid,
    /// Its name.
    #[serde(default)]
    pub session_name: String,
    /// Its files, in order of name.
    pub files: Vec<InputFile>,
    /// Axis of its files that points up, where they don't say it or say it wrong.
    #[serde(default)]
    pub up: Option<Axis>,
}

impl SessionInputs {
    /// The session as `run.json` names it.
    pub(crate) fn subject(&self) -> Subject<'_> {
        Subject::Session(SessionReport {
            id: self.session_id,
            name: &self.session_name,
            files: FileReport::all(&self.files),
            ..SessionReport::default()
        })
    }
}

/// Which cameras are used, and how the calibration is read.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraChoice {
    /// Cameras to use, by name; empty: all that the session has pictures of.
    #[serde(default)]
    pub cameras: Vec<String>,
    /// File, or `ARCHIVE/FOLDER`, → name of its camera, where names don't tell.
    #[serde(default)]
    pub camera_files: BTreeMap<String, String>,
    /// Metres of one unit of the calibration, where the file doesn't say it.
    #[serde(default)]
    pub metres_per_unit: Option<f64>,
}

/// Which measured points of a file are used, and which of its markers make them. At most one of `mapping`, `marker_map` and
/// a `marker_set` other than `auto` is given.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointChoice {
    /// Points to use, by name; empty: those that `mapping` makes, or else all that the file has.
    #[serde(default)]
    pub points: Vec<String>,
    /// Name in the file → name of a control point or joint.
    #[serde(default)]
    pub mapping: BTreeMap<String, String>,
    /// The marker set whose names the file has: `auto` (or nothing) to find out, `none` for control points under their
    /// own names, or a preset's name.
    #[serde(default)]
    pub marker_set: Option<String>,
    /// Text of a marker map, TOML.
    #[serde(default)]
    pub marker_map: Option<String>,
    /// What the names of the performer's markers begin with.
    #[serde(default)]
    pub marker_prefix: Option<String>,
}
