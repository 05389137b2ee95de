//! What is wrong with a session's files or with a question.

use camera_jobs::ShapeError;
use library::body_model::ModelError;
use model::counted;
use proto::ErrorCode;
use queue::JobError;
use service::FileError;

/// Something about the input that only its owner can mend. The message is for them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// A file can't be read, or something else is there than should be.
    #[error(transparent)]
    File(#[from] FileError),
    /// A camera has no frames where they are wanted.
    #[error("{file} has {}; first_frame is {first}", count.map_or("too few frames".to_owned(), |count| counted(count, "frame")))]
    NoFirstFrame {
        /// Name of the file.
        file: String,
        /// Its frames, where they are known.
        count: Option<usize>,
        /// First frame that is wanted.
        first: usize,
    },
    /// A camera that the calibration lacks.
    #[error("no camera {name:?}; the calibration has {known}")]
    NoCamera {
        /// Name that is wanted.
        name: String,
        /// Names that there are.
        known: String,
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
    /// Files and cameras don't go together, or silhouettes are damaged.
    #[error(transparent)]
    Session(#[from] multi_view::Error),
    /// No body is to be found.
    #[error(transparent)]
    Fit(#[from] shape_fit::Error),
    /// Scans don't make a model, or a body can't be.
    #[error(transparent)]
    Body(#[from] body::Error),
    /// No visual hull can be carved.
    #[error(transparent)]
    Hull(#[from] vision::Error),
}

impl From<InputError> for JobError {
    fn from(error: InputError) -> Self {
        Self::bad_input(error)
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

impl From<FileError> for CallError {
    fn from(error: FileError) -> Self {
        Self::Input(error.into())
    }
}

impl From<ShapeError> for CallError {
    fn from(error: ShapeError) -> Self {
        match error {
            ShapeError::Body(error) => Self::Input(error.into()),
            ShapeError::Request(error) => Self::Request(error),
            error => {
                Self::Input(FileError::unexpected("body", error.to_string(), "a body of the model").into())
            }
        }
    }
}

impl proto::CallError for CallError {
    fn code(&self) -> ErrorCode {
        match self {
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
