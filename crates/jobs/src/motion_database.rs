//! Runs that build motion databases or train models on them.

mod augment;
mod contents;

pub use crate::versions::{MotionDatabaseFile, VersionName};
pub use augment::{Augment, Error};
pub use contents::{Clip, Contents, Share};
use queue::Job;
use regression::gplvm::TrainingOptions;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::{
    InputFile, JobReport, Object, bvh_centimetres,
    run_json::{FileReport, LearnedFrom, Request, Subject, VersionReport},
};

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
    pub motion_database: VersionName,
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
    #[serde(default = "bvh_centimetres")]
    pub bvh_metres_per_unit: f64,
}

fn one() -> usize {
    1
}

impl Job for PlanMotionDatabase {
    const KIND: &'static str = "plan-motion-database";
}

impl Request for PlanMotionDatabase {
    fn run_kind(&self) -> &'static str {
        RUN_KIND
    }

    fn subject(&self) -> Subject<'_> {
        let VersionName { id, name, version } = &self.motion_database;
        let files = FileReport::all(&self.files);
        Subject::MotionDatabase(VersionReport { id: *id, name, version: *version, blake3: None, files })
    }

    fn learned_from(&self) -> LearnedFrom<'_> {
        LearnedFrom { base: self.base.as_ref(), ..LearnedFrom::default() }
    }

    fn parameters(&self) -> serde_json::Result<Value> {
        Ok(json!({
            "without": self.without,
            "augment": self.augment,
            "shards": self.shards,
            "bvh_metres_per_unit": self.bvh_metres_per_unit,
        }))
    }
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartReport {
    /// The clips, in the order of the part.
    pub clips: Vec<PartClip>,
    /// What was doubtful, each with the file's name.
    pub warnings: Vec<String>,
    /// What it took.
    pub job: JobReport,
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
    /// What the plan was given.
    pub request: PlanMotionDatabase,
    /// What the plan itself took.
    pub plan: JobReport,
}

impl Job for BuildMotionDatabase {
    const KIND: &'static str = "build-motion-database";
    // Version 1 had parts of the request, and not the files that `run.json` names.
    const VERSION: i32 = 2;
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

impl Request for TrainGplvm {
    fn run_kind(&self) -> &'static str {
        TRAINING_RUN_KIND
    }

    fn subject(&self) -> Subject<'_> {
        let MotionDatabaseFile { id, name, version, blake3, .. } = &self.motion_database;
        let (blake3, files) = (Some(blake3.as_str()), Vec::new());
        Subject::MotionDatabase(VersionReport { id: *id, name, version: *version, blake3, files })
    }

    fn learned_from(&self) -> LearnedFrom<'_> {
        LearnedFrom::default()
    }

    fn parameters(&self) -> serde_json::Result<Value> {
        serde_json::to_value(self.parameters)
    }
}
