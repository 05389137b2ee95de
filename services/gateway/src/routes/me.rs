use axum::Json;
use serde::Serialize;
use utoipa::ToSchema;

use crate::access::{Access, Reader};

/// Who you are to this server.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Me {
    /// the project that the key is bound to
    #[schema(example = "default")]
    project: String,
    /// name of the key
    key: String,
    /// what the key allows: read, write, admin
    scopes: Vec<String>,
    /// version of the server
    version: &'static str,
}

/// Who am I
///
/// The project and the scopes of the API key in use.
#[utoipa::path(get, path = "/v1/me", tag = "me", responses((status = 200, body = Me)))]
pub(super) async fn show(Reader(Access { caller, .. }): Reader) -> Json<Me> {
    Json(Me {
        project: caller.project,
        key: caller.key_name,
        scopes: caller.scopes,
        version: env!("CARGO_PKG_VERSION"),
    })
}
