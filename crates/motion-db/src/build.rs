use std::sync::Arc;

use kinematics::{HEADING, Kinematics, Parametrisation, References, rotation_from_angles};
use model::{Motion, Skeleton, counted};
use nalgebra::Matrix3;

use crate::database::{FRAME_RATE, proportions};
use crate::{ClipInfo, Error, MotionDatabase, Result};

/// Shortest clip that is kept, frames at 60 a second.
pub(crate) const MIN_FRAMES: usize = 8;
/// Largest number of poses in one database (bounds memory before it is taken: 250 bytes a pose).
pub(crate) const MAX_POSES: usize = 8_000_000;

/// A recorded motion to be indexed.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// name, `16_15`
    pub name: String,
    /// who moved, `16`
    pub subject: String,
    /// what they did, empty if unknown
    pub action: String,
    /// the motion, at any frame rate
    pub motion: Motion,
}

/// Size of a skeleton, by which translations are made comparable.
pub struct SkeletonSize;

impl SkeletonSize {
    /// Height of the root above the lowest joint or bone end in the rest pose, metres; 1 if that is not positive.
    pub fn leg_length(skeleton: &Skeleton) -> f64 {
        let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
        let mut state = kinematics.state();
        kinematics.update(&vec![0.0; skeleton.num_dofs()], &mut state);
        let lowest = skeleton
            .joints()
            .iter()
            .enumerate()
            .map(|(j, joint)| state.positions[j].y.min(state.point(j, &joint.tip).y))
            .fold(f64::INFINITY, f64::min);
        let length = state.positions[0].y - lowest;
        if length > 1e-3 { length } else { 1.0 }
    }
}

/// No recording is farther from the origin, metres, and no angle is larger, radians.
const FARTHEST: f64 = 1e4;

impl MotionDatabase {
    /// Builds a database: every clip at 60 frames a second, in smooth coordinates about the mean rotation of
    /// each joint, translations scaled to one leg length, and learns the performers' zero poses. Clips shorter than 8
    /// frames are left out.
    ///
    /// # Errors
    /// If no clip is left, skeletons differ in structure, the root is not free, or there are too many poses.
    pub fn build(clips: &[Clip]) -> Result<Self> {
        let Some(first) = clips.first() else {
            return Err(Error::NoMotion { min_frames: MIN_FRAMES });
        };
        let skeleton = first.motion.skeleton().clone();
        for clip in clips {
            structure_mismatch(clip, &skeleton, &first.name)?;
        }
        let references = mean_references(clips);
        let parametrisation = Parametrisation::smooth(&skeleton, &references)
            .map_err(|source| Error::Skeleton { clip: first.name.clone(), source })?;
        let leg_length = clips.iter().map(|c| SkeletonSize::leg_length(c.motion.skeleton())).sum::<f64>()
            / clips.len() as f64;
        let mut database = Self {
            skeleton,
            references,
            parametrisation,
            leg_length,
            clips: Vec::new(),
            coordinates: Vec::new().into(),
        };
        for clip in clips {
            database.add(clip)?;
        }
        if database.clips.is_empty() {
            return Err(Error::NoMotion { min_frames: MIN_FRAMES });
        }
        database.learn_zero_poses();
        Ok(database)
    }

    pub(crate) fn add(&mut self, clip: &Clip) -> Result<()> {
        let dofs = self.num_dofs();
        let coordinates = resample(&clip.motion, &self.parametrisation);
        let num_poses = coordinates.len() / dofs;
        if num_poses < MIN_FRAMES {
            return Ok(());
        }
        let first_pose = self.num_poses();
        self.check_size(first_pose + num_poses)?;
        let scale = self.leg_length / SkeletonSize::leg_length(clip.motion.skeleton());
        for (frame, pose) in coordinates.chunks_exact(dofs).enumerate() {
            if let Some(dof) = pose.iter().position(|v| v.is_nan() || v.abs() > FARTHEST) {
                return Err(Error::Value { clip: clip.name.clone(), frame, dof, found: pose[dof] });
            }
            let scaled = pose.iter().enumerate().map(|(d, v)| (if d < 3 { v * scale } else { *v }) as f32);
            self.coordinates.to_mut().extend(scaled);
        }
        self.clips.push(ClipInfo {
            name: clip.name.clone(),
            subject: clip.subject.clone(),
            action: clip.action.clone(),
            first_pose,
            num_poses,
            proportions: proportions(clip.motion.skeleton()),
            zero_pose: Vec::new(),
        });
        Ok(())
    }

    pub(crate) fn check_size(&self, poses: usize) -> Result<()> {
        if poses > MAX_POSES { Err(Error::TooLarge { poses, limit: MAX_POSES }) } else { Ok(()) }
    }
}

