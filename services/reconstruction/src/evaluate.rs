//! How far the result is from the ground truth, when a file has it.

use crate::{error::InputError, inputs, inputs::NamedBytes};
use evaluation::Errors;
use formats::session;
use model::{Motion, Skeleton};
use motion_db::MotionDatabase;
use std::sync::Arc;

/// Name of the result.
pub(crate) const EVALUATION: &str = "evaluation.json";

/// The motion that really was, as far as files tell it.
#[derive(Debug, Clone, PartialEq)]
pub enum Truth {
    /// No file has it.
    Unknown,
    /// A file has it on a skeleton of other joints than the result's: it can't be compared.
    OtherSkeleton,
    /// At its own frame rate.
    Known(Motion),
}

/// The truth of `found` among `files`. `fallback`: the skeleton of an AMC that comes without its own.
///
/// # Errors
/// If the file can't be read.
pub fn truth_of(
    found: &Motion,
    files: &[NamedBytes],
    fallback: &Arc<Skeleton>,
    reading: session::Options,
) -> Result<Truth, InputError> {
    let seconds = found.num_frames() as f64 / found.frame_rate();
    Ok(match inputs::ground_truth(files, fallback, reading, seconds)? {
        None => Truth::Unknown,
        Some(truth) if truth.value.skeleton().same_structure(found.skeleton()) => Truth::Known(truth.value),
        Some(_) => Truth::OtherSkeleton,
    })
}

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
    let Truth::Known(truth) = truth_of(found, files, database.skeleton(), reading)? else {
        return Ok(None);
    };
    let truth = evaluation::at_database_rate(database, &truth, usize::MAX)?;
    Ok(Some(evaluation::compare(&truth, found)))
}
