//! How far the result is from the ground truth, when a file has it.

use crate::{error::InputError, inputs, inputs::NamedBytes};
use evaluation::Errors;
use model::Motion;
use motion_db::{FRAME_RATE, MotionDatabase};

/// Name of the result.
pub(crate) const EVALUATION: &str = "evaluation.json";

/// The errors of `found` against the ground truth among `files`; `None` if there is none on the same skeleton.
///
/// # Errors
/// If the file can't be read.
pub(crate) fn errors(
    files: &[NamedBytes],
    database: &MotionDatabase,
    found: &Motion,
) -> Result<Option<Errors>, InputError> {
    let seconds = found.num_frames() as f64 / found.frame_rate();
    let Some(truth) = inputs::ground_truth(files, database.skeleton(), seconds)? else { return Ok(None) };
    let truth = truth.value;
    if !truth.skeleton().same_structure(found.skeleton()) {
        return Ok(None);
    }
    let truth = at_60_frames_a_second(database, &truth)?;
    Ok(Some(evaluation::compare(&truth, found)))
}

/// The same motion at the rate of everything inside, in the file's channels.
fn at_60_frames_a_second(database: &MotionDatabase, motion: &Motion) -> Result<Motion, InputError> {
    let (skeleton, dofs) = (motion.skeleton(), motion.skeleton().num_dofs());
    let parametrisation = database.parametrisation();
    let coordinates = motion_db::resample(motion, parametrisation);
    let mut values = vec![0.0; coordinates.len()];
    for (frame, x) in coordinates.chunks_exact(dofs).enumerate() {
        let (done, rest) = values.split_at_mut(frame * dofs);
        let previous = (frame > 0).then(|| &done[(frame - 1) * dofs..]);
        parametrisation.pose_from_coordinates(skeleton, x, previous, &mut rest[..dofs]);
    }
    Ok(Motion::new(skeleton.clone(), FRAME_RATE, values).map_err(sparse::Error::from)?)
}
