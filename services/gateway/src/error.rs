use axum::{
    Json,
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Serialize;

use crate::refusal::Refusal;

/// Why a request was not done. Every answer that is not a success is one of these, as RFC 9457 problem details.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No key, or one that is not known.
    #[error("{0}")]
    Unauthorized(&'static str),
    /// The key lacks a scope.
    #[error("this API key has no scope {0:?}")]
    Forbidden(&'static str),
    /// There is no such thing in the caller's project, or in something of it.
    #[error("there is no {what} {which:?} in this {within}")]
    NotFound {
        /// kind of thing that it would be in
        within: &'static str,
        /// kind of thing
        what: &'static str,
        /// what the request named
        which: String,
    },
    /// There is nothing at this path.
    #[error("there is nothing at {0}; /docs lists all paths")]
    NoSuchPath(String),
    /// The path is there, but not for this method.
    #[error("{0} is not a method of this path")]
    MethodNotAllowed(String),
    /// The request can't be read.
    #[error("{0}")]
    BadRequest(String),
    /// The request was read, but asks for something that can't be.
    #[error("{0}")]
    Unprocessable(String),
    /// The thing is in a state that does not allow it.
    #[error("{0}")]
    Conflict(String),
    /// The body is not of a media type that this path takes.
    #[error("{0}")]
    UnsupportedMediaType(String),
    /// The body is larger than allowed.
    #[error("the body is larger than the allowed {limit_bytes} bytes")]
    TooLarge {
        /// the limit, bytes
        limit_bytes: u64,
    },
    /// The body is not what its sender said; nothing was kept.
    #[error("{algorithm} of the body is {found}, the request announced {expected}; nothing was kept")]
    ChecksumMismatch {
        /// `sha-256` or `blake3`
        algorithm: &'static str,
        /// announced
        expected: String,
        /// received
        found: String,
    },
    /// The body broke off; nothing was kept.
    #[error("the upload broke off: {0}; nothing was kept")]
    UploadBroken(String),
    /// An idempotency key came again with another request.
    #[error("this Idempotency-Key was used for another request; keys are for retries of the same one")]
    IdempotencyKeyReused,
    /// A range that is not in the file.
    #[error("range {found:?} is not in this file of {bytes} bytes")]
    RangeNotSatisfiable {
        /// the header
        found: String,
        /// size of the file
        bytes: u64,
    },
    /// It took too long.
    #[error("the request took longer than {0} seconds")]
    TimedOut(u64),
    /// PostgreSQL or the object store does not answer.
    #[error("{0} does not answer; try again later")]
    Unavailable(&'static str),
    /// An internal error. The detail is logged and not sent.
    #[error("something went wrong here; it has been logged")]
    Internal(String),
}

/// Result of handlers.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// The same refusal of a request, with what led to it in front.
    pub(crate) fn because(self, reason: &str) -> Self {
        match self {
            Self::Unprocessable(what) => Self::Unprocessable(format!("{reason}{what}")),
            other => other,
        }
    }

    /// A thing that the caller's project does not have.
    pub(crate) fn not_found(what: &'static str, which: impl ToString) -> Self {
        Self::not_found_in("project", what, which)
    }

    /// A thing that something else, such as a session, does not have.
    pub(crate) fn not_found_in(within: &'static str, what: &'static str, which: impl ToString) -> Self {
        Self::NotFound { within, what, which: which.to_string() }
    }

    /// Status, the last part of the problem's type, and its title: the one place where errors meet HTTP.
    fn kind(&self) -> (StatusCode, &'static str, &'static str) {
        use StatusCode as S;
        match self {
            Self::Unauthorized(_) => (S::UNAUTHORIZED, "unauthorized", "No valid API key"),
            Self::Forbidden(_) => (S::FORBIDDEN, "forbidden", "Not allowed with this API key"),
            Self::NotFound { .. } | Self::NoSuchPath(_) => (S::NOT_FOUND, "not-found", "Not found"),
            Self::MethodNotAllowed(_) => (S::METHOD_NOT_ALLOWED, "method-not-allowed", "Method not allowed"),
            Self::BadRequest(_) => (S::BAD_REQUEST, "bad-request", "The request can't be read"),
            Self::Unprocessable(_) => (S::UNPROCESSABLE_ENTITY, "unprocessable", "The request is not valid"),
            Self::Conflict(_) => (S::CONFLICT, "conflict", "Conflict with the current state"),
            Self::UnsupportedMediaType(_) => {
                (S::UNSUPPORTED_MEDIA_TYPE, "unsupported-media-type", "Media type not accepted here")
            }
            Self::TooLarge { .. } => (S::PAYLOAD_TOO_LARGE, "too-large", "Too large"),
            Self::ChecksumMismatch { .. } => {
                (S::UNPROCESSABLE_ENTITY, "checksum-mismatch", "The checksum is wrong")
            }
            Self::UploadBroken(_) => (S::BAD_REQUEST, "upload-broken", "The upload broke off"),
            Self::IdempotencyKeyReused => {
                (S::UNPROCESSABLE_ENTITY, "idempotency-key-reused", "Idempotency key used before")
            }
            Self::RangeNotSatisfiable { .. } => {
                (S::RANGE_NOT_SATISFIABLE, "range-not-satisfiable", "Range not in the file")
            }
            Self::TimedOut(_) => (S::SERVICE_UNAVAILABLE, "timed-out", "Took too long"),
            Self::Unavailable(_) => (S::SERVICE_UNAVAILABLE, "unavailable", "Not available now"),
            Self::Internal(_) => (S::INTERNAL_SERVER_ERROR, "internal", "Internal error"),
        }
    }
}

/// RFC 9457 problem details.
#[derive(Debug, Serialize, utoipa::ToSchema)]
pub(crate) struct Problem {
    /// what kind of problem, `urn:marey:problem:…`; stable, for programs
    #[serde(rename = "type")]
    #[schema(example = "urn:marey:problem:not-found")]
    kind: String,
    /// the kind in words
    #[schema(example = "Not found")]
    title: &'static str,
    /// the HTTP status
    #[schema(example = 404)]
    status: u16,
    /// what was found and what was expected
    detail: String,
}

impl IntoResponse for Error {
    fn into_response(self) -> Response {
        if let Self::Internal(detail) = &self {
            tracing::error!(detail, "request failed");
        }
        let (status, kind, title) = self.kind();
        let problem = Problem {
            kind: format!("urn:marey:problem:{kind}"),
            title,
            status: status.as_u16(),
            detail: self.to_string(),
        };
        let mut response = (status, Json(problem)).into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        match self {
            Self::Unauthorized(_) => {
                headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            }
            Self::Unavailable(_) | Self::TimedOut(_) => {
                headers.insert(header::RETRY_AFTER, HeaderValue::from_static("5"));
            }
            _ => {}
        }
        response
    }
}

impl From<sqlx::Error> for Error {
    fn from(error: sqlx::Error) -> Self {
        match error {
            sqlx::Error::Io(_) | sqlx::Error::PoolTimedOut | sqlx::Error::PoolClosed => {
                tracing::warn!(%error, "database unavailable");
                Self::Unavailable("the database")
            }
            error => Self::Internal(format!("database: {error}")),
        }
    }
}

impl From<queue::Error> for Error {
    fn from(error: queue::Error) -> Self {
        match error {
            queue::Error::Database(error) => error.into(),
            error => Self::Internal(format!("queue: {error}")),
        }
    }
}

impl From<store::Error> for Error {
    fn from(error: store::Error) -> Self {
        match error {
            store::Error::TooLarge { limit_bytes, .. } => Self::TooLarge { limit_bytes },
            store::Error::ChecksumMismatch { expected, found, .. } => {
                Self::ChecksumMismatch { algorithm: "blake3", expected, found }
            }
            store::Error::Interrupted { reason, .. } => Self::UploadBroken(reason),
            error if error.is_transient() => {
                tracing::warn!(%error, "object store unavailable");
                Self::Unavailable("the object store")
            }
            error => Self::Internal(format!("object store: {error}")),
        }
    }
}

impl From<Refusal> for Error {
    fn from(refusal: Refusal) -> Self {
        Self::Unprocessable(refusal.to_string())
    }
}

impl From<serde_json::Error> for Error {
    fn from(error: serde_json::Error) -> Self {
        Self::Internal(format!("json: {error}"))
    }
}
