//! A session that was solved.

use std::sync::Arc;

use body::{BodyModel, Shape};
use inverse_kinematics::sequence::Solved;
use model::Motion;

/// All frames solved.
pub(super) struct Finished {
    pub model: Arc<BodyModel>,
    pub shape: Shape,
    /// names
    pub points: Vec<String>,
    pub solved: Vec<Solved>,
    /// how many points were measured, shape `[frames]`
    pub measured: Vec<usize>,
    /// frames a second
    pub frame_rate: f64,
    pub motion: Motion,
    pub warnings: Vec<String>,
}
