//! Motion databases: the paths of what [`crate::versioned`] does with them, and of what only they have.

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
    page::{Item, Page, PageQuery},
    runs::{self, NewBuild, NewTraining, Run},
    versioned::{self, Clip, Latest, MotionDatabase, MotionDatabaseDetails, NewMotionDatabase},
};

/// Make a motion database
///
/// It is `open` then: upload files to it, and have it built. With a `base` it is that database with clips added, or
/// left out; what there is stays as it is.
#[utoipa::path(
    post, path = "/v1/motion-databases", tag = "motion databases", request_body = NewMotionDatabase,
    params(("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day")),
    responses((status = 201, body = MotionDatabase, headers(("Location" = String, description = "the motion database")))),
)]
pub(super) async fn create(Writer(by): Writer, posted: Posted<NewMotionDatabase>) -> Result<Answer> {
    versioned::create::<MotionDatabase>(&by, posted).await
}

/// List motion databases
///
/// All versions, newest first.
#[utoipa::path(
    get, path = "/v1/motion-databases", tag = "motion databases", params(PageQuery),
    responses((status = 200, body = Page<MotionDatabase>)),
)]
pub(super) async fn list(
    Reader(by): Reader,
    Query(page): Query<PageQuery>,
) -> Result<Json<Page<MotionDatabase>>> {
    versioned::list(&by, page).await
}

/// Show a motion database
///
/// With what is in it, by action and subject, and who uses it.
#[utoipa::path(
    get, path = "/v1/motion-databases/{motion_database}", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name (its latest version) or name@version")),
    responses((status = 200, body = MotionDatabaseDetails)),
)]
pub(super) async fn show(
    Reader(by): Reader,
    Path(which): Path<String>,
) -> Result<Json<MotionDatabaseDetails>> {
    let database = versioned::look(&by, &which, Latest::Any).await?;
    let mut db = by.app.db.acquire().await?;
    Ok(Json(versioned::details(&mut db, database).await?))
}

/// List the clips of a motion database
///
/// In its order; none until it is ready.
#[utoipa::path(
    get, path = "/v1/motion-databases/{motion_database}/clips", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name (its latest version) or name@version")),
    responses((status = 200, body = Vec<Clip>)),
)]
pub(super) async fn clips(Reader(by): Reader, Path(which): Path<String>) -> Result<Json<Vec<Clip>>> {
    let database: MotionDatabase = versioned::look(&by, &which, Latest::Any).await?;
    let mut db = by.app.db.acquire().await?;
    Ok(Json(versioned::clips(&mut db, database.id()).await?))
}

/// Delete a motion database
///
/// With the files that it was built from and the models trained on it. Refused (409, naming the users) while it is being
/// built, a run uses it, or a version that is not built yet is to be made from it. What finished runs made with it, and
/// versions that were made from it, stay.
#[utoipa::path(
    delete, path = "/v1/motion-databases/{motion_database}", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id or name@version")),
    responses((status = 204)),
)]
pub(super) async fn delete(Writer(by): Writer, Path(which): Path<String>) -> Result<StatusCode> {
    versioned::delete::<MotionDatabase>(by, which).await
}

/// List the files of a motion database
#[utoipa::path(
    get, path = "/v1/motion-databases/{motion_database}/files", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name or name@version")),
    responses((status = 200, body = Vec<File>)),
)]
pub(super) async fn list_files(Reader(by): Reader, Path(which): Path<String>) -> Result<Json<Vec<File>>> {
    versioned::list_files::<MotionDatabase>(&by, &which).await
}

/// Upload a file to build a motion database from
///
/// An archive (zip, tar, tar.gz, tar.zst) of ASF and AMC or of BVH files, or such files one by one. As for sessions,
/// `Content-Digest` is checked. Only while the database is `open` or `failed`.
#[utoipa::path(
    put, path = "/v1/motion-databases/{motion_database}/files/{name}", tag = "motion databases",
    params(
        ("motion_database" = String, Path, description = "id, name or name@version"),
        ("name" = String, Path, example = "walks.zip"),
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
    versioned::put_file::<MotionDatabase>(by, which, &headers, body).await
}

/// Delete a file of a motion database
///
/// Only while the database is `open` or `failed`.
#[utoipa::path(
    delete, path = "/v1/motion-databases/{motion_database}/files/{name}", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name or name@version"), ("name" = String, Path,)),
    responses((status = 204)),
)]
pub(super) async fn delete_file(
    Writer(by): Writer,
    Path(which): Path<(String, String)>,
) -> Result<StatusCode> {
    versioned::delete_file::<MotionDatabase>(by, which).await
}

/// Build a motion database
///
/// From the files uploaded to it, which are fixed from then on, and the clips of its base. Answers at once (202) with the
/// run.
#[utoipa::path(
    post, path = "/v1/motion-databases/{motion_database}/build", tag = "motion databases", request_body = NewBuild,
    params(
        ("motion_database" = String, Path, description = "id, name or name@version"),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn build(
    Writer(by): Writer,
    Path(which): Path<String>,
    posted: Posted<NewBuild>,
) -> Result<Answer> {
    runs::build(&by, &which, posted).await
}

/// Train a model on a motion database
///
/// For method `gplvm`. It is kept with this version of the database, in place of one that was trained before. Answers at
/// once (202) with the run.
#[utoipa::path(
    post, path = "/v1/motion-databases/{motion_database}/train", tag = "motion databases", request_body = NewTraining,
    params(
        ("motion_database" = String, Path, description = "id, name (its latest version that is ready) or name@version"),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn train(
    Writer(by): Writer,
    Path(which): Path<String>,
    posted: Posted<NewTraining>,
) -> Result<Answer> {
    runs::train(&by, &which, posted).await
}
