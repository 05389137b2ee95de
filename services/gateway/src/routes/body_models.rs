//! Body models: the paths of what [`crate::versioned`] does with them. Their files are in `bodies`.

use axum::{
    Json,
    body::Body,
    http::{HeaderMap, StatusCode},
};

use crate::{
    access::{Reader, Writer},
    answer::Answer,
    error::Result,
    extract::{Path, Posted, Query},
    files::File,
    page::{Page, PageQuery},
    runs::{self, NewBodyModelBuild, Run},
    versioned::{self, BodyModel, Latest, NewBodyModel},
};

/// Make a body model
///
/// It is `open` then: upload registered scans to it, and have it built.
#[utoipa::path(
    post, path = "/v1/body-models", tag = "body models", request_body = NewBodyModel,
    params(("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day")),
    responses((status = 201, body = BodyModel, headers(("Location" = String, description = "the body model")))),
)]
pub(super) async fn create(Writer(by): Writer, posted: Posted<NewBodyModel>) -> Result<Answer> {
    versioned::create::<BodyModel>(&by, posted).await
}

/// List body models
///
/// All versions, newest first; the last is the shipped one.
#[utoipa::path(
    get, path = "/v1/body-models", tag = "body models", params(PageQuery),
    responses((status = 200, body = Page<BodyModel>)),
)]
pub(super) async fn list(Reader(by): Reader, Query(page): Query<PageQuery>) -> Result<Json<Page<BodyModel>>> {
    versioned::list(&by, page).await
}

/// Show a body model
#[utoipa::path(
    get, path = "/v1/body-models/{body_model}", tag = "body models",
    params(("body_model" = String, Path, description = "id, name (its latest version), name@version or shipped")),
    responses((status = 200, body = BodyModel)),
)]
pub(super) async fn show(Reader(by): Reader, Path(which): Path<String>) -> Result<Json<BodyModel>> {
    Ok(Json(versioned::look(&by, &which, Latest::Any).await?))
}

/// Delete a body model
///
/// With the scans that it was built from. Refused (409, naming the users) while it is being built or a run uses it. What
/// finished runs made with it stays.
#[utoipa::path(
    delete, path = "/v1/body-models/{body_model}", tag = "body models",
    params(("body_model" = String, Path, description = "id or name@version")),
    responses((status = 204)),
)]
pub(super) async fn delete(Writer(by): Writer, Path(which): Path<String>) -> Result<StatusCode> {
    versioned::delete::<BodyModel>(by, which).await
}

/// List the files of a body model
#[utoipa::path(
    get, path = "/v1/body-models/{body_model}/files", tag = "body models",
    params(("body_model" = String, Path, description = "id, name or name@version")),
    responses((status = 200, body = Vec<File>)),
)]
pub(super) async fn list_files(Reader(by): Reader, Path(which): Path<String>) -> Result<Json<Vec<File>>> {
    versioned::list_files::<BodyModel>(&by, &which).await
}

/// Upload a file to learn a body model from
///
/// An archive (zip, tar, tar.gz, tar.zst) of registered scans, OBJ or PLY, or `vertices.npy` with `faces.npy`; or such files
/// one by one, and beside them `rig.json`, `skin_joints.npy`, `skin_weights.npy`, `scans.csv`, `subjects.csv`. Only while the
/// model is `open` or `failed`.
#[utoipa::path(
    put, path = "/v1/body-models/{body_model}/files/{name}", tag = "body models",
    params(
        ("body_model" = String, Path, description = "id, name or name@version"),
        ("name" = String, Path, example = "scans.zip"),
        ("Content-Digest" = Option<String>, Header, description = "sha-256=:<base64>:"),
    ),
    request_body(content = String, content_type = "application/octet-stream"),
    responses((status = 201, body = File), (status = 200, body = File, description = "replaced")),
)]
pub(super) async fn put_file(
    Writer(by): Writer,
    Path(which): Path<(String, String)>,
    headers: HeaderMap,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    versioned::put_file::<BodyModel>(by, which, &headers, body).await
}

/// Delete a file of a body model
///
/// Only while the model is `open` or `failed`.
#[utoipa::path(
    delete, path = "/v1/body-models/{body_model}/files/{name}", tag = "body models",
    params(("body_model" = String, Path, description = "id, name or name@version"), ("name" = String, Path,)),
    responses((status = 204)),
)]
pub(super) async fn delete_file(
    Writer(by): Writer,
    Path(which): Path<(String, String)>,
) -> Result<StatusCode> {
    versioned::delete_file::<BodyModel>(by, which).await
}

/// Build a body model
///
/// From the scans uploaded to it, which are fixed from then on. Answers at once (202) with the run.
#[utoipa::path(
    post, path = "/v1/body-models/{body_model}/build", tag = "body models", request_body = NewBodyModelBuild,
    params(
        ("body_model" = String, Path, description = "id, name or name@version"),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn build(
    Writer(by): Writer,
    Path(which): Path<String>,
    posted: Posted<NewBodyModelBuild>,
) -> Result<Answer> {
    runs::build(&by, &which, posted).await
}
