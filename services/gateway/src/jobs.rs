//! What the gateway puts into the queue for reconstructions; for motion databases it is in [`jobs`](::jobs).

use std::collections::BTreeMap;

use jobs::{InputFile, MotionDatabaseFile};
use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// Job kind of [`PlanSparse`], taken by the reconstruction service.
pub const PLAN_SPARSE: &str = "plan-sparse";

/// Reconstructs a session's motion from its control points.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PlanSparse {
    /// the session
    pub session_id: Uuid,
    /// name of the session
    pub session_name: String,
    /// the database to learn from
    pub motion_database: MotionDatabaseFile,
    /// the session's files, in order of name
    pub files: Vec<InputFile>,
    /// control points to use, by name; empty: all that the files have
    pub points: Vec<String>,
    /// name in the file -> name of a control point or joint, for files with marker names of their own
    pub mapping: BTreeMap<String, String>,
    /// marker set whose names the file has: `auto`, `none` or a preset's name
    pub marker_set: String,
    /// text of a marker map (TOML)
    pub marker_map: Option<String>,
    /// what the names of the performer's markers begin with
    pub marker_prefix: Option<String>,
    /// axis of TRC and C3D files that points up, where the file does not say it or says it wrong
    pub up: Option<model::Axis>,
    /// metres of one unit of BVH files
    pub bvh_metres_per_unit: f64,
    /// parameters of the method, all resolved (`sparse::Parameters`)
    pub parameters: serde_json::Value,
}
