//! What is wrong with a session's files or with a question.

use proto::ErrorCode;
use queue::JobError;

/// Something about the input that only its owner can mend. The message is for them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// A file can't be read.
    #[error("{file}: {source}")]
    File {
        /// Name of the file.
        file: String,
        /// Where and what.
        source: formats::Error,
    },
    /// A video can't be read.
    #[error("{message}")]
    Video {
        /// With the file's name, without our folders.
        message: String,
    },
    /// No silhouettes can be made of a camera's pictures.
    #[error("{file}: {source}")]
    Background {
        /// Name of the file.
        file: String,
        /// Why not.
        source: background::Error,
    },
    /// Something else than there should be.
    #[error("{what}: found {found}, expected {expected}")]
    Unexpected {
        /// The file or camera.
        what: String,
        /// What there is.
        found: String,
        /// What should be.
        expected: String,
    },
    /// A role that must be filled once.
    #[error("session has {found} files of role {role}{names}, expected {expected}")]
    Count {
        /// The role.
        role: &'static str,
        /// How many files.
        found: usize,
        /// Which, in brackets.
        names: String,
        /// How many there should be.
        expected: &'static str,
    },
    /// Files and cameras don't go together, or silhouettes are damaged.
    #[error(transparent)]
    Session(#[from] multi_view::Error),
    /// Scans don't make a model.
    #[error(transparent)]
    Scans(#[from] body_files::Error),
    /// No body is to be found.
    #[error(transparent)]
    Fit(#[from] shape_fit::Error),
    /// A body model can't be, or not that body.
    #[error(transparent)]
    Body(#[from] body::Error),
    /// No visual hull can be carved.
    #[error(transparent)]
    Hull(#[from] vision::Error),
}

impl InputError {
    pub(crate) fn in_file(file: &str) -> impl Fn(formats::Error) -> Self {
        move |source| Self::File { file: file.to_owned(), source }
    }

    pub(crate) fn unexpected(
        what: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Unexpected { what: what.into(), found: found.into(), expected: expected.into() }
    }
}

impl From<InputError> for JobError {
    fn from(error: InputError) -> Self {
        Self::give_up(error.to_string(), format!("{error:?}"))
    }
}

/// Why a gRPC call can't be answered.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CallError {
    #[error(transparent)]
    Request(#[from] proto::Error),
    #[error(transparent)]
    Input(#[from] InputError),
    #[error("body model {0} does not exist or is not ready")]
    NoSuchModel(String),
    #[error("the body model can't be loaded")]
    Model(#[source] JobError),
    #[error("database: {0}")]
    Catalogue(#[from] sqlx::Error),
}

impl From<CallError> for tonic::Status {
    fn from(error: CallError) -> Self {
        let code = match &error {
            CallError::Request(_) | CallError::Input(_) => ErrorCode::InvalidInput,
            CallError::NoSuchModel(_) => ErrorCode::NotFound,
            CallError::Model(JobError::GiveUp { .. }) => ErrorCode::NotReady,
            CallError::Model(_) | CallError::Catalogue(_) => ErrorCode::Unavailable,
        };
        if matches!(code, ErrorCode::Unavailable | ErrorCode::NotReady) {
            tracing::error!(error = ?error, "call failed");
        }
        code.status(error)
    }
}
