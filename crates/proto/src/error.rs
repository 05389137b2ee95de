//! What is wrong with a message, and which status code each kind of error gets.

use tonic::{Code, Status};

/// A message that does not say anything sensible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field that must be there is not.
    #[error("{field} is missing")]
    Missing {
        /// The field.
        field: &'static str,
    },
    /// A field is not a UUID.
    #[error("{field} is {found:?}, expected a UUID")]
    BadId {
        /// The field.
        field: &'static str,
        /// What it holds.
        found: String,
    },
    /// A number is out of its range.
    #[error("{field} is {found}, expected {expected}")]
    OutOfRange {
        /// The field.
        field: &'static str,
        /// What it holds.
        found: String,
        /// The range.
        expected: &'static str,
    },
    /// A coordinate or channel value is NaN or infinite.
    #[error("frame {frame}: {what} is {found}, expected a finite number")]
    NotFinite {
        /// Index of the frame, from 0.
        frame: usize,
        /// Which value.
        what: String,
        /// The value.
        found: f64,
    },
    /// A frame holds two samples of one point.
    #[error("frame {frame} has two samples of point {name:?}")]
    DuplicatePoint {
        /// Index of the frame, from 0.
        frame: usize,
        /// The point.
        name: String,
    },
    /// A pose has another number of values than the skeleton has degrees of freedom.
    #[error("pose {pose} has {found} values, the skeleton has {expected} degrees of freedom")]
    DofMismatch {
        /// Index of the pose, from 0.
        pose: usize,
        /// Number of values.
        found: usize,
        /// Number of degrees of freedom.
        expected: usize,
    },
}

/// The kinds of error that a service answers with. Each service's error says which kind it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorCode {
    /// The request can't be right, whatever the state of the system.
    InvalidInput,
    /// What the request names does not exist.
    NotFound,
    /// It exists, but is not in a state to answer: a database that is not built yet.
    NotReady,
    /// It would take more memory or time than the service gives to one request.
    TooLarge,
    /// Something the service needs is away; try again.
    Unavailable,
    /// The client went away.
    Cancelled,
    /// A fault of ours.
    Internal,
}

impl ErrorCode {
    /// The answer to the client. Faults of ours keep their detail to themselves: log it first.
    pub fn status(self, message: impl std::fmt::Display) -> Status {
        match self {
            Self::Internal => Status::internal("internal error"),
            code => Status::new(Code::from(code), message.to_string()),
        }
    }
}

impl From<ErrorCode> for Code {
    fn from(code: ErrorCode) -> Self {
        match code {
            ErrorCode::InvalidInput => Self::InvalidArgument,
            ErrorCode::NotFound => Self::NotFound,
            ErrorCode::NotReady => Self::FailedPrecondition,
            ErrorCode::TooLarge => Self::ResourceExhausted,
            ErrorCode::Unavailable => Self::Unavailable,
            ErrorCode::Cancelled => Self::Cancelled,
            ErrorCode::Internal => Self::Internal,
        }
    }
}

impl From<Error> for Status {
    fn from(error: Error) -> Self {
        ErrorCode::InvalidInput.status(error)
    }
}
