//! Uploads as files, for programs that read nothing else.

use std::path::{Path, PathBuf};

use futures::TryStreamExt;
use jobs::InputFile;
use queue::JobError;
use store::Store;
use tokio::io::AsyncWriteExt;
use tokio_util::io::StreamReader;

/// Copies an upload into a folder, under its own name.
///
/// # Errors
/// Gives up if it is gone; to be tried again if the store or the disk failed.
pub(crate) async fn copy(store: &Store, file: &InputFile, folder: &Path) -> Result<PathBuf, JobError> {
    let key = file
        .store_key
        .parse()
        .map_err(|e| JobError::give_up(format!("{} has no place in the store", file.name), e))?;
    let (_, content) = store.stream(&key).await.map_err(|error| match error {
        store::Error::NotFound { .. } => {
            JobError::give_up(format!("{} is not in the store any more", file.name), error)
        }
        error => JobError::retry(error),
    })?;
    let path = folder.join(&file.name);
    let mut content = StreamReader::new(Box::pin(content.map_err(std::io::Error::other)));
    let copied = async {
        let mut to = tokio::fs::File::create(&path).await?;
        tokio::io::copy(&mut content, &mut to).await?;
        to.flush().await
    };
    copied.await.map_err(|e| JobError::retry(format!("{}: {e}", file.name)))?;
    Ok(path)
}
