use axum::{
    Json,
    body::Body,
    extract::State,
    http::{HeaderMap, StatusCode},
    response::Response,
};
use chrono::{DateTime, Utc};
use serde::{Deserialize, Serialize};
use sqlx::PgConnection;
use store::{Key, Stored};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::{
    body_models::{self, BodyModel},
    download::{self, Object},
    lookup::{self, Latest, Lock, MotionDatabase},
};
use crate::{
    App,
    access::{Reader, Writer},
    error::{Error, Result},
    extract::{Path, Query},
    names::{self, FileRole},
    upload::{self, Announced, uninterrupted},
};

/// An uploaded file.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct File {
    /// name within the session or motion database
    #[schema(example = "points.csv")]
    pub name: String,
    /// `skeleton`, `control-points`, `ground-truth`, `calibration`, `video`, `images`, `masks` or `plate`; `motion` or
    /// `scans` where databases and body models are built from it
    #[schema(example = "control-points")]
    pub role: String,
    /// media type by which it is given back
    pub media_type: String,
    /// size, bytes
    pub bytes: i64,
    /// BLAKE3 of the content, hexadecimal
    pub blake3: String,
    /// when it was uploaded
    pub uploaded_at: DateTime<Utc>,
    #[serde(skip)]
    pub store_key: String,
}

/// What the file is for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct PutQuery {
    /// guessed from the name when left out: `.asf` skeleton; `.csv`, `.trc`, `.c3d` control points; `.amc`, `.bvh`
    /// ground truth; `.toml`, `.json`, `.yml`, `.xml`, `.qca.txt` calibration; `.mp4`, `.mov`, `.avi`, `.mkv`, `.webm` video;
    /// `.png`, `.jpg` plate; archives masks, or images or plates if their name says so
    role: Option<FileRole>,
}

/// All files of a session or of a motion database, by name.
pub(super) async fn of_owner(db: &mut PgConnection, owner: Uuid) -> Result<Vec<File>> {
    Ok(sqlx::query_as(
        "SELECT name, role, media_type, bytes, blake3, uploaded_at, store_key FROM files
         WHERE session_id = $1 OR motion_database_id = $1 OR body_model_id = $1 ORDER BY name COLLATE \"C\"",
    )
    .bind(owner)
    .fetch_all(db)
    .await?)
}

/// List the files of a session
#[utoipa::path(
    get, path = "/v1/sessions/{session_id}/files", tag = "files",
    params(("session_id" = Uuid, Path,)), responses((status = 200, body = Vec<File>)),
)]
pub(super) async fn list_of_session(
    State(app): State<App>,
    Reader(caller): Reader,
    Path(session_id): Path<Uuid>,
) -> Result<Json<Vec<File>>> {
    let mut db = app.db.acquire().await?;
    lookup::session(&mut db, caller.project_id, session_id, Lock::None).await?;
    Ok(Json(of_owner(&mut db, session_id).await?))
}

/// Upload a file to a session
///
/// The body is the file's content. A `Content-Digest: sha-256=:<base64>:` header (RFC 9530) is checked; a file that
/// is too large, has another checksum or breaks off is not kept. Another file of the same name is replaced (200), unless a
/// run of the session goes on (409).
#[utoipa::path(
    put, path = "/v1/sessions/{session_id}/files/{name}", tag = "files",
    params(
        ("session_id" = Uuid, Path,), ("name" = String, Path, example = "points.csv"), PutQuery,
        ("Content-Digest" = Option<String>, Header, description = "sha-256=:<base64>:"),
    ),
    request_body(content = String, content_type = "application/octet-stream"),
    responses((status = 201, body = File), (status = 200, body = File, description = "replaced")),
)]
pub(super) async fn put_in_session(
    State(app): State<App>,
    Writer(caller): Writer,
    Path((session_id, name)): Path<(Uuid, String)>,
    Query(query): Query<PutQuery>,
    headers: HeaderMap,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    names::check_file_name(&name)?;
    let role = query.role.or_else(|| FileRole::of_session_file(&name)).ok_or_else(|| {
        Error::Unprocessable(format!("the role of {name:?} can't be told from its name; say ?role="))
    })?;
    if !role.fits_session_file(&name) {
        return Err(Error::Unprocessable(format!(
            "{name:?} can't have role {}: expected .csv, .trc or .c3d for control-points, .asf or .bvh for skeleton, \
             .amc or .bvh for ground-truth, .toml, .json, .yml, .xml or .qca.txt for calibration, .mp4, .mov, .avi, .mkv or \
             .webm for video, an archive for images and masks, a .png, a .jpg or an archive for plate",
            role.as_str()
        )));
    }
    let announced = Announced::read(&headers)?;
    let mut db = app.db.acquire().await?;
    lookup::session(&mut db, caller.project_id, session_id, Lock::None).await?;
    drop(db);
    let file_id = Uuid::now_v7();
    let key = store::key::file(caller.project_id, session_id, file_id);
    let upload = Upload { file_id, owner: Owner::Session(session_id), name, role, key };
    receive(app, caller.project_id, upload, announced, body).await
}

