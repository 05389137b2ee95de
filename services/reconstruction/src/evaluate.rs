//! How far the result is from the ground truth, when a file has it.

use crate::{error::InputError, inputs, inputs::NamedBytes, payload::Reading};
use evaluation::Errors;
use model::Motion;
use motion_db::MotionDatabase;

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
    reading: Reading,
) -> Result<Option<Errors>, InputError> {
    let seconds = found.num_frames() as f64 / found.frame_rate();
    let Some(truth) = inputs::ground_truth(files, database.skeleton(), reading, seconds)? else {
        return Ok(None);
    };
    let truth = truth.value;
    if !truth.skeleton().same_structure(found.skeleton()) {
        return Ok(None);
    }
    let truth = evaluation::at_database_rate(database, &truth, usize::MAX)?;
    Ok(Some(evaluation::compare(&truth, found)))
}
