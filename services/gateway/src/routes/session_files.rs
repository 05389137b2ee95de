//! The files of sessions.

use axum::{
    Json,
    body::Body,
    http::{HeaderMap, StatusCode},
    response::Response,
};
use formats::FileRole;
use serde::Deserialize;
use utoipa::{
    IntoParams,
    openapi::{
        Required,
        path::{Parameter, ParameterBuilder, ParameterIn},
    },
};
use uuid::Uuid;

use super::download::{self, Object};
use crate::{
    access::{Access, Reader, Writer},
    error::{Error, Result},
    extract::{Path, Query},
    files::{self, File},
    lock::Lock,
    names,
    sessions::{self, SessionFiles},
    upload::Announced,
};

/// What is said about an uploaded file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PutQuery {
    /// what the file is for
    role: Option<FileRole>,
}

// the derived implementation has no text where a schema is given
impl IntoParams for PutQuery {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let text = format!(
            "What the file is for; guessed from the name when left out, where `.bvh` counts as ground truth and archives as \
             masks, or as images or plates if their name says so. Files of each role: {}",
            FileRole::session_endings()
        );
        let role = ParameterBuilder::new()
            .name("role")
            .parameter_in(ParameterIn::Query)
            .required(Required::False)
            .description(Some(text))
            .schema(Some(files::session_role_schema()));
        vec![role.build()]
    }
}

/// List the files of a session
#[utoipa::path(
    get, path = "/v1/sessions/{session_id}/files", tag = "files",
    params(("session_id" = Uuid, Path,)), responses((status = 200, body = Vec<File>)),
)]
pub(super) async fn list(
    Reader(Access { app, caller }): Reader,
    Path(session_id): Path<Uuid>,
) -> Result<Json<Vec<File>>> {
    let mut db = app.db.acquire().await?;
    sessions::find(&mut db, caller.project_id, session_id, Lock::None).await?;
    Ok(Json(files::list(&mut db, session_id).await?))
}

/// Upload a file to a session
///
/// The body is the file's content. A `Content-Digest: sha-256=:<base64>:` header (RFC 9530) is checked; a file that
/// is too large, has another checksum or breaks off is not kept. Another file of the same name is replaced (200), unless a
/// run of the session is under way (409).
#[utoipa::path(
    put, path = "/v1/sessions/{session_id}/files/{name}", tag = "files",
    params(
        ("session_id" = Uuid, Path,), ("name" = String, Path, example = "points.csv"), PutQuery,
        ("Content-Digest" = Option<String>, Header, description = "sha-256=:<base64>:"),
    ),
    request_body(content = String, content_type = "application/octet-stream"),
    responses((status = 201, body = File), (status = 200, body = File, description = "replaced")),
)]
pub(super) async fn put(
    Writer(Access { app, caller }): Writer,
    Path((session_id, name)): Path<(Uuid, String)>,
    Query(query): Query<PutQuery>,
    headers: HeaderMap,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    names::check_file_name(&name)?;
    let role = FileRole::in_session(&name, query.role).map_err(|e| Error::Unprocessable(e.to_string()))?;
    let announced = Announced::read(&headers)?;
    let mut db = app.db.acquire().await?;
    sessions::find(&mut db, caller.project_id, session_id, Lock::None).await?;
    drop(db);
    files::receive(app, caller.project_id, SessionFiles(session_id), (name, role), announced, body).await
}

/// Download a file of a session
///
/// `ETag` is the file's BLAKE3; a single `Range` is honoured.
#[utoipa::path(
    get, path = "/v1/sessions/{session_id}/files/{name}", tag = "files",
    params(("session_id" = Uuid, Path,), ("name" = String, Path,)),
    responses((status = 200, content_type = "application/octet-stream"), (status = 206), (status = 304)),
)]
pub(super) async fn get(
    Reader(Access { app, caller }): Reader,
    Path((session_id, name)): Path<(Uuid, String)>,
    headers: HeaderMap,
) -> Result<Response> {
    let mut db = app.db.acquire().await?;
    sessions::find(&mut db, caller.project_id, session_id, Lock::None).await?;
    let files = files::list(&mut db, session_id).await?;
    drop(db);
    let file =
        files.iter().find(|f| f.name == name).ok_or_else(|| Error::not_found_in("session", "file", &name))?;
    let object = Object {
        name: &file.name,
        store_key: &file.store_key,
        bytes: file.bytes,
        blake3: &file.blake3,
        media_type: &file.media_type,
    };
    download::send(&app, &headers, &object).await
}

/// Delete a file of a session
///
/// Refused (409) while a run of the session is under way.
#[utoipa::path(
    delete, path = "/v1/sessions/{session_id}/files/{name}", tag = "files",
    params(("session_id" = Uuid, Path,), ("name" = String, Path,)), responses((status = 204)),
)]
pub(super) async fn delete(
    Writer(Access { app, caller }): Writer,
    Path((session_id, name)): Path<(Uuid, String)>,
) -> Result<StatusCode> {
    files::remove(app, caller.project_id, SessionFiles(session_id), name).await
}
