//! What is wrong with a message, and which status code each kind of error gets.

use model::counted;
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
    /// Too few or too many of something.
    #[error("found {found} {what}, expected {expected}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there may be.
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
    #[error("pose {pose} has {}, the skeleton has {expected} degrees of freedom", counted(found, "value"))]
    DofMismatch {
        /// Index of the pose, from 0.
        pose: usize,
        /// Number of values.
        found: usize,
        /// Number of degrees of freedom.
        expected: usize,
    },
}

/// The kinds of error that a service answers with.
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
    /// The client let too much time pass.
    TimedOut,
    /// The client went away.
    Cancelled,
    /// An internal error.
    Internal,
}

/// An error of a service's calls, which knows its kind.
pub trait CallError: std::error::Error {
    /// Which kind of error it is.
    fn code(&self) -> ErrorCode;
}

/// The answer to a call that failed: the one place where errors become status codes and are logged.
///
/// What is wrong with a request is told to the client alone. What is wrong with the system is logged, with its causes, of
/// which the message may say less: an internal error, of which the client is told nothing more, as an error; that something is
/// away or not ready as a warning.
pub fn status(error: &impl CallError) -> Status {
    let code = error.code();
    match code {
        ErrorCode::Internal => {
            tracing::error!(error = ?error, "call failed");
            return Status::internal("internal error");
        }
        ErrorCode::Unavailable | ErrorCode::NotReady => {
            tracing::warn!(error = ?error, "call can't be answered now");
        }
        ErrorCode::InvalidInput
        | ErrorCode::NotFound
        | ErrorCode::TooLarge
        | ErrorCode::TimedOut
        | ErrorCode::Cancelled => {}
    }
    Status::new(Code::from(code), error.to_string())
}

impl From<ErrorCode> for Code {
    fn from(code: ErrorCode) -> Self {
        match code {
            ErrorCode::InvalidInput => Self::InvalidArgument,
            ErrorCode::NotFound => Self::NotFound,
            ErrorCode::NotReady => Self::FailedPrecondition,
            ErrorCode::TooLarge => Self::ResourceExhausted,
            ErrorCode::Unavailable => Self::Unavailable,
            ErrorCode::TimedOut => Self::DeadlineExceeded,
            ErrorCode::Cancelled => Self::Cancelled,
            ErrorCode::Internal => Self::Internal,
        }
    }
}

impl CallError for Error {
    fn code(&self) -> ErrorCode {
        ErrorCode::InvalidInput
    }
}

impl From<Error> for Status {
    fn from(error: Error) -> Self {
        status(&error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("shard 3 of 2")]
    struct Failed(ErrorCode);

    impl CallError for Failed {
        fn code(&self) -> ErrorCode {
            self.0
        }
    }

    #[test]
    fn clients_are_told_everything_but_internal_errors() {
        let told = |code| {
            let status = status(&Failed(code));
            (status.code(), status.message().to_owned())
        };
        assert_eq!(told(ErrorCode::Internal), (Code::Internal, "internal error".to_owned()));
        for (code, expected) in [
            (ErrorCode::InvalidInput, Code::InvalidArgument),
            (ErrorCode::NotFound, Code::NotFound),
            (ErrorCode::NotReady, Code::FailedPrecondition),
            (ErrorCode::TooLarge, Code::ResourceExhausted),
            (ErrorCode::Unavailable, Code::Unavailable),
            (ErrorCode::TimedOut, Code::DeadlineExceeded),
            (ErrorCode::Cancelled, Code::Cancelled),
        ] {
            assert_eq!(told(code), (expected, "shard 3 of 2".to_owned()));
        }
    }
}
