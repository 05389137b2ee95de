//! Capture sessions in the database, found in the caller's project only: other projects' items are not found.

use chrono::{DateTime, Utc};
use queue::RunId;
use serde::Serialize;
use sqlx::PgConnection;
use store::Key;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::{
    error::{Error, Result},
    files::Owner,
    lock::Lock,
    page::Item,
};

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
pub(crate) async fn find(db: &mut PgConnection, project_id: Uuid, id: Uuid, lock: Lock) -> Result<Session> {
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

/// The sessions of project `$1` with an id below `$2`, newest first, at most `$3`.
pub(crate) const SELECT_BY_PROJECT: &str = "SELECT id, name, tags, created_at FROM sessions
     WHERE project_id = $1 AND id < $2 ORDER BY id DESC LIMIT $3";

/// Adds a session.
pub(crate) async fn insert(
    db: &mut PgConnection,
    project_id: Uuid,
    name: &str,
    tags: &[String],
) -> Result<Session> {
    let session = sqlx::query_as(
        "INSERT INTO sessions (id, project_id, name, tags) VALUES ($1, $2, $3, $4)
         RETURNING id, name, tags, created_at",
    );
    Ok(session.bind(Uuid::now_v7()).bind(project_id).bind(name).bind(tags).fetch_one(db).await?)
}

/// Deletes a session with its files and its runs, which are given: what they left in the object store is of no use now.
pub(crate) async fn delete(db: &mut PgConnection, id: Uuid) -> Result<Vec<RunId>> {
    let runs =
        sqlx::query_scalar("SELECT id FROM runs WHERE session_id = $1").bind(id).fetch_all(&mut *db).await?;
    sqlx::query("DELETE FROM sessions WHERE id = $1").bind(id).execute(db).await?;
    Ok(runs)
}

/// How many runs of a session are under way.
pub(crate) async fn count_active_runs(db: &mut PgConnection, session_id: Uuid) -> Result<i64> {
    Ok(sqlx::query_scalar("SELECT count(*) FROM runs WHERE session_id = $1 AND finished_at IS NULL")
        .bind(session_id)
        .fetch_one(db)
        .await?)
}

/// A session as the owner of files: they may always be added to, but not taken from under a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SessionFiles(pub Uuid);

impl Owner for SessionFiles {
    const TABLE: &'static str = "sessions";
    const NOUN: &'static str = "session";

    fn id(&self) -> Uuid {
        self.0
    }

    fn key(&self, project_id: Uuid, file_id: Uuid) -> Key {
        store::key::file(project_id, self.0, file_id)
    }

    async fn lock(&self, db: &mut PgConnection, project_id: Uuid) -> Result<()> {
        find(db, project_id, self.0, Lock::Update).await.map(drop)
    }

    async fn check_removable(&self, db: &mut PgConnection, name: &str) -> Result<()> {
        if count_active_runs(db, self.0).await? > 0 {
            return Err(Error::Conflict(format!(
                "a run of this session is under way and reads {name:?}; cancel it first"
            )));
        }
        Ok(())
    }
}