/// Coordinates of a motion at 60 frames a second, shape `[frames, dofs]`, the heading continuous in time. Whole ratios of the
/// frame rates take every n-th frame; others interpolate linearly in the coordinates.
pub fn resample(motion: &Motion, parametrisation: &Parametrisation) -> Vec<f64> {
    let skeleton = motion.skeleton();
    let dofs = skeleton.num_dofs();
    let mut all = vec![0.0; motion.values().len()];
    let mut heading = 0.0;
    for frame in 0..motion.num_frames() {
        let out = &mut all[frame * dofs..][..dofs];
        parametrisation.coordinates_from_pose(skeleton, motion.pose(frame), heading, out);
        heading = out[HEADING];
    }
    let ratio = motion.frame_rate() / FRAME_RATE;
    let whole = ratio.round();
    if whole >= 1.0 && (ratio - whole).abs() < 0.01 * whole {
        return all.chunks_exact(dofs).step_by(whole as usize).flatten().copied().collect();
    }
    let duration = (motion.num_frames().saturating_sub(1)) as f64 / motion.frame_rate();
    let frames = (duration * FRAME_RATE + 1e-9).floor() as usize + 1;
    let mut out = Vec::with_capacity(frames * dofs);
    let mut to = vec![0.0; dofs];
    for frame in 0..frames {
        let at = frame as f64 * ratio;
        let low = (at.floor() as usize).min(motion.num_frames() - 1);
        let high = (low + 1).min(motion.num_frames() - 1);
        let share = at - low as f64;
        let from = &all[low * dofs..][..dofs];
        to.copy_from_slice(&all[high * dofs..][..dofs]);
        parametrisation.unwrap_near(&mut to, from);
        for (to, from) in to.iter_mut().zip(from) {
            *to = from + share * (*to - from);
        }
        parametrisation.wrap(&mut to);
        out.extend_from_slice(&to);
    }
    out
}

/// Mean rotation of each joint with three rotations, circular mean of every other angle, over all clips.
fn mean_references(clips: &[Clip]) -> References {
    let skeleton: &Arc<Skeleton> = clips[0].motion.skeleton();
    let mut sums = vec![Matrix3::zeros(); skeleton.num_joints()];
    let mut circular = vec![(0.0, 0.0); skeleton.num_dofs()];
    for clip in clips {
        // Every 10th frame is plenty for a mean.
        for frame in (0..clip.motion.num_frames()).step_by(10) {
            let pose = clip.motion.pose(frame);
            for ((sin, cos), angle) in circular.iter_mut().zip(pose) {
                *sin += angle.sin();
                *cos += angle.cos();
            }
            for (j, joint) in skeleton.joints().iter().enumerate().filter(|(_, j)| j.num_rotations() == 3) {
                let channels = &pose[skeleton.dofs(j)];
                let mut angles = [0.0; 3];
                for (angle, axis) in angles.iter_mut().zip(&joint.rotation_order) {
                    let is_it =
                        |c: &model::Channel| c.kind == model::ChannelKind::Rotation && c.axis == *axis;
                    *angle = joint.channels.iter().position(is_it).map_or(0.0, |slot| channels[slot]);
                }
                sums[j] += rotation_from_angles(&joint.rotation_order, &angles);
            }
        }
    }
    References {
        rotations: sums.iter().map(nearest_rotation).collect(),
        angles: circular.iter().map(|(sin, cos)| sin.atan2(*cos)).collect(),
    }
}

/// The rotation nearest to a matrix (orthogonal Procrustes); identity where the matrix says nothing.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = matrix.svd(true, true);
    let (Some(u), Some(vt)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    if svd.singular_values.min() <= 1e-9 * svd.singular_values.max().max(1e-300) {
        return Matrix3::identity();
    }
    let mut d = Matrix3::identity();
    d[(2, 2)] = (u * vt).determinant().signum();
    u * d * vt
}

/// Refuses a clip whose poses are none of `expected`, the skeleton of clip `first`.
pub(crate) fn structure_mismatch(clip: &Clip, expected: &Skeleton, first: &str) -> Result<()> {
    let mismatch = |difference: String| Error::SkeletonMismatch {
        clip: clip.name.clone(),
        first: first.to_owned(),
        difference,
    };
    structure_difference(clip.motion.skeleton(), expected)
        .map_or(Ok(()), |difference| Err(mismatch(difference)))
}

impl MotionDatabase {
    /// Says in words why a pose of `skeleton` would not be a pose of this database; `None` if it would be. Lengths may
    /// differ, joints, channels and rotation axes may not.
    pub fn structure_difference(&self, skeleton: &Skeleton) -> Option<String> {
        structure_difference(skeleton, &self.skeleton)
    }
}

fn structure_difference(found: &Skeleton, expected: &Skeleton) -> Option<String> {
    if found.num_joints() != expected.num_joints() {
        return Some(format!(
            "{} instead of {}",
            counted(found.num_joints(), "joint"),
            expected.num_joints()
        ));
    }
    for (a, b) in found.joints().iter().zip(expected.joints()) {
        if a.name != b.name {
            return Some(format!("joint {} instead of {}", a.name, b.name));
        }
        if a.parent != b.parent {
            return Some(format!("joint {} hangs from another joint", a.name));
        }
        let channels =
            |j: &model::Joint| j.channels.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        if channels(a) != channels(b) {
            return Some(format!("joint {} has channels {} instead of {}", a.name, channels(a), channels(b)));
        }
        if a.rotation_order != b.rotation_order {
            return Some(format!("the rotations of joint {} are multiplied in another order", a.name));
        }
        if (a.axes.matrix() - b.axes.matrix()).norm() > 1e-3 {
            return Some(format!("joint {} has other rotation axes", a.name));
        }
    }
    None
}
