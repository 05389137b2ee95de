//! A session whose person was followed.

use std::sync::Arc;

use body::{BodyModel, Shape};
use model::{Motion, PointTrajectories};
use nalgebra::Vector3;
use tracking::{Chunk, Seam, Stage};

use crate::InputError;

/// Where two chunks meet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meeting {
    pub seam: Seam,
    /// nobody was found by one of them in a frame that both have
    pub is_blind: bool,
}

/// A session that was followed from its first to its last frame.
#[derive(Debug)]
pub(crate) struct Finished {
    pub model: Arc<BodyModel>,
    pub shape: Shape,
    /// all frames
    pub tracked: Chunk,
    /// where its chunks meet
    pub meetings: Vec<Meeting>,
    /// names, in the order of the overlaps
    pub cameras: Vec<String>,
    /// frames a second
    pub frame_rate: f64,
    pub motion: Motion,
    /// centres, missing where nobody was found
    pub joints: PointTrajectories,
}

impl Finished {
    /// From the frames of all chunks.
    ///
    /// # Errors
    /// If they are no motion of the body.
    pub fn new(
        model: Arc<BodyModel>,
        shape: Shape,
        tracked: Chunk,
        meetings: Vec<Meeting>,
        cameras: Vec<String>,
        frame_rate: f64,
    ) -> Result<Self, InputError> {
        let motion = model.motion(&shape, &poses(&tracked), frame_rate)?;
        let names = model.rig().joints().iter().map(|joint| joint.name.clone()).collect();
        let positions = tracked.frames.iter().flat_map(|tracked| {
            let is_seen = tracked.stage != Stage::Unseen;
            tracked.joints.iter().map(move |joint| if is_seen { *joint } else { Vector3::repeat(f64::NAN) })
        });
        let joints = PointTrajectories::new(names, frame_rate, positions.collect())?;
        Ok(Self { model, shape, tracked, meetings, cameras, frame_rate, motion, joints })
    }
}

/// The body's poses, shape `[frames][dof]`.
pub(crate) fn poses(tracked: &Chunk) -> Vec<Vec<f64>> {
    tracked.frames.iter().map(|tracked| tracked.pose.clone()).collect()
}
