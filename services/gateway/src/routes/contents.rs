//! What motion databases hold, and who uses them.

use std::collections::HashSet;

use chrono::{DateTime, Utc};
use serde::{Deserialize, Serialize};
use sqlx::{PgConnection, types::Json};
use utoipa::ToSchema;
use uuid::Uuid;

use super::lookup::MotionDatabase;
use crate::error::{Error, Result};

/// Most users of a database that a refusal names.
const NAMED: usize = 5;

/// A motion database, and what is in it.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MotionDatabaseDetails {
    #[serde(flatten)]
    database: MotionDatabase,
    /// clips of `base` that were left out
    without: Vec<String>,
    /// null until it is ready
    contents: Option<Contents>,
    /// how long it took to build it, seconds
    build_seconds: Option<f64>,
    /// models that were trained on it
    models: Vec<Model>,
    /// runs under way, and versions not built yet, that need it; while there are any, it can't be deleted
    used_by: Vec<User>,
}

/// What is in a motion database.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct Contents {
    /// frames per second
    #[schema(example = 60.0)]
    frame_rate_hz: f64,
    /// joints of the skeleton
    num_joints: usize,
    /// degrees of freedom of the skeleton
    num_dofs: usize,
    /// by action, as `index.csv` names it
    actions: Vec<Share>,
    /// by subject
    subjects: Vec<Share>,
    /// what was made from the recordings
    augment: Augment,
    /// what was sloppy about the files
    warnings: Vec<String>,
}

/// How much of a motion database one action or subject is.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct Share {
    /// empty where it is not known
    #[schema(example = "walk")]
    name: String,
    /// clips, those made from others included
    num_clips: u64,
    /// poses at 60 frames per second
    num_poses: u64,
}

/// Motion to be made from the recordings of a motion database, so that it holds more of what people do.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Augment {
    /// every clip with left and right exchanged
    mirror: bool,
    /// every clip at these speeds
    #[schema(example = json!([0.8, 1.25]))]
    warps: Vec<f64>,
}

impl From<Augment> for jobs::motion_database::Augment {
    fn from(Augment { mirror, warps }: Augment) -> Self {
        Self { mirror, warps }
    }
}

impl From<jobs::motion_database::Augment> for Augment {
    fn from(jobs::motion_database::Augment { mirror, warps }: jobs::motion_database::Augment) -> Self {
        Self { mirror, warps }
    }
}

/// A model that was trained on a motion database.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct Model {
    /// the method that uses it
    #[schema(example = "gplvm")]
    method: String,
    /// the run that trained it
    run_id: Option<Uuid>,
    /// size, bytes
    bytes: i64,
    /// BLAKE3, hexadecimal
    blake3: String,
    /// when it was trained
    trained_at: DateTime<Utc>,
}

/// Who needs a motion database.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct User {
    /// a run under way
    run_id: Option<Uuid>,
    /// the session that it reconstructs
    session_id: Option<Uuid>,
    /// name of that session
    session: Option<String>,
    /// version that is to be made from it
    motion_database: Option<String>,
}

impl std::fmt::Display for User {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.run_id, &self.session, &self.motion_database) {
            (Some(run), Some(session), _) => write!(f, "run {run} of session {session:?}"),
            (Some(run), None, _) => write!(f, "run {run}"),
            (None, _, Some(version)) => write!(f, "{version}, which is to be made from it"),
            (None, _, None) => f.write_str("another version"),
        }
    }
}

/// A clip of a motion database.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct Clip {
    /// name; of one made from another `16_15~mirror`, `16_15~x0.8`
    #[schema(example = "16_15")]
    name: String,
    /// who moved
    #[schema(example = "16")]
    subject: String,
    /// what they did; empty if that is not known
    #[schema(example = "walk")]
    action: String,
    /// poses at 60 frames per second
    num_poses: u64,
}

/// All that there is to say of a motion database.
pub(super) async fn details(
    db: &mut PgConnection,
    database: MotionDatabase,
) -> Result<MotionDatabaseDetails> {
    let (without, contents, build_seconds): (Vec<String>, Option<Json<Contents>>, Option<f64>) =
        sqlx::query_as(
            "SELECT d.without, d.contents, extract(epoch FROM d.ready_at - r.started_at)::double precision
         FROM motion_databases d LEFT JOIN runs r ON r.id = d.build_run_id WHERE d.id = $1",
        )
        .bind(database.id)
        .fetch_one(&mut *db)
        .await?;
    let models = sqlx::query_as(
        "SELECT method, train_run_id AS run_id, bytes, blake3, trained_at FROM motion_database_models
         WHERE motion_database_id = $1 ORDER BY method",
    )
    .bind(database.id)
    .fetch_all(&mut *db)
    .await?;
    let used_by = users(db, &database).await?;
    let contents = contents.map(|Json(contents)| contents);
    Ok(MotionDatabaseDetails { database, without, contents, build_seconds, models, used_by })
}

