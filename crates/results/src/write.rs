use std::{ops::Range, path::Path};

use queue::{Artefact, JobContext, JobError};
use service::{compute, objects};
use store::{Store, Stored, UploadLimits};
use tokio::fs::File;
use tokio_util::io::ReaderStream;

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
    let written = match content {
        Content::Made(make) => {
            let content = compute::run(make).await?;
            objects::write(store, context, &name, media_type, content).await?
        }
        Content::File(path) => {
            let stored = upload(store, context, &name, &path).await?;
            objects::artefact(&name, media_type, stored)
        }
    };
    Ok(Artefact { is_result: true, ..written })
}

/// Stores a file without holding it in memory.
async fn upload(store: &Store, context: &JobContext, name: &str, path: &Path) -> Result<Stored, JobError> {
    let key = objects::key(context, name)?;
    let file = File::open(path).await.map_err(JobError::retry)?;
    let limits = UploadLimits { max_bytes: u64::MAX, ..UploadLimits::default() };
    store.put_stream(&key, ReaderStream::new(file), &limits).await.map_err(JobError::retry)
}