/// Download a file of a session
///
/// `ETag` is the file's BLAKE3; a single `Range` is honoured.
#[utoipa::path(
    get, path = "/v1/sessions/{session_id}/files/{name}", tag = "files",
    params(("session_id" = Uuid, Path,), ("name" = String, Path,)),
    responses((status = 200, content_type = "application/octet-stream"), (status = 206), (status = 304)),
)]
pub(super) async fn get_of_session(
    State(app): State<App>,
    Reader(caller): Reader,
    Path((session_id, name)): Path<(Uuid, String)>,
    headers: HeaderMap,
) -> Result<Response> {
    let mut db = app.db.acquire().await?;
    lookup::session(&mut db, caller.project_id, session_id, Lock::None).await?;
    let files = of_owner(&mut db, session_id).await?;
    drop(db);
    let file = files.iter().find(|f| f.name == name).ok_or_else(|| Error::not_found("file", &name))?;
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
/// Refused (409) while a run of the session goes on.
#[utoipa::path(
    delete, path = "/v1/sessions/{session_id}/files/{name}", tag = "files",
    params(("session_id" = Uuid, Path,), ("name" = String, Path,)), responses((status = 204)),
)]
pub(super) async fn delete_of_session(
    State(app): State<App>,
    Writer(caller): Writer,
    Path((session_id, name)): Path<(Uuid, String)>,
) -> Result<StatusCode> {
    uninterrupted(async move { remove(&app, caller.project_id, &Owner::Session(session_id), &name).await })
        .await
}

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
    Ok(Json(of_owner(&mut db, database.id).await?))
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
    check_collects(&database)?;
    let file_id = Uuid::now_v7();
    let key = store::key::motion_database_input(database.id, file_id);
    let upload =
        Upload { file_id, owner: Owner::MotionDatabase(database.id), name, role: FileRole::Motion, key };
    receive(app, caller.project_id, upload, announced, body).await
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
    uninterrupted(async move { remove(&app, caller.project_id, &owner, &name).await }).await
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
    Ok(Json(of_owner(&mut db, model.id).await?))
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
    check_collects_scans(&model)?;
    let file_id = Uuid::now_v7();
    let key = store::key::body_model_input(model.id, file_id);
    let upload = Upload { file_id, owner: Owner::BodyModel(model.id), name, role: FileRole::Scans, key };
    receive(app, caller.project_id, upload, announced, body).await
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
    uninterrupted(async move { remove(&app, caller.project_id, &owner, &name).await }).await
}

/// A file that is to come in.
struct Upload {
    file_id: Uuid,
    owner: Owner,
    name: String,
    role: FileRole,
    key: Key,
}

/// Receives a file to its end, whether or not the caller waits for it, and records it.
async fn receive(
    app: App,
    project_id: Uuid,
    upload: Upload,
    announced: Announced,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    uninterrupted(async move {
        let Upload { file_id, owner, name, role, key } = upload;
        let stored = upload::receive(&app, &key, &announced, body).await?;
        let new = NewFile { id: file_id, owner, name: &name, role, stored: &stored };
        let kept = keep(&app, project_id, &new).await;
        settle(&app, &key, kept).await
    })
    .await
}

enum Owner {
    Session(Uuid),
    MotionDatabase(Uuid),
    BodyModel(Uuid),
}

struct NewFile<'a> {
    id: Uuid,
    owner: Owner,
    name: &'a str,
    role: FileRole,
    stored: &'a Stored,
}

