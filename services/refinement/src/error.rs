//! What is wrong with a session or with a question.

use library::body_model::ModelError;
use proto::ErrorCode;
use queue::JobError;
use service::FileError;

/// Something about the input that only its owner can mend. The message is for them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// A file can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// Silhouettes are missing or damaged.
    #[error(transparent)]
    Silhouettes(#[from] multi_view::Error),
    /// No body is to be found.
    #[error(transparent)]
    Fit(#[from] shape_fit::Error),
    /// Nothing can be tracked.
    #[error(transparent)]
    Tracking(#[from] tracking::Error),
    /// A body that can't be written.
    #[error(transparent)]
    Body(#[from] body::Error),
    /// Joints that can't be written.
    #[error(transparent)]
    Joints(#[from] model::Error),
}

impl From<InputError> for JobError {
    fn from(error: InputError) -> Self {
        // A job that was stopped is not one with bad input.
        match error {
            InputError::Tracking(tracking::Error::Stopped { .. }) => Self::Stopped,
            error => Self::bad_input(error),
        }
    }
}

/// Why a gRPC call can't be answered.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CallError {
    #[error(transparent)]
    Request(#[from] proto::Error),
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl proto::CallError for CallError {
    fn code(&self) -> ErrorCode {
        match self {
            Self::Input(InputError::Tracking(tracking::Error::Stopped { .. })) => ErrorCode::Cancelled,
            Self::Request(_) | Self::Input(_) => ErrorCode::InvalidInput,
            Self::Model(error) => error.code(),
        }
    }
}

impl From<CallError> for tonic::Status {
    fn from(error: CallError) -> Self {
        proto::status(&error)
    }
}
