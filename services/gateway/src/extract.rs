//! axum's extractors, with refusals as problem details.

use axum::{
    body::Bytes,
    extract::{
        FromRequest, FromRequestParts, Request,
        path::ErrorKind,
        rejection::{BytesRejection, PathRejection, QueryRejection},
    },
    http::{StatusCode, header},
};
use serde::de::DeserializeOwned;

use crate::{App, error::Error, idempotency::RequestKey};

/// Largest JSON body, bytes.
pub(crate) const MAX_JSON_BYTES: usize = 256 << 10;

/// Parts of the path.
#[derive(Debug, FromRequestParts)]
#[from_request(via(axum::extract::Path), rejection(Error))]
pub(crate) struct Path<T>(pub T);

/// The query string.
#[derive(Debug, FromRequestParts)]
#[from_request(via(axum::extract::Query), rejection(Error))]
pub(crate) struct Query<T>(pub T);

/// The JSON body of a POST, and its idempotency key.
#[derive(Debug)]
pub(crate) struct Posted<T> {
    /// the body; an empty one counts as `{}`
    pub body: T,
    /// what the request is known by
    pub request: RequestKey,
}

impl<T: DeserializeOwned> FromRequest<App> for Posted<T> {
    type Rejection = Error;

    async fn from_request(request: Request, app: &App) -> Result<Self, Error> {
        let method = request.method().clone();
        let path = request.uri().path().to_owned();
        let headers = request.headers().clone();
        let body = Bytes::from_request(request, app).await?;
        let json = if body.is_empty() {
            &b"{}"[..]
        } else {
            check_is_json(&headers)?;
            &body[..]
        };
        let parsed = serde_json::from_slice(json).map_err(|error| match error.classify() {
            serde_json::error::Category::Data => Error::Unprocessable(format!("body: {error}")),
            _ => Error::BadRequest(format!("body is not JSON: {error}")),
        })?;
        Ok(Self { body: parsed, request: RequestKey::read(&headers, &method, &path, &body)? })
    }
}

fn check_is_json(headers: &axum::http::HeaderMap) -> Result<(), Error> {
    let found = headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or("none");
    let essence = found.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    if essence == "application/json" || (essence.starts_with("application/") && essence.ends_with("+json")) {
        Ok(())
    } else {
        Err(Error::UnsupportedMediaType(format!("content type is {found}, expected application/json")))
    }
}

/// What the id in a path names.
fn named_by(key: &str) -> &'static str {
    match key {
        "run_id" => "run",
        "session_id" => "session",
        _ => "item",
    }
}

impl From<PathRejection> for Error {
    fn from(rejection: PathRejection) -> Self {
        match rejection {
            // an id that can't be one names nothing
            PathRejection::FailedToDeserializePathParams(failed)
                if failed.status() == StatusCode::BAD_REQUEST =>
            {
                let (what, which) = match failed.kind() {
                    ErrorKind::ParseErrorAtKey { key, value, .. } => (named_by(key), value.clone()),
                    other => ("path", other.to_string()),
                };
                Self::NotFound { what, which }
            }
            other => Self::Internal(format!("path: {}", other.body_text())),
        }
    }
}

impl From<QueryRejection> for Error {
    fn from(rejection: QueryRejection) -> Self {
        Self::BadRequest(rejection.body_text())
    }
}

impl From<BytesRejection> for Error {
    fn from(rejection: BytesRejection) -> Self {
        if rejection.status() == StatusCode::PAYLOAD_TOO_LARGE {
            Self::TooLarge { limit_bytes: MAX_JSON_BYTES as u64 }
        } else {
            Self::BadRequest(rejection.body_text())
        }
    }
}