/// Records an uploaded object as a file; gives the key of the object that it replaces.
async fn keep(app: &App, project_id: Uuid, new: &NewFile<'_>) -> Result<(File, Option<String>)> {
    let mut tx = app.db.begin().await?;
    let replaced = take_out(&mut tx, project_id, &new.owner, new.name).await?;
    let (session_id, motion_database_id, body_model_id) = match new.owner {
        Owner::Session(id) => (Some(id), None, None),
        Owner::MotionDatabase(id) => (None, Some(id), None),
        Owner::BodyModel(id) => (None, None, Some(id)),
    };
    let bytes = i64::try_from(new.stored.bytes).map_err(|e| Error::Internal(e.to_string()))?;
    let file = sqlx::query_as(
        "INSERT INTO files (id, project_id, session_id, motion_database_id, body_model_id, name, role, media_type, store_key,
                            bytes, blake3)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11)
         RETURNING name, role, media_type, bytes, blake3, uploaded_at, store_key",
    )
    .bind(new.id)
    .bind(project_id)
    .bind(session_id)
    .bind(motion_database_id)
    .bind(body_model_id)
    .bind(new.name)
    .bind(new.role.as_str())
    .bind(names::media_type(new.name))
    .bind(new.stored.key.as_str())
    .bind(bytes)
    .bind(&new.stored.blake3)
    .fetch_one(&mut *tx)
    .await?;
    tx.commit().await?;
    Ok((file, replaced))
}

/// Removes the object that is of no use now: the new one if it was not kept, else the one that it replaced.
async fn settle(
    app: &App,
    key: &Key,
    kept: Result<(File, Option<String>)>,
) -> Result<(StatusCode, Json<File>)> {
    match kept {
        Ok((file, Some(replaced))) => {
            app.store.delete(&replaced.parse()?).await?;
            Ok((StatusCode::OK, Json(file)))
        }
        Ok((file, None)) => Ok((StatusCode::CREATED, Json(file))),
        Err(error) => {
            app.store.delete(key).await?;
            Err(error)
        }
    }
}

async fn remove(app: &App, project_id: Uuid, owner: &Owner, name: &str) -> Result<StatusCode> {
    let mut tx = app.db.begin().await?;
    let removed = take_out(&mut tx, project_id, owner, name).await?;
    tx.commit().await?;
    let key = removed.ok_or_else(|| Error::not_found("file", name))?;
    app.store.delete(&key.parse()?).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Locks the owner and takes the file's row out, if its owner's state allows; gives the key of its object.
async fn take_out(
    db: &mut PgConnection,
    project_id: Uuid,
    owner: &Owner,
    name: &str,
) -> Result<Option<String>> {
    let id = match owner {
        Owner::Session(id) => {
            lookup::session(db, project_id, *id, Lock::Update).await?;
            *id
        }
        Owner::MotionDatabase(id) => {
            let database =
                lookup::motion_database(db, project_id, &id.to_string(), Latest::Any, Lock::Update).await?;
            check_collects(&database)?;
            *id
        }
        Owner::BodyModel(id) => {
            let model = body_models::find(db, project_id, &id.to_string(), Latest::Any, Lock::Update).await?;
            check_collects_scans(&model)?;
            *id
        }
    };
    let removed: Option<String> = sqlx::query_scalar(
        "DELETE FROM files WHERE (session_id = $1 OR motion_database_id = $1 OR body_model_id = $1) AND name = $2
         RETURNING store_key",
    )
    .bind(id)
    .bind(name)
    .fetch_optional(&mut *db)
    .await?;
    if let (Owner::Session(id), Some(_)) = (owner, &removed)
        && lookup::active_runs_of_session(db, *id).await? > 0
    {
        return Err(Error::Conflict(format!(
            "a run of this session goes on and reads {name:?}; cancel it first"
        )));
    }
    Ok(removed)
}

fn check_collects(database: &MotionDatabase) -> Result<()> {
    match database.state.as_str() {
        "open" | "failed" => Ok(()),
        state => Err(Error::Conflict(format!(
            "motion database {}@{} is {state}: its files are fixed; make a new version",
            database.name, database.version
        ))),
    }
}

fn check_collects_scans(model: &BodyModel) -> Result<()> {
    match model.state.as_str() {
        "open" | "failed" => Ok(()),
        state => Err(Error::Conflict(format!(
            "body model {}@{} is {state}: its files are fixed; make a new version",
            model.name, model.version
        ))),
    }
}
