//! Finding what a request names, in the caller's project only: what another project has is not there.

use chrono::{DateTime, Utc};
use jobs::motion_database::MotionDatabaseFile;
use serde::Serialize;
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::{
    error::{Error, Result},
    page::Item,
};

/// Takes part in a lock or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lock {
    /// only look
    None,
    /// keep it from being deleted or changed until the transaction ends; others may do the same
    Share,
    /// nobody else until the transaction ends
    Update,
}

/// A capture session.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct Session {
    /// id
    pub id: Uuid,
    /// name given by the user
    #[schema(example = "walk, take 3")]
    pub name: String,
    /// words to find it by
    pub tags: Vec<String>,
    /// when it was made
    pub created_at: DateTime<Utc>,
}

impl Item for Session {
    fn id(&self) -> Uuid {
        self.id
    }
}

/// The session of that id in the project.
pub(super) async fn session(
    db: &mut PgConnection,
    project_id: Uuid,
    id: Uuid,
    lock: Lock,
) -> Result<Session> {
    sqlx::query_as(match lock {
        Lock::None => "SELECT id, name, tags, created_at FROM sessions WHERE id = $1 AND project_id = $2",
        Lock::Share => {
            "SELECT id, name, tags, created_at FROM sessions WHERE id = $1 AND project_id = $2 FOR SHARE"
        }
        Lock::Update => {
            "SELECT id, name, tags, created_at FROM sessions WHERE id = $1 AND project_id = $2 FOR UPDATE"
        }
    })
    .bind(id)
    .bind(project_id)
    .fetch_optional(db)
    .await?
    .ok_or_else(|| Error::not_found("session", id))
}

/// How many runs of a session go on.
pub(super) async fn active_runs_of_session(db: &mut PgConnection, session_id: Uuid) -> Result<i64> {
    Ok(sqlx::query_scalar("SELECT count(*) FROM runs WHERE session_id = $1 AND finished_at IS NULL")
        .bind(session_id)
        .fetch_one(db)
        .await?)
}

/// A motion database: one version of one name.
#[derive(Debug, Clone, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct MotionDatabase {
    /// id
    pub id: Uuid,
    /// name in the project
    #[schema(example = "walks")]
    pub name: String,
    /// version of that name, from 1
    #[schema(example = 1)]
    pub version: i32,
    /// `open` (collects files), `building`, `ready`, or `failed` (collects files again)
    #[schema(example = "ready")]
    pub state: String,
    /// the run that builds or built it
    pub build_run_id: Option<Uuid>,
    /// the version whose clips it begins with; null for one made of files alone
    #[schema(example = "walks@1")]
    pub base: Option<String>,
    /// size of the index, bytes
    pub bytes: Option<i64>,
    /// BLAKE3 of the index file, or of the list of its shards, hexadecimal
    pub blake3: Option<String>,
    /// into how many index files it is divided
    #[schema(example = 1)]
    pub num_shards: Option<i32>,
    /// poses at 60 frames per second
    pub num_poses: Option<i64>,
    /// motion clips
    pub num_clips: Option<i64>,
    /// name of its skeleton
    pub skeleton: Option<String>,
    /// when it was made
    pub created_at: DateTime<Utc>,
    /// when it became ready
    pub ready_at: Option<DateTime<Utc>>,
    /// where the index file, or the list of its shards, is in the object store
    #[serde(skip)]
    pub store_key: Option<String>,
    #[serde(skip)]
    pub base_id: Option<Uuid>,
}

impl Item for MotionDatabase {
    fn id(&self) -> Uuid {
        self.id
    }
}

