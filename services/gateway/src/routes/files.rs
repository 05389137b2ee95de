//! Uploaded files, whosever they are: received, recorded, replaced and removed.

use axum::{Json, body::Body, http::StatusCode};
use chrono::{DateTime, Utc};
use formats::FileRole;
use serde::Serialize;
use sqlx::PgConnection;
use store::{Key, Stored};
use utoipa::{ToSchema, openapi};
use uuid::Uuid;

use super::{
    body_models::{self, BodyModel},
    lookup::{self, Latest, Lock, MotionDatabase},
};
use crate::{
    App,
    error::{Error, Result},
    names,
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
    #[schema(schema_with = role_schema)]
    #[sqlx(try_from = "String")]
    pub role: FileRole,
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

/// The words of [`FileRole`].
pub(super) fn role_schema() -> openapi::Object {
    let words = FileRole::ALL.map(FileRole::as_str);
    openapi::ObjectBuilder::new()
        .schema_type(openapi::Type::String)
        .enum_values(Some(words))
        .examples([FileRole::ControlPoints.as_str()])
        .build()
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

/// A file that is to come in.
pub(super) struct Upload {
    pub file_id: Uuid,
    pub owner: Owner,
    pub name: String,
    pub role: FileRole,
    pub key: Key,
}

/// Receives a file to its end, whether or not the caller waits for it, and records it.
pub(super) async fn receive(
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

/// Whose a file is.
pub(super) enum Owner {
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

/// Removes a file, whether or not the caller waits for it.
pub(super) async fn remove(app: App, project_id: Uuid, owner: Owner, name: String) -> Result<StatusCode> {
    uninterrupted(async move { take_away(&app, project_id, &owner, &name).await }).await
}

async fn take_away(app: &App, project_id: Uuid, owner: &Owner, name: &str) -> Result<StatusCode> {
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

/// Refuses to change the files of a database that is built from them.
pub(super) fn check_collects(database: &MotionDatabase) -> Result<()> {
    match database.state.as_str() {
        "open" | "failed" => Ok(()),
        state => Err(Error::Conflict(format!(
            "motion database {}@{} is {state}: its files are fixed; make a new version",
            database.name, database.version
        ))),
    }
}

/// The same for a body model.
pub(super) fn check_collects_scans(model: &BodyModel) -> Result<()> {
    match model.state.as_str() {
        "open" | "failed" => Ok(()),
        state => Err(Error::Conflict(format!(
            "body model {}@{} is {state}: its files are fixed; make a new version",
            model.name, model.version
        ))),
    }
}
