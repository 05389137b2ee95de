use serde::{Deserialize, Serialize};
use serde_json::Value;
use uuid::Uuid;

use crate::{Augment, InputFile, Object};

/// Kind of the first job of building a motion database: [`PlanMotionDatabase`], taken by the motion-index service.
pub const PLAN_MOTION_DATABASE: &str = "plan-motion-database";

/// Kind of the job [`TrainGplvm`], taken by the motion-index service.
pub const TRAIN_GPLVM: &str = "train-gplvm";

/// Builds a motion database from uploaded files, and from the clips of another.
///
/// The last job of the run sets `store_key`, `bytes`, `blake3`, `num_poses`, `num_clips`, `num_shards`, `skeleton`,
/// `contents`, `clips` and `ready_at` of its row in `motion_databases` in its completing transaction: from then on the
/// database is ready.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanMotionDatabase {
    /// The database to build.
    pub motion_database: MotionDatabaseName,
    /// The database whose clips it begins with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<MotionDatabaseFile>,
    /// Names of clips of `base` that are left out.
    #[serde(default)]
    pub without: Vec<String>,
    /// Files of motion to be added, in order of name.
    pub files: Vec<InputFile>,
    /// What is made from the clips of the files.
    #[serde(default)]
    pub augment: Augment,
    /// Into how many index files it is divided.
    #[serde(default = "one")]
    pub shards: usize,
    /// Metres of one unit of BVH files.
    #[serde(default = "centimetres")]
    pub bvh_metres_per_unit: f64,
}

fn one() -> usize {
    1
}

fn centimetres() -> f64 {
    0.01
}

/// Trains a latent variable model of poses on a motion database; its completing transaction records it in
/// `motion_database_models`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainGplvm {
    /// The database to learn from.
    pub motion_database: MotionDatabaseFile,
    /// What decides the model, all resolved.
    pub parameters: Value,
}

/// A motion database by id, name and version.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MotionDatabaseName {
    /// The row in `motion_databases`.
    pub id: Uuid,
    /// Name in its project.
    pub name: String,
    /// Version of that name, from 1.
    pub version: i32,
}

/// A motion database that is ready.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct MotionDatabaseFile {
    /// The row in `motion_databases`.
    pub id: Uuid,
    /// Name in its project.
    pub name: String,
    /// Version of that name, from 1.
    pub version: i32,
    /// Where its index file, or the list of them, is in the object store.
    pub store_key: String,
    /// BLAKE3 of that, hex.
    pub blake3: String,
    /// The GPLVM that was trained on it, for a run that uses one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gplvm: Option<Object>,
}
