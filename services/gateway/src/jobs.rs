//! What the gateway puts into the queue: the payloads of the first job of every run.
//!
//! A payload names everything that the job reads, store keys included, so that a job gives the same result whatever
//! is uploaded or deleted after it was asked for. The same JSON is the run's `parameters`, which the user sees.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use uuid::Uuid;

/// Job kind of [`BuildMotionDatabase`], taken by the motion-index service.
pub const BUILD_MOTION_DATABASE: &str = "build-motion-database";

/// Job kind of [`PlanSparse`], taken by the reconstruction service.
pub const PLAN_SPARSE: &str = "plan-sparse";

/// Builds a motion database from uploaded files of role `motion` and `skeleton`.
///
/// The job sets `store_key`, `bytes`, `blake3`, `num_poses`, `num_clips`, `skeleton` and `ready_at` of its row in
/// `motion_databases` in its completing transaction: from then on the database is ready.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BuildMotionDatabase {
    /// the database to build
    pub motion_database: MotionDatabaseName,
    /// its files, in order of name
    pub files: Vec<InputFile>,
}

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
    /// axis of TRC and C3D files that points up, where the file does not say it or says it wrong
    pub up: Option<model::Axis>,
    /// metres of one unit of BVH files
    pub bvh_metres_per_unit: f64,
    /// parameters of the method, all resolved (`sparse::Parameters`)
    pub parameters: serde_json::Value,
}

/// An uploaded file as a job sees it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct InputFile {
    /// name given by the user
    pub name: String,
    /// `skeleton`, `control-points`, `ground-truth` or `motion`
    pub role: String,
    /// where it is in the object store
    pub store_key: String,
    /// size in bytes
    pub bytes: u64,
    /// BLAKE3 of the content, hexadecimal
    pub blake3: String,
}

/// A motion database by id, name and version.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MotionDatabaseName {
    /// the row in `motion_databases`
    pub id: Uuid,
    /// name in the project
    pub name: String,
    /// version of that name, from 1
    pub version: i32,
}

/// A motion database that is ready.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MotionDatabaseFile {
    /// the row in `motion_databases`
    pub id: Uuid,
    /// name in the project
    pub name: String,
    /// version of that name, from 1
    pub version: i32,
    /// where its index file is in the object store
    pub store_key: String,
    /// BLAKE3 of the index file, hexadecimal
    pub blake3: String,
}
