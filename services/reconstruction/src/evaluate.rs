//! How far the result is from the ground truth, when a file has it.

use crate::{error::InputError, inputs, inputs::NamedBytes};
use evaluation::Errors;
use formats::session;
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
    reading: session::Options,
) -> Result<Option<Errors>, InputError> {
    let seconds = found.num_frames() as f64 / found.frame_rate();
    let truth = inputs::ground_truth(files, database.skeleton(), reading, seconds)?;
    let Some(truth) = truth.filter(|truth| truth.value.skeleton().same_structure(found.skeleton())) else {
        return Ok(None);
    };
    let truth = evaluation::at_database_rate(database, &truth.value, usize::MAX)?;
    Ok(Some(evaluation::compare(&truth, found)))
}