impl MotionDatabase {
    /// As jobs name it.
    ///
    /// # Errors
    /// 409 with its state, if it is not ready.
    pub fn ready(&self) -> Result<MotionDatabaseFile> {
        match (&self.store_key, &self.blake3) {
            (Some(store_key), Some(blake3)) => Ok(MotionDatabaseFile {
                id: self.id,
                name: self.name.clone(),
                version: self.version,
                store_key: store_key.clone(),
                blake3: blake3.clone(),
                gplvm: None,
            }),
            _ => Err(Error::Conflict(format!(
                "motion database {}@{} is {}, expected ready{}",
                self.name,
                self.version,
                self.state,
                match self.state.as_str() {
                    "open" => ": upload files to it and build it",
                    "building" => ": wait for its build",
                    _ => ": see the error of its build",
                }
            ))),
        }
    }
}

/// The id of what `which` names in a table of versioned things: an id, `name@version`, or a name, which stands for its latest
/// version. A macro, because SQL is written out where it is checked.
macro_rules! version_id {
    ($db:expr, $table:literal, $what:literal, $project_id:expr, $which:expr, $latest:expr) => {
        match (uuid::Uuid::try_parse($which), $which.rsplit_once('@')) {
            (Ok(id), _) => Some(id),
            (Err(_), Some((name, version))) => {
                let version: i32 = version.parse().map_err(|_| Error::not_found($what, $which))?;
                sqlx::query_scalar(concat!(
                    "SELECT id FROM ",
                    $table,
                    " WHERE project_id = $1 AND name = $2 AND version = $3"
                ))
                .bind($project_id)
                .bind(name)
                .bind(version)
                .fetch_optional(&mut *$db)
                .await?
            }
            (Err(_), None) => {
                sqlx::query_scalar(concat!(
                    "SELECT id FROM ",
                    $table,
                    " WHERE project_id = $1 AND name = $2
                      ORDER BY (store_key IS NOT NULL AND $3) DESC, version DESC LIMIT 1"
                ))
                .bind($project_id)
                .bind($which)
                .bind($latest == Latest::Ready)
                .fetch_optional(&mut *$db)
                .await?
            }
        }
    };
}
pub(super) use version_id;

/// The columns of [`MotionDatabase`].
macro_rules! select_motion_databases {
    ($rest:literal) => {
        concat!(
            "SELECT d.id, d.name, d.version,
                    CASE WHEN d.store_key IS NOT NULL THEN 'ready'
                         WHEN r.id IS NULL THEN 'open'
                         WHEN r.state IN ('failed', 'cancelled') THEN 'failed'
                         ELSE 'building' END AS state,
                    d.build_run_id, b.name || '@' || b.version AS base, d.bytes, d.blake3, d.num_shards, d.num_poses,
                    d.num_clips, d.skeleton, d.created_at, d.ready_at, d.store_key, d.base_id
             FROM motion_databases d LEFT JOIN runs r ON r.id = d.build_run_id
                                     LEFT JOIN motion_databases b ON b.id = d.base_id ",
            $rest
        )
    };
}
pub(super) use select_motion_databases;

/// Which versions of a name are meant when none is named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Latest {
    /// the newest
    Any,
    /// the newest that is ready, or else the newest
    Ready,
}

/// The motion database that `which` names: an id, `name` (its latest version) or `name@version`.
pub(super) async fn motion_database(
    db: &mut PgConnection,
    project_id: Uuid,
    which: &str,
    latest: Latest,
    lock: Lock,
) -> Result<MotionDatabase> {
    let id: Option<Uuid> = version_id!(db, "motion_databases", "motion database", project_id, which, latest);
    let query = match lock {
        Lock::None => select_motion_databases!("WHERE d.id = $1 AND d.project_id = $2"),
        Lock::Share => select_motion_databases!("WHERE d.id = $1 AND d.project_id = $2 FOR SHARE OF d"),
        Lock::Update => select_motion_databases!("WHERE d.id = $1 AND d.project_id = $2 FOR UPDATE OF d"),
    };
    sqlx::query_as(query)
        .bind(id)
        .bind(project_id)
        .fetch_optional(db)
        .await?
        .ok_or_else(|| Error::not_found("motion database", which))
}
