use std::ops::Range;

use queue::{Artefact, JobContext, JobError};
use service::{compute, objects};
use store::Store;

use crate::{ResultFile, file::Content};

/// Writes files one after the other, each under the job's lease and with its checksum. `progress`: what the job shows before
/// the first and after the last.
///
/// # Errors
/// [`JobError::Stopped`] when the job is to end; what a file can't be made of; to be tried again if the store failed.
pub async fn write(
    store: &Store,
    context: &JobContext,
    files: Vec<ResultFile>,
    progress: Range<f64>,
) -> Result<Vec<Artefact>, JobError> {
    let count = files.len() as f64;
    let mut written = Vec::with_capacity(files.len());
    for (done, file) in files.into_iter().enumerate() {
        context.check()?;
        let share = done as f64 / count;
        let fraction = progress.start + (progress.end - progress.start) * share;
        context.progress(fraction, format!("writing {}", file.name));
        written.push(write_one(store, context, file).await?);
    }
    Ok(written)
}

/// Writes one file.
///
/// # Errors
/// As [`write()`].
pub async fn write_one(store: &Store, context: &JobContext, file: ResultFile) -> Result<Artefact, JobError> {
    let ResultFile { name, media_type, content } = file;
    match content {
        Content::Made(make) => {
            let content = compute::run(make).await?;
            objects::write_result(store, context, &name, media_type, content).await
        }
        Content::File(path) => objects::write_result_file(store, context, &name, media_type, &path).await,
    }
}
