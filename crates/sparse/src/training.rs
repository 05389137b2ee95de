use std::ops::ControlFlow;

use kinematics::HEADING;
use motion_db::{ClipInfo, FeatureScale, HeadingFrame, MotionDatabase};
use regression::gplvm::{Gplvm, TrainingOptions, TrainingSet, train};

use crate::Result;

/// Poses that a training set holds at most; of more, every n-th is taken.
const MOST_POSES: usize = 60_000;

/// Trains the model of method `gplvm` on the clips of a database that `is_excluded` does not exclude: a minute for the
/// default options. The result goes to [`crate::Reconstructor::with_model`]; keep it as an artefact of the database
/// ([`Gplvm::to_bytes`]). `progress` is called with the number of steps done and planned, and may stop the training.
///
/// # Errors
/// If there are too few poses, an option is out of range, or `progress` stops it.
pub fn train_gplvm(
    database: &MotionDatabase,
    options: &TrainingOptions,
    is_excluded: &dyn Fn(&ClipInfo) -> bool,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Gplvm> {
    Ok(train(&training_set(database, is_excluded), options, progress)?)
}

/// Every pose with one before it, relative to the heading frame of that one, degrees and centimetres.
fn training_set(database: &MotionDatabase, is_excluded: &dyn Fn(&ClipInfo) -> bool) -> TrainingSet {
    let dofs = database.num_dofs();
    let scale = FeatureScale::from_database(database);
    let clips = || database.clips().iter().filter(|c| !is_excluded(c));
    let total: usize = clips().map(|c| c.num_poses.saturating_sub(1)).sum();
    let step = total.div_ceil(MOST_POSES).max(1);
    let mut set = TrainingSet {
        dofs,
        poses: Vec::with_capacity(total.div_ceil(step) * dofs),
        velocities: Vec::with_capacity(total.div_ceil(step) * dofs),
    };
    let mut world = vec![0.0; dofs];
    let (mut before, mut pose) = (world.clone(), world.clone());
    let targets = clips().flat_map(|c| c.first_pose + 1..c.first_pose + c.num_poses);
    for target in targets.step_by(step) {
        database.copy_pose(target - 1, &mut world);
        let frame = HeadingFrame::from_coordinates(&world);
        frame.relative(&world, &mut before);
        database.copy_pose(target, &mut world);
        frame.relative(&world, &mut pose);
        scale.scale(&mut before);
        scale.scale(&mut pose);
        set.poses.extend_from_slice(&pose);
        // The root's place on the floor and its heading are relative to the pose before: they are velocities already.
        let is_velocity = |d: usize| [0, 2, HEADING].contains(&d);
        set.velocities.extend((0..dofs).map(|d| if is_velocity(d) { 0.0 } else { pose[d] - before[d] }));
    }
    set
}
