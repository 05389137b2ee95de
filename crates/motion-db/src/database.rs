use std::sync::Arc;

use kinematics::{Kinematics, Parametrisation, References};
use model::Skeleton;

use crate::column::Column;

/// Frames per second of every database.
pub const FRAME_RATE: f64 = 60.0;

/// One recorded clip of a database.
#[derive(Debug, Clone, PartialEq)]
pub struct ClipInfo {
    /// name, unique in the database (`16_15`)
    pub name: String,
    /// who moved (`16`)
    pub subject: String,
    /// what they did (`walk`), empty if unknown
    pub action: String,
    /// index of the clip's first pose among all poses
    pub first_pose: usize,
    /// number of poses
    pub num_poses: usize,
    /// proportions of the clip's skeleton, see [`proportions`]
    pub(crate) proportions: Vec<f64>,
    /// what the performer's coordinates have over those of an average performer, radians, shape `[dofs]`, or empty if
    /// that was not learned; see [`MotionDatabase::learn_zero_poses`]
    pub(crate) zero_pose: Vec<f32>,
}

impl ClipInfo {
    /// Proportions of the clip's skeleton: offset (x, y, z) and tip (x, y, z) of every joint, metres, shape
    /// `[6·joints]`.
    pub fn proportions(&self) -> &[f64] {
        &self.proportions
    }
}

/// Offset of every joint and tip from its parent, metres, shape `[6·joints]`: what tells one performer's skeleton from
/// another's.
pub(crate) fn proportions(skeleton: &Skeleton) -> Vec<f64> {
    skeleton
        .joints()
        .iter()
        .flat_map(|j| j.offset.iter().chain(j.tip.iter()).copied().collect::<Vec<_>>())
        .collect()
}

/// Recorded motion at 60 frames a second, ready to be searched.
///
/// Poses are smooth coordinates (see [`Parametrisation::smooth`]) of one common skeleton structure. Translations
/// are scaled by `leg_length / (leg length of the clip's skeleton)`, so that people of different size are alike.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionDatabase {
    pub(crate) skeleton: Arc<Skeleton>,
    pub(crate) references: References,
    pub(crate) parametrisation: Parametrisation,
    pub(crate) leg_length: f64,
    pub(crate) clips: Vec<ClipInfo>,
    /// shape `[poses, dofs]`
    pub(crate) coordinates: Column<f32>,
}

impl MotionDatabase {
    /// The skeleton of the first clip: its structure is that of all.
    pub fn skeleton(&self) -> &Arc<Skeleton> {
        &self.skeleton
    }

    /// The meaning of the coordinates.
    pub fn parametrisation(&self) -> &Parametrisation {
        &self.parametrisation
    }

    /// Kinematics of a performer's skeleton in this database's coordinates. The structure must be the database's.
    pub fn kinematics(&self, skeleton: &Skeleton) -> Kinematics {
        Kinematics::new(skeleton, self.parametrisation.clone())
    }

    /// Leg length (metres) to which translations are scaled.
    pub fn leg_length(&self) -> f64 {
        self.leg_length
    }

    /// The clips, in the order of their poses.
    pub fn clips(&self) -> &[ClipInfo] {
        &self.clips
    }

    /// Number of poses.
    pub fn num_poses(&self) -> usize {
        self.coordinates.len() / self.num_dofs()
    }

    /// Number of coordinates of a pose, D.
    pub fn num_dofs(&self) -> usize {
        self.skeleton.num_dofs()
    }

    /// Coordinates of a pose as it was recorded, metres and radians, shape `[dofs]`.
    pub fn pose(&self, pose: usize) -> &[f32] {
        let dofs = self.num_dofs();
        &self.coordinates[pose * dofs..(pose + 1) * dofs]
    }

    /// Copies the coordinates that an average performer would have in a pose, metres and radians, into `out`, shape
    /// `[dofs]`: the recorded ones without the zero pose of who was recorded.
    pub fn copy_pose(&self, pose: usize, out: &mut [f64]) {
        for (out, &v) in out.iter_mut().zip(self.pose(pose)) {
            *out = f64::from(v);
        }
        for (out, &o) in out.iter_mut().zip(&self.clips[self.clip_at(pose)].zero_pose) {
            *out -= f64::from(o);
        }
    }

    /// Index of the clip that holds a pose.
    pub fn clip_at(&self, pose: usize) -> usize {
        self.clips.partition_point(|c| c.first_pose + c.num_poses <= pose)
    }
}
