//! Runs from control points and a motion database: plan, chunks, merge.

use formats::{BvhOptions, PointsOptions, session};
use queue::Job;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use skeleton_fit::{LimbScale, Sizes};
use sparse::Parameters;

use crate::{
    JobReport, Object, PointChoice, SessionInputs, bvh_centimetres,
    motion_database::MotionDatabaseFile,
    run_json::{LearnedFrom, Request, Subject},
};

/// The kind of such runs.
pub const RUN_KIND: &str = "sparse";

/// Reads a session's files and plans its chunks. Taken by the reconstruction service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanSparse {
    /// The session.
    #[serde(flatten)]
    pub inputs: SessionInputs,
    /// The database that serves as prior.
    pub motion_database: MotionDatabaseFile,
    /// Which control points.
    #[serde(flatten)]
    pub choice: PointChoice,
    /// Metres of one unit of BVH files.
    #[serde(default = "bvh_centimetres")]
    pub bvh_metres_per_unit: f64,
    /// All resolved.
    pub parameters: Parameters,
}

impl Job for PlanSparse {
    const KIND: &'static str = "plan-sparse";
}

impl PlanSparse {
    /// How the session's files are to be read.
    pub fn reading_options(&self) -> session::Options {
        session::Options {
            points: PointsOptions { up: self.inputs.up, sigma_m: self.parameters.control_sigma_m },
            bvh: BvhOptions { metres_per_unit: self.bvh_metres_per_unit },
        }
    }
}

impl Request for PlanSparse {
    fn run_kind(&self) -> &'static str {
        RUN_KIND
    }

    fn subject(&self) -> Subject<'_> {
        self.inputs.subject()
    }

    fn learned_from(&self) -> LearnedFrom<'_> {
        LearnedFrom { motion_database: Some(&self.motion_database), ..LearnedFrom::default() }
    }

    fn reading(&self) -> Value {
        json!({ "up": self.inputs.up, "bvh_metres_per_unit": self.bvh_metres_per_unit, "points": self.choice })
    }

    fn parameters(&self) -> serde_json::Result<Value> {
        serde_json::to_value(&self.parameters)
    }
}

/// Reconstructs one chunk of a session. Made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReconstructChunk {
    /// The canonical session.
    pub session: Object,
    /// The database that serves as prior.
    pub motion_database: MotionDatabaseFile,
    /// All resolved.
    pub parameters: Parameters,
    /// Which chunk, from 0.
    pub chunk: usize,
    /// How many there are.
    pub num_chunks: usize,
    /// First frame to compute, at 60 frames a second.
    pub start: usize,
    /// One past the last frame to compute.
    pub end: usize,
}

impl Job for ReconstructChunk {
    const KIND: &'static str = "reconstruct-chunk";
    // More than usual, as one may be lost with each worker that is taken away.
    const MAX_ATTEMPTS: i32 = 5;
}

/// Puts the chunks together and writes the results. Made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MergeChunks {
    /// What the plan was given.
    pub request: PlanSparse,
    /// The canonical session.
    pub session: Object,
    /// The control points that are used.
    pub points: Vec<String>,
    /// What was doubtful about the files.
    pub warnings: Vec<String>,
    /// The skeleton that was fitted, if the session came without one.
    #[serde(default)]
    pub fitted: Option<FittedReport>,
    /// What the plan itself took.
    pub plan: JobReport,
}

impl Job for MergeChunks {
    const KIND: &'static str = "merge-chunks";
}

/// The skeleton that was fitted to a performer of whom only the paths of some points were uploaded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FittedReport {
    /// lengths of the whole body, metres
    pub sizes: Sizes,
    /// scale of the arms against the database's mean skeleton
    pub arms: LimbScale,
    /// scale of the legs
    pub legs: LimbScale,
    /// scale of the trunk
    pub trunk: LimbScale,
    /// distinct skeletons of the database, of which the mean was taken
    pub performers: usize,
    /// spans of the session that decided
    pub spans: usize,
}
