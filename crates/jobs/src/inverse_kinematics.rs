//! Runs by inverse kinematics: one job solves measured points, and silhouettes of cameras where there are any.

use std::collections::BTreeMap;

use model::Axis;
use queue::Job;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use uuid::Uuid;

use crate::{
    InputFile, JobReport,
    body_model::BodyModelFile,
    run_json::{FileReport, LearnedFrom, Request, SessionReport, Subject},
};

/// The kind of such runs.
pub const RUN_KIND: &str = "inverse-kinematics";

/// What is wanted of a pose, the most important first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IkSolver {
    /// measured points alone
    Plain,
    /// measured points, then a neutral posture
    Priority,
    /// measured points; silhouettes in their null space
    #[default]
    ImageConstrained,
    /// silhouettes and measured points in one Jacobian
    Extended,
    /// silhouettes before measured points
    ImageFirst,
    /// measured points, silhouettes, neutral posture
    ReachThenImageThenPosture,
}

impl IkSolver {
    /// Whether silhouettes are looked at.
    pub fn uses_images(self) -> bool {
        !matches!(self, Self::Plain | Self::Priority)
    }
}

/// Whose body it is: coefficients of the body model, or simple measurements.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BodyDescription {
    /// coefficients, standard deviations; with any, nothing else may be given
    pub alpha: Vec<f64>,
    /// metres
    pub stature_m: Option<f64>,
    /// kilograms
    pub mass_kg: Option<f64>,
    /// years
    pub age_years: Option<f64>,
    /// `female` or `male`
    pub sex: Option<String>,
}

/// How a session is solved by inverse kinematics.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct InverseKinematics {
    /// what is wanted
    pub solver: IkSolver,
    /// most steps of one solve
    pub steps: usize,
    /// frames a second that are solved; `None`: the cameras', or else those of the points' file
    #[serde(default)]
    pub frame_rate: Option<f64>,
    /// whose body
    #[serde(default)]
    pub body: BodyDescription,
    /// points to use, by name; empty: all of the file that the body has
    #[serde(default)]
    pub points: Vec<String>,
    /// name in the file → name of a control point or joint
    #[serde(default)]
    pub mapping: BTreeMap<String, String>,
    /// the marker set whose names the file has, as in other runs
    #[serde(default)]
    pub marker_set: Option<String>,
    /// text of a marker map, TOML
    #[serde(default)]
    pub marker_map: Option<String>,
    /// what the names of the performer's markers begin with
    #[serde(default)]
    pub marker_prefix: Option<String>,
}

/// Solves a session's measured points, and silhouettes that jobs before it have made, for the poses of a body. Taken by the
/// reconstruction service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveInverseKinematics {
    /// The session.
    pub session_id: Uuid,
    /// Its name.
    pub session_name: String,
    /// The bodies that people may have.
    pub body_model: BodyModelFile,
    /// The session's files, in order of name.
    pub files: Vec<InputFile>,
    /// Axis of the files of points that points up, where they don't say it or say it wrong.
    #[serde(default)]
    pub up: Option<Axis>,
    /// All resolved.
    pub how: InverseKinematics,
    /// With cameras, their plan.
    #[serde(default)]
    pub cameras: Option<CamerasPlanned>,
}

impl Job for SolveInverseKinematics {
    const KIND: &'static str = "solve-inverse-kinematics";
}

impl Request for SolveInverseKinematics {
    fn run_kind(&self) -> &'static str {
        RUN_KIND
    }

    fn subject(&self) -> Subject<'_> {
        Subject::Session(SessionReport {
            id: self.session_id,
            name: &self.session_name,
            files: FileReport::all(&self.files),
            mapping: Some(&self.how.mapping),
            ..SessionReport::default()
        })
    }

    fn learned_from(&self) -> LearnedFrom<'_> {
        LearnedFrom { body_model: Some(&self.body_model), ..LearnedFrom::default() }
    }

    fn parameters(&self) -> serde_json::Result<Value> {
        serde_json::to_value(&self.how)
    }
}

/// What the plan of the cameras hands on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CamerasPlanned {
    /// First frame that there are silhouettes of.
    pub first_frame: usize,
    /// What was sloppy about the files.
    pub warnings: Vec<String>,
    /// What the plan itself took.
    pub plan: JobReport,
}
