//! axum's extractors, with refusals as problem details.

use axum::{
    body::Bytes,
    extract::{FromRequest, FromRequestParts, RawPathParams, Request, rejection::BytesRejection},
    http::{Method, StatusCode, header, request::Parts},
};
use formats::media_type;
use serde::{Deserialize, de::DeserializeOwned};

use crate::{App, error::Error, idempotency::RequestKey, json, names::as_id, query};

/// Largest JSON body, bytes.
pub(crate) const MAX_JSON_BYTES: usize = 256 << 10;

/// Parts of the path.
#[derive(Debug)]
pub(crate) struct Path<T>(pub T);

impl<T: DeserializeOwned + Send> FromRequestParts<App> for Path<T> {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Error> {
        check_path(parts, app).await?;
        let path = axum::extract::Path::from_request_parts(parts, app).await;
        let axum::extract::Path(found) =
            path.map_err(|e| Error::Internal(format!("path: {}", e.body_text())))?;
        Ok(Self(found))
    }
}

/// Refuses a path whose parts can't name anything.
async fn check_path(parts: &mut Parts, app: &App) -> Result<(), Error> {
    let named = RawPathParams::from_request_parts(parts, app)
        .await
        .map_err(|_| Error::NoSuchPath(parts.uri.path().to_owned()))?;
    let mut within = "project";
    for (key, value) in &named {
        let is_no_id = key.ends_with("_id") && as_id(value).is_none();
        // what an uploaded file may be called is said where it is received
        let has_nul = value.contains('\0') && !(key == "name" && parts.method == Method::PUT);
        if is_no_id || has_nul {
            return Err(Error::not_found_in(within, named_by(key), value));
        }
        within = named_by(key);
    }
    Ok(())
}

/// The query string.
#[derive(Debug)]
pub(crate) struct Query<T>(pub T);

impl<T: DeserializeOwned> FromRequestParts<App> for Query<T> {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, _: &App) -> Result<Self, Error> {
        query::read(&parts.uri).map(Self)
    }
}

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
        let text = if body.is_empty() {
            &b"{}"[..]
        } else {
            check_is_json(&headers)?;
            &body[..]
        };
        let parsed = json::read(&json::parse("body", text)?)?;
        Ok(Self { body: parsed, request: RequestKey::read(&headers, &method, &path, &body)? })
    }
}

/// The body of a POST that has no fields.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NoFields {}

fn check_is_json(headers: &axum::http::HeaderMap) -> Result<(), Error> {
    let found = headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or("none");
    let essence = found.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    if essence == media_type::JSON || (essence.starts_with("application/") && essence.ends_with("+json")) {
        Ok(())
    } else {
        Err(Error::UnsupportedMediaType(format!("content type is {found}, expected application/json")))
    }
}

/// What a part of a path names.
fn named_by(key: &str) -> &'static str {
    match key {
        "run_id" => "run",
        "session_id" => "session",
        "motion_database" => "motion database",
        "body_model" => "body model",
        _ => "file",
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
