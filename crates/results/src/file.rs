use std::{fmt, path::PathBuf};

use formats::media_type;
use queue::JobError;
use serde::Serialize;

/// A file that people get: its name, its media type, and how it comes by its content.
pub struct ResultFile {
    pub(crate) name: String,
    pub(crate) media_type: &'static str,
    pub(crate) content: Content,
}

pub(crate) enum Content {
    /// made when it is written, so that one at a time is in memory
    Made(Box<dyn FnOnce() -> Result<Vec<u8>, JobError> + Send>),
    /// a file on disk, which is not read into memory
    File(PathBuf),
}

impl ResultFile {
    /// A file that is made when it is to be written, on a thread that may compute.
    pub fn new<E: Into<JobError>>(
        name: impl Into<String>,
        media_type: &'static str,
        make: impl FnOnce() -> Result<Vec<u8>, E> + Send + 'static,
    ) -> Self {
        let content = Content::Made(Box::new(move || make().map_err(Into::into)));
        Self { name: name.into(), media_type, content }
    }

    /// A file whose content is there.
    pub fn ready(name: impl Into<String>, media_type: &'static str, content: Vec<u8>) -> Self {
        Self::new(name, media_type, move || Ok::<_, JobError>(content))
    }

    /// JSON for people.
    ///
    /// # Errors
    /// To be tried again if it can't be written as JSON.
    pub fn json(name: impl Into<String>, value: &impl Serialize) -> Result<Self, JobError> {
        let content = serde_json::to_vec_pretty(value).map_err(JobError::retry)?;
        Ok(Self::ready(name, media_type::JSON, content))
    }

    /// A file on disk.
    pub fn on_disk(name: impl Into<String>, media_type: &'static str, path: PathBuf) -> Self {
        Self { name: name.into(), media_type, content: Content::File(path) }
    }
}

impl fmt::Debug for ResultFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ResultFile")
            .field("name", &self.name)
            .field("media_type", &self.media_type)
            .finish_non_exhaustive()
    }
}
