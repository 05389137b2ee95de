//! What the jobs of this service are given. Everything that decides the result is in here.

use crate::performer::FittedReport;
use crate::{control::Markers, error::InputError};
use formats::{BvhOptions, PointsOptions};
pub(crate) use jobs::JobReport;
pub use jobs::{InputFile, MotionDatabaseFile, Object};
use model::Axis;
use serde::{Deserialize, Serialize};
use sparse::Parameters;
use std::collections::BTreeMap;
use uuid::Uuid;

/// Payload of [`crate::PLAN_SPARSE`], made by the gateway.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanSparse {
    /// The session.
    pub session_id: Uuid,
    /// Its name.
    #[serde(default)]
    pub session_name: String,
    /// The database that serves as prior.
    pub motion_database: MotionDatabaseFile,
    /// The session's files, in order of name.
    pub files: Vec<InputFile>,
    /// Control points to use; empty: those of `mapping`, or else all that the file has.
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
    /// Axis of TRC and C3D files that points up, where the file does not say it or says it wrong.
    #[serde(default)]
    pub up: Option<Axis>,
    /// Metres of one unit of BVH files.
    #[serde(default = "centimetres")]
    pub bvh_metres_per_unit: f64,
    /// All resolved.
    pub parameters: Parameters,
}

fn centimetres() -> f64 {
    formats::BvhOptions::default().metres_per_unit
}

impl PlanSparse {
    /// What the names of the file of control points stand for.
    ///
    /// # Errors
    /// If the marker map or set is none.
    pub(crate) fn markers(&self) -> Result<Markers, InputError> {
        let [map, set, prefix] =
            [&self.marker_map, &self.marker_set, &self.marker_prefix].map(Option::as_deref);
        Markers::new(&self.mapping, map, set, prefix)
    }

    /// How the session's files are to be read.
    pub(crate) fn reading(&self) -> Reading {
        Reading {
            points: PointsOptions { up: self.up, sigma_m: self.parameters.control_sigma_m },
            bvh: BvhOptions { metres_per_unit: self.bvh_metres_per_unit },
        }
    }
}

/// What the files do not say of themselves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading {
    /// Of TRC and C3D files.
    pub points: PointsOptions,
    /// Of BVH files.
    pub bvh: BvhOptions,
}

/// Payload of [`crate::RECONSTRUCT_CHUNK`], made by the plan.
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

/// Payload of [`crate::MERGE_CHUNKS`], made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MergeChunks {
    /// What the plan was given.
    pub request: PlanSparse,
    /// The canonical session.
    pub session: Object,
    /// The control points that are used.
    pub points: Vec<String>,
    /// What was sloppy about the files.
    pub warnings: Vec<String>,
    /// The skeleton that was fitted, if the session came without one.
    #[serde(default)]
    pub fitted: Option<FittedReport>,
    /// What the plan itself took.
    pub plan: JobReport,
}
