//! The rows of `motion_databases` that are ready.

use crate::Error;
use chrono::{DateTime, Utc};
use sqlx::PgPool;
use uuid::Uuid;

/// A motion database that can be asked.
#[derive(Debug, Clone, sqlx::FromRow)]
pub(crate) struct Row {
    pub id: Uuid,
    pub name: String,
    pub version: i32,
    pub store_key: String,
    pub bytes: i64,
    pub blake3: String,
    pub num_poses: i64,
    pub num_clips: i64,
    pub num_shards: Option<i32>,
    pub ready_at: DateTime<Utc>,
}

/// Databases of a project, newest first, at most `count`, after the one with id `after`.
pub(crate) async fn list(
    pool: &PgPool,
    project: Uuid,
    after: Option<Uuid>,
    count: i64,
) -> Result<Vec<Row>, Error> {
    // Ids are in the order of creation.
    let sql = "SELECT id, name, version, store_key, bytes, blake3, num_poses, num_clips, num_shards, ready_at
               FROM motion_databases
               WHERE project_id = $1 AND store_key IS NOT NULL AND ($2 IS NULL OR id < $2)
               ORDER BY id DESC LIMIT $3";
    Ok(sqlx::query_as(sql).bind(project).bind(after).bind(count).fetch_all(pool).await?)
}

/// One database.
pub(crate) async fn find(pool: &PgPool, id: Uuid) -> Result<Row, Error> {
    let sql = "SELECT id, name, version, store_key, bytes, blake3, num_poses, num_clips, num_shards, ready_at
               FROM motion_databases WHERE id = $1 AND store_key IS NOT NULL";
    match sqlx::query_as(sql).bind(id).fetch_optional(pool).await? {
        Some(row) => Ok(row),
        None if exists(pool, id).await? => Err(Error::NotReady(id)),
        None => Err(Error::NoSuchDatabase(id)),
    }
}

async fn exists(pool: &PgPool, id: Uuid) -> Result<bool, Error> {
    Ok(sqlx::query_scalar("SELECT EXISTS (SELECT FROM motion_databases WHERE id = $1)")
        .bind(id)
        .fetch_one(pool)
        .await?)
}
