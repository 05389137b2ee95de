//! Uploaded files, whosever they are: received, recorded, replaced and removed. The only place that knows their table.

use axum::{Json, body::Body, http::StatusCode};
use chrono::{DateTime, Utc};
use formats::FileRole;
use jobs::InputFile;
use serde::Serialize;
use sqlx::PgConnection;
use store::{Key, Stored};
use utoipa::{ToSchema, openapi};
use uuid::Uuid;

use crate::{
    App,
    error::{Error, Result},
    names,
    upload::{self, Announced, uninterrupted},
};

/// An uploaded file.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct File {
    /// name within the session, motion database or body model
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
fn role_schema() -> openapi::Object {
    words_schema(FileRole::ALL)
}

/// Those of files of sessions.
pub(crate) fn session_role_schema() -> openapi::Object {
    words_schema(FileRole::session_roles())
}

fn words_schema(roles: impl IntoIterator<Item = FileRole>) -> openapi::Object {
    openapi::ObjectBuilder::new()
        .schema_type(openapi::Type::String)
        .enum_values(Some(roles.into_iter().map(FileRole::as_str)))
        .examples([FileRole::ControlPoints.as_str()])
        .build()
}

/// Whose files they are.
pub(crate) trait Owner: Send + Sync + 'static {
    /// The table that it is a row of.
    const TABLE: &'static str;

    /// What it is.
    const NOUN: &'static str;

    /// Its id.
    fn id(&self) -> Uuid;

    /// Where a file of its is stored.
    fn key(&self, project_id: Uuid, file_id: Uuid) -> Key;

    /// Holds it until the transaction ends, and refuses if its files are fixed.
    fn lock(&self, db: &mut PgConnection, project_id: Uuid) -> impl Future<Output = Result<()>> + Send;

    /// Refuses if the file of that name can't be removed, nor replaced.
    fn check_removable(&self, db: &mut PgConnection, name: &str) -> impl Future<Output = Result<()>> + Send;
}

/// All files of an owner, by name.
pub(crate) async fn list(db: &mut PgConnection, owner_id: Uuid) -> Result<Vec<File>> {
    Ok(sqlx::query_as(
        "SELECT name, role, media_type, bytes, blake3, uploaded_at, store_key FROM files
         WHERE session_id = $1 OR motion_database_id = $1 OR body_model_id = $1 ORDER BY name COLLATE \"C\"",
    )
    .bind(owner_id)
    .fetch_all(db)
    .await?)
}

/// The same as jobs are given them.
pub(crate) async fn inputs(db: &mut PgConnection, owner_id: Uuid) -> Result<Vec<InputFile>> {
    let input = |file: File| {
        Ok(InputFile {
            name: file.name,
            role: file.role,
            store_key: file.store_key,
            bytes: u64::try_from(file.bytes).map_err(|e| Error::Internal(e.to_string()))?,
            blake3: file.blake3,
        })
    };
    list(db, owner_id).await?.into_iter().map(input).collect()
}

/// Receives a file to its end, whether or not the caller waits for it, and records it.
pub(crate) async fn receive(
    app: App,
    project_id: Uuid,
    owner: impl Owner,
    (name, role): (String, FileRole),
    announced: Announced,
    body: Body,
) -> Result<(StatusCode, Json<File>)> {
    uninterrupted(async move {
        let id = Uuid::now_v7();
        let key = owner.key(project_id, id);
        let stored = upload::receive(&app, &key, &announced, body).await?;
        let new = NewFile { id, owner: &owner, name: &name, role, stored: &stored };
        let kept = keep(&app, project_id, &new).await;
        settle(&app, &key, kept).await
    })
    .await
}

struct NewFile<'a, O> {
    id: Uuid,
    owner: &'a O,
    name: &'a str,
    role: FileRole,
    stored: &'a Stored,
}

/// Records an uploaded object as a file; gives the key of the object that it replaces.
async fn keep<O: Owner>(app: &App, project_id: Uuid, new: &NewFile<'_, O>) -> Result<(File, Option<String>)> {
    let mut tx = app.db.begin().await?;
    let replaced = take_out(&mut tx, project_id, new.owner, new.name).await?;
    let bytes = i64::try_from(new.stored.bytes).map_err(|e| Error::Internal(e.to_string()))?;
    let file = sqlx::query_as(
        "INSERT INTO files (id, project_id, session_id, motion_database_id, body_model_id, name, role, media_type, store_key,
                            bytes, blake3)
         VALUES ($1, $2, CASE $3 WHEN 'sessions' THEN $4 END, CASE $3 WHEN 'motion_databases' THEN $4 END,
                 CASE $3 WHEN 'body_models' THEN $4 END, $5, $6, $7, $8, $9, $10)
         RETURNING name, role, media_type, bytes, blake3, uploaded_at, store_key",
    )
    .bind(new.id)
    .bind(project_id)
    .bind(O::TABLE)
    .bind(new.owner.id())
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
pub(crate) async fn remove<O: Owner>(
    app: App,
    project_id: Uuid,
    owner: O,
    name: String,
) -> Result<StatusCode> {
    uninterrupted(async move {
        let mut tx = app.db.begin().await?;
        let removed = take_out(&mut tx, project_id, &owner, &name).await?;
        tx.commit().await?;
        let key = removed.ok_or_else(|| Error::not_found_in(O::NOUN, "file", name))?;
        app.store.delete(&key.parse()?).await?;
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}

/// Locks the owner and takes the file's row out, if its owner allows; gives the key of its object.
async fn take_out(
    db: &mut PgConnection,
    project_id: Uuid,
    owner: &impl Owner,
    name: &str,
) -> Result<Option<String>> {
    owner.lock(db, project_id).await?;
    let removed: Option<String> = sqlx::query_scalar(
        "DELETE FROM files WHERE (session_id = $1 OR motion_database_id = $1 OR body_model_id = $1) AND name = $2
         RETURNING store_key",
    )
    .bind(owner.id())
    .bind(name)
    .fetch_optional(&mut *db)
    .await?;
    if removed.is_some() {
        owner.check_removable(db, name).await?;
    }
    Ok(removed)
}
