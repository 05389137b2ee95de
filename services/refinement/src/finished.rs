//! What all results of a session are made from.

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

/// A session that was tracked from its first to its last frame.
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
}

impl Finished {
    pub fn poses(&self) -> Vec<Vec<f64>> {
        self.tracked.frames.iter().map(|tracked| tracked.pose.clone()).collect()
    }

    pub fn motion(&self) -> Result<Motion, InputError> {
        Ok(self.model.motion(&self.shape, &self.poses(), self.frame_rate)?)
    }

    /// Centres of the joints; missing where nobody was found.
    pub fn joints(&self) -> Result<PointTrajectories, InputError> {
        let names = self.model.rig().joints().iter().map(|joint| joint.name.clone()).collect();
        let positions = self.tracked.frames.iter().flat_map(|tracked| {
            let is_seen = tracked.stage != Stage::Unseen;
            tracked.joints.iter().map(move |joint| if is_seen { *joint } else { Vector3::repeat(f64::NAN) })
        });
        Ok(PointTrajectories::new(names, self.frame_rate, positions.collect())?)
    }
}
