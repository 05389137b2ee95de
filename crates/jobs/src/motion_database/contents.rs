use serde::{Deserialize, Serialize};

use super::Augment;

/// What is in a motion database: `motion_databases.contents`, which people are shown as it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contents {
    /// Frames a second.
    pub frame_rate_hz: f64,
    /// Joints of the skeleton.
    pub num_joints: usize,
    /// Degrees of freedom of the skeleton.
    pub num_dofs: usize,
    /// By action, in order of name.
    pub actions: Vec<Share>,
    /// By subject, in order of name.
    pub subjects: Vec<Share>,
    /// What was made from the recordings.
    pub augment: Augment,
    /// What was doubtful, each with the file's name.
    pub warnings: Vec<String>,
}

/// How much of a motion database one action or subject is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// Its name; empty where it is not known.
    pub name: String,
    /// Clips, those made from others included.
    pub num_clips: usize,
    /// Poses at 60 a second.
    pub num_poses: usize,
}

/// A clip of a motion database: one of `motion_databases.clips`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clip {
    /// Its name, once in a database.
    pub name: String,
    /// Who moved.
    pub subject: String,
    /// What they did; empty if unknown.
    pub action: String,
    /// Number of poses at 60 a second.
    pub num_poses: usize,
}