/// The GPLVM that a run with that method uses.
///
/// # Errors
/// 409, if none was trained.
pub(super) async fn gplvm(db: &mut PgConnection, database: &MotionDatabase) -> Result<jobs::Object> {
    let found: Option<(String, String)> = sqlx::query_as(
        "SELECT store_key, blake3 FROM motion_database_models WHERE motion_database_id = $1 AND method = 'gplvm'",
    )
    .bind(database.id)
    .fetch_optional(db)
    .await?;
    let (store_key, blake3) = found.ok_or_else(|| {
        Error::Conflict(format!(
            "no gplvm was trained on motion database {0}@{1}; POST /v1/motion-databases/{0}@{1}/train first, or \
             `marey db train {0}@{1}`",
            database.name, database.version
        ))
    })?;
    Ok(jobs::Object { store_key, blake3 })
}

/// The augmentation of a database that is ready.
pub(super) async fn augment(db: &mut PgConnection, id: Uuid) -> Result<Augment> {
    let contents: Option<Json<Contents>> =
        sqlx::query_scalar("SELECT contents FROM motion_databases WHERE id = $1")
            .bind(id)
            .fetch_one(db)
            .await?;
    Ok(contents.map(|Json(contents)| contents.augment).unwrap_or_default())
}

/// The clips of a database, in its order; none until it is ready.
pub(super) async fn clips(db: &mut PgConnection, id: Uuid) -> Result<Vec<Clip>> {
    let clips: Option<Json<Vec<Clip>>> =
        sqlx::query_scalar("SELECT clips FROM motion_databases WHERE id = $1").bind(id).fetch_one(db).await?;
    Ok(clips.map(|Json(clips)| clips).unwrap_or_default())
}

/// Refuses names of clips, or of the trials that these were made from, that are not in the database.
pub(super) async fn check_clips(
    db: &mut PgConnection,
    base: &MotionDatabase,
    names: &[String],
) -> Result<()> {
    if names.is_empty() {
        return Ok(());
    }
    let clips = clips(db, base.id).await?;
    let known: HashSet<&str> =
        clips.iter().flat_map(|clip| [clip.name.as_str(), motion_db::trial_name(&clip.name)]).collect();
    match names.iter().find(|name| !known.contains(name.as_str())) {
        None => Ok(()),
        Some(name) => Err(Error::Unprocessable(format!(
            "without has {name:?}, which is no clip of motion database {}@{}",
            base.name, base.version
        ))),
    }
}

/// Who needs a database now.
async fn users(db: &mut PgConnection, database: &MotionDatabase) -> Result<Vec<User>> {
    Ok(sqlx::query_as(
        "SELECT r.id AS run_id, r.session_id, s.name AS session, NULL AS motion_database
         FROM runs r LEFT JOIN sessions s ON s.id = r.session_id
         WHERE (r.motion_database_id = $1 OR r.id = $2) AND r.finished_at IS NULL
         UNION ALL
         SELECT NULL, NULL, NULL, name || '@' || version FROM motion_databases
         WHERE base_id = $1 AND store_key IS NULL
         ORDER BY run_id, motion_database",
    )
    .bind(database.id)
    .bind(database.build_run_id)
    .fetch_all(db)
    .await?)
}

/// Refuses to go on while somebody needs a database.
pub(super) async fn check_unused(db: &mut PgConnection, database: &MotionDatabase) -> Result<()> {
    let users = users(db, database).await?;
    if users.is_empty() {
        return Ok(());
    }
    let mut named: Vec<String> = users.iter().take(NAMED).map(ToString::to_string).collect();
    if users.len() > NAMED {
        named.push(format!("{} more", users.len() - NAMED));
    }
    Err(Error::Conflict(format!(
        "motion database {}@{} is in use by {}; cancel or delete that first",
        database.name,
        database.version,
        named.join(", ")
    )))
}
