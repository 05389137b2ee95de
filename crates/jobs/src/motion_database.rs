//! Runs that build motion databases or train models on them.

mod augment;

use queue::Job;
use regression::gplvm::TrainingOptions;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

pub use augment::{Augment, Error};

use crate::{InputFile, Object};

/// The kind of runs that build a motion database.
pub const RUN_KIND: &str = "motion-database";
/// The kind of runs that train a model on one.
pub const TRAINING_RUN_KIND: &str = "training";

/// Divides the files of a motion database into parts, and decides the coordinates that all parts have. Taken by the
/// motion-index service.
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
    formats::BvhOptions::default().metres_per_unit
}

impl Job for PlanMotionDatabase {
    const KIND: &'static str = "plan-motion-database";
}

/// Reads the motion files of one part and brings them into the coordinates of the database. Made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImportMotion {
    /// A small database whose coordinates all parts have.
    pub basis: Object,
    /// Archive of the skeletons and indices of all files.
    pub skeletons: Object,
    /// Archive of the motion files of this part.
    pub motions: Object,
    /// What is made from every clip.
    pub augment: Augment,
    /// Metres of one unit of BVH files.
    pub bvh_metres_per_unit: f64,
}

impl Job for ImportMotion {
    const KIND: &'static str = "import-motion";
    // More than usual, as one may be lost with each worker that is taken away.
    const MAX_ATTEMPTS: i32 = 5;
}

/// What a part holds, beside the part itself: [`ImportMotion`] leaves it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PartReport {
    /// The clips, in the order of the part.
    pub clips: Vec<PartClip>,
    /// What was sloppy, each with the file's name.
    pub warnings: Vec<String>,
}

/// A clip of a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartClip {
    /// Which motion file of the part it was made from.
    pub file: usize,
    /// Its name; files in different folders may have the same.
    pub name: String,
    /// Who moved.
    pub subject: String,
    /// What they did; empty if unknown.
    pub action: String,
    /// Number of poses at 60 a second.
    pub num_poses: usize,
}

/// Puts the parts of a database together and writes its index files. Made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BuildMotionDatabase {
    /// The database to build.
    pub motion_database: MotionDatabaseName,
    /// The database whose clips it begins with.
    pub base: Option<MotionDatabaseFile>,
    /// Names of clips of `base` that are left out.
    pub without: Vec<String>,
    /// What was made from every clip.
    pub augment: Augment,
    /// Into how many index files it is divided.
    pub shards: usize,
}

impl Job for BuildMotionDatabase {
    const KIND: &'static str = "build-motion-database";
}

/// Trains a latent variable model of poses on a motion database; its completing transaction records it in
/// `motion_database_models`. Taken by the motion-index service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainGplvm {
    /// The database to learn from.
    pub motion_database: MotionDatabaseFile,
    /// What decides the model, all resolved.
    pub parameters: TrainingOptions,
}

impl Job for TrainGplvm {
    const KIND: &'static str = "train-gplvm";
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
