//! The truth as evaluation needs it: at 60 frames a second, and its control points.

use kinematics::{Kinematics, Parametrisation, PointSet, control_points};
use model::{Motion, PointTrajectories};
use motion_db::{FRAME_RATE, MotionDatabase};
use nalgebra::Vector3;

/// Trajectories (metres) of a skeleton's control points in a motion, exact.
///
/// # Errors
/// If the skeleton lacks one of the points.
pub fn control_trajectories(motion: &Motion, names: &[&str]) -> Result<PointTrajectories, sparse::Error> {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let points = PointSet::new(&kinematics, control_points(skeleton, names)?);
    let mut state = kinematics.state();
    let mut positions = vec![Vector3::zeros(); points.len() * motion.num_frames()];
    for (pose, out) in motion.poses().zip(positions.chunks_exact_mut(points.len())) {
        points.positions(&kinematics, pose, &mut state, out);
    }
    let names = names.iter().map(|n| (*n).to_owned()).collect();
    Ok(PointTrajectories::new(names, motion.frame_rate(), positions)?)
}

/// The first frames of a motion at 60 a second, in the file's channels. `database` gives the coordinates in which
/// frames are interpolated where the rate is no multiple of 60.
///
/// # Errors
/// If the skeleton has another structure than the database's.
pub fn at_database_rate(
    database: &MotionDatabase,
    motion: &Motion,
    max_frames: usize,
) -> Result<Motion, sparse::Error> {
    if let Some(difference) = database.structure_difference(motion.skeleton()) {
        return Err(sparse::Error::Skeleton { difference });
    }
    at_60_hz(database.parametrisation(), motion, max_frames)
}

/// The first frames of a motion at 60 a second, in the file's channels. `parametrisation` (of the same structure) has the
/// coordinates in which frames are interpolated where the rate is no multiple of 60.
///
/// # Errors
/// If frames between two poses are no motion.
pub fn at_60_hz(
    parametrisation: &Parametrisation,
    motion: &Motion,
    max_frames: usize,
) -> Result<Motion, sparse::Error> {
    let skeleton = motion.skeleton();
    let dofs = skeleton.num_dofs();
    let ratio = motion.frame_rate() / FRAME_RATE;
    let whole = ratio.round();
    if whole >= 1.0 && (ratio - whole).abs() < 0.01 * whole {
        let frames = motion.poses().step_by(whole as usize).take(max_frames);
        return Ok(Motion::new(skeleton.clone(), FRAME_RATE, frames.flatten().copied().collect())?);
    }
    let coordinates = motion_db::resample(motion, parametrisation);
    let frames = (coordinates.len() / dofs).min(max_frames);
    let mut values = vec![0.0; frames * dofs];
    for frame in 0..frames {
        let (done, rest) = values.split_at_mut(frame * dofs);
        let previous = (frame > 0).then(|| &done[(frame - 1) * dofs..]);
        let x = &coordinates[frame * dofs..][..dofs];
        parametrisation.pose_from_coordinates(skeleton, x, previous, &mut rest[..dofs]);
    }
    Ok(Motion::new(skeleton.clone(), FRAME_RATE, values)?)
}
