//! Why a question can't be answered.

use proto::ErrorCode;
use uuid::Uuid;

/// An error of a query.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The request makes no sense by itself.
    #[error(transparent)]
    Request(#[from] proto::Error),
    /// There is no such database.
    #[error("motion database {0} does not exist")]
    NoSuchDatabase(Uuid),
    /// The database is not built.
    #[error("motion database {0} is not ready: its build has not succeeded yet")]
    NotReady(Uuid),
    /// The page token is none of ours.
    #[error("page_token is not one that ListDatabases gave")]
    PageToken,
    /// A control point is not on the skeleton, or the skeleton is not what the question needs.
    #[error(transparent)]
    Kinematics(#[from] kinematics::Error),
    /// The poses are no motion.
    #[error(transparent)]
    Model(#[from] model::Error),
    /// The database can't answer this question, or its file is not one.
    #[error(transparent)]
    Database(#[from] motion_db::Error),
    /// The answer needs more memory than there is for it.
    #[error("{what} needs {needed_bytes} bytes, this service keeps at most {limit_bytes}")]
    TooLarge {
        /// What.
        what: &'static str,
        /// Bytes it would take.
        needed_bytes: u64,
        /// Bytes there are.
        limit_bytes: u64,
    },
    /// There is no such shard.
    #[error("shard is {found}, the motion database has {num_shards}")]
    NoSuchShard {
        /// What was asked for.
        found: String,
        /// How many shards there are.
        num_shards: usize,
    },
    /// The object store failed, or does not hold what the catalogue says.
    #[error(transparent)]
    File(#[from] library::motion_database::Error),
    /// Another replica refused its part of the question.
    #[error("{}", .0.message())]
    Peer(Box<tonic::Status>),
    /// PostgreSQL failed.
    #[error("database: {0}")]
    Catalogue(#[from] sqlx::Error),
}

impl proto::CallError for Error {
    fn code(&self) -> ErrorCode {
        use library::motion_database::Error as File;
        match self {
            Self::Request(_) | Self::PageToken | Self::Kinematics(_) | Self::Model(_) => {
                ErrorCode::InvalidInput
            }
            Self::Database(motion_db::Error::Window { .. }) => ErrorCode::InvalidInput,
            Self::Database(motion_db::Error::Version { .. }) => ErrorCode::NotReady,
            Self::NoSuchDatabase(_) => ErrorCode::NotFound,
            Self::NotReady(_) => ErrorCode::NotReady,
            Self::TooLarge { .. } => ErrorCode::TooLarge,
            Self::NoSuchShard { .. } => ErrorCode::InvalidInput,
            Self::File(File::Store(error)) if error.is_transient() => ErrorCode::Unavailable,
            Self::File(File::Store(store::Error::TooLarge { .. })) => ErrorCode::TooLarge,
            Self::File(File::Database(motion_db::Error::Version { .. })) => ErrorCode::NotReady,
            Self::Catalogue(_) => ErrorCode::Unavailable,
            Self::Database(_) | Self::File(_) | Self::Peer(_) => ErrorCode::Internal,
        }
    }
}

impl From<Error> for tonic::Status {
    fn from(error: Error) -> Self {
        match error {
            // What another replica says of its shard is said of the whole.
            Error::Peer(status) => *status,
            error => proto::status(&error),
        }
    }
}
