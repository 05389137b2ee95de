//! Why a live stream ends.

use std::time::Duration;

use proto::{CallError, ErrorCode};

/// Why a stream ends that its client has not ended.
#[derive(Debug, thiserror::Error)]
pub(super) enum StreamEnd {
    #[error("no start message arrived within {} seconds", .0.as_secs_f64())]
    NoStart(Duration),
    #[error("the first message is not a start")]
    NotAStart,
    #[error("{0}")]
    BadFrame(String),
    #[error("no frame for {} seconds", .0.as_secs_f64())]
    NoFrame(Duration),
    #[error("the client is gone")]
    ClientGone,
    #[error("this service is shutting down; go on elsewhere with the last state")]
    ShuttingDown,
}

impl CallError for StreamEnd {
    fn code(&self) -> ErrorCode {
        match self {
            Self::NotAStart | Self::BadFrame(_) => ErrorCode::InvalidInput,
            Self::NoStart(_) | Self::NoFrame(_) => ErrorCode::TimedOut,
            Self::ClientGone => ErrorCode::Cancelled,
            Self::ShuttingDown => ErrorCode::Unavailable,
        }
    }
}

impl From<StreamEnd> for tonic::Status {
    fn from(end: StreamEnd) -> Self {
        match end {
            // an orderly end: nothing to log
            StreamEnd::ShuttingDown => Self::unavailable(end.to_string()),
            end => proto::status(&end),
        }
    }
}
