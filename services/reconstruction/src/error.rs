//! What is wrong with a session's files or with a question.

use formats::FileRole;
use proto::ErrorCode;
use queue::JobError;
use service::FileError;
use uuid::Uuid;

/// Something about the input that only its owner can mend. The message is for them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// A file can't be read, or a role is filled by none or by several.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file is of a kind that its role does not take.
    #[error("{file}: not a {} file", .role.endings())]
    Kind {
        /// Name of the file.
        file: String,
        /// Its role.
        role: FileRole,
    },
    /// The mapping names something that is not in the file.
    #[error("{name:?} of the mapping is not in {file}, which has {has}")]
    Mapping {
        /// Name in the mapping.
        name: String,
        /// Name of the file.
        file: String,
        /// Names in the file.
        has: String,
    },
    /// A name of the file is mapped to another that is in it too.
    #[error("mapping leads to {name:?} more than once in {file}: it has that name itself")]
    MappedTwice {
        /// The name.
        name: String,
        /// Name of the file.
        file: String,
    },
    /// The marker map or set of the request is none.
    #[error(transparent)]
    MarkerMap(#[from] markers::Error),
    /// Markers of a file can't be made control points.
    #[error("{file}: {source}")]
    Markers {
        /// Name of the file.
        file: String,
        /// Which, and why.
        source: markers::Error,
    },
    /// The session is longer than this service takes.
    #[error(
        "the session has {frames} frames at 60 frames a second, expected at most {limit}; cut it and upload the parts"
    )]
    TooLong {
        /// Number of frames.
        frames: usize,
        /// Most frames.
        limit: usize,
    },
    /// The skeleton, the points or the trajectories don't fit each other or the method.
    #[error(transparent)]
    Sparse(#[from] sparse::Error),
    /// A name stands for no point of the skeleton.
    #[error(transparent)]
    Points(#[from] kinematics::Error),
    /// A file with one control point.
    #[error(
        "{file} has 1 control point ({point}){others}, expected 2 to 16 (a marker map may make them: --map FILE)"
    )]
    OnePoint {
        /// Name of the file.
        file: String,
        /// The point.
        point: String,
        /// ` and` what else the file has, if anything.
        others: String,
    },
    /// More points than a figure may have.
    #[error(
        "{file} has {found} points of the body, of which at most {limit} can be used; choose some: --points {some}"
    )]
    TooManyPoints {
        /// Name of the file.
        file: String,
        /// How many there are.
        found: usize,
        /// Most points.
        limit: usize,
        /// Names of some of them, separated by commas.
        some: String,
    },
    /// Points and cameras have no frame in common, or the points have none.
    #[error(
        "there is no frame to solve; expected at least one that has measured points, and pictures where cameras are used"
    )]
    NoFrame,
    /// No point in any frame.
    #[error("no point was measured in any frame, expected at least one")]
    NothingMeasured,
    /// Something of a request is out of range.
    #[error("{field} is {found}, expected {expected}")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// What it is.
        found: String,
        /// What would do.
        expected: &'static str,
    },
    /// Points too far apart to be on one body.
    #[error(
        "measured points are too far apart in half of the frames: {first} and {second} {width_m:.1} m, where the body has a \
         stature of {stature_m:.2} m: expected positions in metres (they are probably {unit})"
    )]
    Unit {
        /// One of the two points that are farthest apart.
        first: String,
        /// The other.
        second: String,
        /// Median over the frames of the widest distance, metres.
        width_m: f64,
        /// Stature of the body, metres.
        stature_m: f64,
        /// `in` and the unit that the file probably has.
        unit: String,
    },
    /// What cameras saw in a frame of a request can't be read.
    #[error("frame {frame}: {source}")]
    Frame {
        /// Index of the frame.
        frame: usize,
        /// What is wrong.
        source: FileError,
    },
    /// Nobody's body is described.
    #[error(transparent)]
    Shape(#[from] camera_jobs::ShapeError),
    /// The body model does not go with inverse kinematics.
    #[error(transparent)]
    Body(#[from] body::Error),
    /// A figure can't be solved.
    #[error(transparent)]
    InverseKinematics(#[from] inverse_kinematics::Error),
    /// Silhouettes are damaged or missing.
    #[error(transparent)]
    Silhouettes(#[from] multi_view::Error),
}

impl From<InputError> for JobError {
    fn from(error: InputError) -> Self {
        // A run that was stopped is not one with bad input.
        match error {
            InputError::Sparse(sparse::Error::Stopped { .. }) => Self::Stopped,
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
    #[error("motion database {0} does not exist or is not ready")]
    NoSuchDatabase(Uuid),
    #[error("the motion database can't be loaded")]
    Prior(#[source] JobError),
    #[error("database: {0}")]
    Catalogue(#[from] sqlx::Error),
    #[error(transparent)]
    Model(#[from] library::body_model::ModelError),
    #[error("the caller has gone")]
    Gone,
    #[error("too many live streams: this service follows {limit} at once")]
    TooManyStreams { limit: usize },
    #[error("this service is shutting down")]
    ShuttingDown,
    #[error("no thread for a live stream: {0}")]
    NoThread(#[source] std::io::Error),
    #[error("the thread of a live stream panicked")]
    Panicked,
}

impl proto::CallError for CallError {
    fn code(&self) -> ErrorCode {
        match self {
            Self::Input(InputError::Sparse(sparse::Error::Stopped { .. })) => ErrorCode::Cancelled,
            Self::Input(InputError::TooLong { .. }) | Self::TooManyStreams { .. } | Self::NoThread(_) => {
                ErrorCode::TooLarge
            }
            Self::Gone => ErrorCode::Cancelled,
            Self::Model(error) => error.code(),
            Self::Panicked => ErrorCode::Internal,
            Self::Request(_) | Self::Input(_) => ErrorCode::InvalidInput,
            Self::NoSuchDatabase(_) => ErrorCode::NotFound,
            Self::Prior(JobError::GiveUp { .. }) => ErrorCode::NotReady,
            Self::Prior(_) | Self::Catalogue(_) | Self::ShuttingDown => ErrorCode::Unavailable,
        }
    }
}

impl From<camera_jobs::ShapeError> for CallError {
    fn from(error: camera_jobs::ShapeError) -> Self {
        Self::Input(error.into())
    }
}

impl From<sparse::Error> for CallError {
    fn from(error: sparse::Error) -> Self {
        Self::Input(error.into())
    }
}

impl From<CallError> for tonic::Status {
    fn from(error: CallError) -> Self {
        proto::status(&error)
    }
}
