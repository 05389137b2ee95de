//! What the jobs of one build give each other.

use jobs::{Augment, MotionDatabaseFile, MotionDatabaseName, Object};
use serde::{Deserialize, Serialize};

/// Payload of [`crate::IMPORT_MOTION`], made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ImportMotion {
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

/// Payload of [`crate::BUILD_MOTION_DATABASE`], made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct BuildMotionDatabase {
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

/// What a part holds, beside the part itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct PartReport {
    /// The clips, in the order of the part.
    pub clips: Vec<PartClip>,
    /// What was sloppy, each with the file's name.
    pub warnings: Vec<String>,
}

/// A clip of a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct PartClip {
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
