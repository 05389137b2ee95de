//! The files that motion databases and body models are built from.

use axum::{
    Json,
    body::Body,
    extract::State,
    http::{HeaderMap, StatusCode},
};
use formats::FileRole;
use uuid::Uuid;

use super::{
    body_models,
    files::{self, File, Owner},
    lookup::{self, Latest, Lock},
};
use crate::{
    App,
    access::{Reader, Writer},
    error::{Error, Result},
    extract::Path,
    names,
    upload::Announced,
};

/// List the files of a motion database
#[utoipa::path(
    get, path = "/v1/motion-databases/{motion_database}/files", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name or name@version")),
    responses((status = 200, body = Vec<File>)),
)]
pub(super) async fn list_of_database(
    State(app): State<App>,
    Reader(caller): Reader,
    Path(which): Path<String>,
) -> Result<Json<Vec<File>>> {
    let mut db = app.db.acquire().await?;
    let database =
        lookup::motion_database(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    Ok(Json(files::of_owner(&mut db, database.id).await?))
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
pub(super) async fn put_in_database(
    State(app): State<App>,
    Writer(caller): Writer,
    Path((which, name)): Path<(String, String)>,
    headers: HeaderMap,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    names::check_file_name(&name)?;
    if !FileRole::is_motion_file(&name) {
        return Err(Error::Unprocessable(format!(
            "{name:?} is no motion file: expected .zip, .tar, .tar.gz, .tar.zst, .asf, .amc or .bvh"
        )));
    }
    let announced = Announced::read(&headers)?;
    let mut db = app.db.acquire().await?;
    let database =
        lookup::motion_database(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    drop(db);
    files::check_collects(&database)?;
    let file_id = Uuid::now_v7();
    let key = store::key::motion_database_input(database.id, file_id);
    let upload = files::Upload {
        file_id,
        owner: Owner::MotionDatabase(database.id),
        name,
        role: FileRole::Motion,
        key,
    };
    files::receive(app, caller.project_id, upload, announced, body).await
}

/// Delete a file of a motion database
///
/// Only while the database is `open` or `failed`.
#[utoipa::path(
    delete, path = "/v1/motion-databases/{motion_database}/files/{name}", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name or name@version"), ("name" = String, Path,)),
    responses((status = 204)),
)]
pub(super) async fn delete_of_database(
    State(app): State<App>,
    Writer(caller): Writer,
    Path((which, name)): Path<(String, String)>,
) -> Result<StatusCode> {
    let mut db = app.db.acquire().await?;
    let database =
        lookup::motion_database(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    drop(db);
    let owner = Owner::MotionDatabase(database.id);
    files::remove(app, caller.project_id, owner, name).await
}

/// List the files of a body model
#[utoipa::path(
    get, path = "/v1/body-models/{body_model}/files", tag = "body models",
    params(("body_model" = String, Path, description = "id, name or name@version")),
    responses((status = 200, body = Vec<File>)),
)]
pub(super) async fn list_of_body_model(
    State(app): State<App>,
    Reader(caller): Reader,
    Path(which): Path<String>,
) -> Result<Json<Vec<File>>> {
    let mut db = app.db.acquire().await?;
    let model = body_models::find(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    Ok(Json(files::of_owner(&mut db, model.id).await?))
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
pub(super) async fn put_in_body_model(
    State(app): State<App>,
    Writer(caller): Writer,
    Path((which, name)): Path<(String, String)>,
    headers: HeaderMap,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    names::check_file_name(&name)?;
    if !FileRole::is_scan_file(&name) {
        return Err(Error::Unprocessable(format!(
            "{name:?} is no file of scans: expected .zip, .tar, .tar.gz, .tar.zst, .obj, .ply, .npy, rig.json or .csv"
        )));
    }
    let announced = Announced::read(&headers)?;
    let mut db = app.db.acquire().await?;
    let model = body_models::find(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    drop(db);
    files::check_collects_scans(&model)?;
    let file_id = Uuid::now_v7();
    let key = store::key::body_model_input(model.id, file_id);
    let upload =
        files::Upload { file_id, owner: Owner::BodyModel(model.id), name, role: FileRole::Scans, key };
    files::receive(app, caller.project_id, upload, announced, body).await
}

/// Delete a file of a body model
///
/// Only while the model is `open` or `failed`.
#[utoipa::path(
    delete, path = "/v1/body-models/{body_model}/files/{name}", tag = "body models",
    params(("body_model" = String, Path, description = "id, name or name@version"), ("name" = String, Path,)),
    responses((status = 204)),
)]
pub(super) async fn delete_of_body_model(
    State(app): State<App>,
    Writer(caller): Writer,
    Path((which, name)): Path<(String, String)>,
) -> Result<StatusCode> {
    let mut db = app.db.acquire().await?;
    let model = body_models::find(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    drop(db);
    let owner = Owner::BodyModel(model.id);
    files::remove(app, caller.project_id, owner, name).await
}
