use axum::{
    Json,
    http::{HeaderName, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Serialize;
use serde_json::Value;

use crate::error::Result;

/// The answer of a POST: something was made (201) or will be done (202), and where it is.
#[derive(Debug)]
pub(crate) struct Answer {
    pub status: StatusCode,
    /// path of what was made
    pub location: Option<String>,
    pub body: Value,
    /// whether it is the stored answer to an earlier request with the same idempotency key
    pub replayed: bool,
}

impl Answer {
    /// 201: `body` is now at `location`.
    pub fn created(location: String, body: &impl Serialize) -> Result<Self> {
        Self::new(StatusCode::CREATED, location, body)
    }

    /// 202: `body` is a run, to be watched at `location`.
    pub fn accepted(location: String, body: &impl Serialize) -> Result<Self> {
        Self::new(StatusCode::ACCEPTED, location, body)
    }

    fn new(status: StatusCode, location: String, body: &impl Serialize) -> Result<Self> {
        Ok(Self { status, location: Some(location), body: serde_json::to_value(body)?, replayed: false })
    }
}

impl IntoResponse for Answer {
    fn into_response(self) -> Response {
        let mut response = (self.status, Json(self.body)).into_response();
        let headers = response.headers_mut();
        if let Some(location) = self.location.and_then(|l| HeaderValue::try_from(l).ok()) {
            headers.insert(header::LOCATION, location);
        }
        if self.replayed {
            headers.insert(HeaderName::from_static("idempotency-replayed"), HeaderValue::from_static("true"));
        }
        response
    }
}
