//! `motion_databases`, and the models that were trained on them.

use chrono::{DateTime, Utc};
use jobs::motion_database::{Clip, Contents, MotionDatabaseFile, TrainGplvm};
use queue::JobError;
use sqlx::{PgConnection, PgPool, types::Json};
use store::Stored;
use uuid::Uuid;

use super::{
    Built,
    sql::{select, set_ready},
};

/// A motion database that is ready.
#[derive(Debug, Clone, sqlx::FromRow)]
pub struct ReadyDatabase {
    /// Its id.
    pub id: Uuid,
    /// Name in its project.
    pub name: String,
    /// Version of that name, from 1.
    pub version: i32,
    /// Where its index file, or the list of them, is in the object store.
    pub store_key: String,
    /// BLAKE3 of that, hex.
    pub blake3: String,
    /// Size of all index files, bytes.
    pub bytes: i64,
    /// Poses at 60 a second.
    pub num_poses: i64,
    /// Clips.
    pub num_clips: i64,
    /// Index files; none for one that was built when all had one.
    pub num_shards: Option<i32>,
    /// When it was built.
    pub ready_at: DateTime<Utc>,
}

/// The statement that selects [`ReadyDatabase`]s.
macro_rules! select_ready {
    ($rest:literal) => {
        select!("motion_databases", ", bytes, num_poses, num_clips, num_shards, ready_at", $rest)
    };
}

/// The database of that id, if it is ready.
///
/// # Errors
/// If PostgreSQL fails.
pub async fn find(pool: &PgPool, id: Uuid) -> sqlx::Result<Option<ReadyDatabase>> {
    sqlx::query_as(select_ready!("id = $1")).bind(id).fetch_optional(pool).await
}

/// Whether there is one of that id, ready or not.
///
/// # Errors
/// If PostgreSQL fails.
pub async fn exists(pool: &PgPool, id: Uuid) -> sqlx::Result<bool> {
    let sql = "SELECT EXISTS (SELECT FROM motion_databases WHERE id = $1)";
    sqlx::query_scalar(sql).bind(id).fetch_one(pool).await
}

/// Those of a project that are ready, newest first: at most `count`, after the one with id `after`.
///
/// # Errors
/// If PostgreSQL fails.
pub async fn list(
    pool: &PgPool,
    project: Uuid,
    after: Option<Uuid>,
    count: i64,
) -> sqlx::Result<Vec<ReadyDatabase>> {
    // Ids are in the order of creation.
    let sql = select_ready!("project_id = $1 AND ($2 IS NULL OR id < $2) ORDER BY id DESC LIMIT $3");
    sqlx::query_as(sql).bind(project).bind(after).bind(count).fetch_all(pool).await
}

impl From<ReadyDatabase> for MotionDatabaseFile {
    /// Without the models that were trained on it.
    fn from(row: ReadyDatabase) -> Self {
        let ReadyDatabase { id, name, version, store_key, blake3, .. } = row;
        Self { id, name, version, store_key, blake3, gplvm: None }
    }
}

/// A motion database that was just built.
#[derive(Debug, Clone)]
pub struct BuiltDatabase {
    /// What all versions have.
    pub built: Built<Contents>,
    /// Poses at 60 a second.
    pub num_poses: usize,
    /// Index files.
    pub num_shards: usize,
    /// Name of its skeleton.
    pub skeleton: String,
    /// Its clips, in its order.
    pub clips: Vec<Clip>,
}

impl BuiltDatabase {
    /// Makes its row ready. Belongs into the transaction that completes the job.
    ///
    /// # Errors
    /// Gives up if no row waits for it: it was deleted, or another run built it.
    pub async fn set_ready(&self, connection: &mut PgConnection) -> Result<(), JobError> {
        let sql = set_ready!(
            "motion_databases",
            "num_poses = $6, num_clips = $7, num_shards = $8, skeleton = $9, clips = $10"
        );
        let number = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        let num_shards = i32::try_from(self.num_shards).unwrap_or(i32::MAX);
        let own = self.built.set_ready(connection, "motion database", sql, |query| {
            query
                .bind(number(self.num_poses))
                .bind(number(self.clips.len()))
                .bind(num_shards)
                .bind(&self.skeleton)
                .bind(Json(&self.clips))
        });
        own.await
    }
}

/// Records the GPLVM that `run` trained, in place of an earlier one of that database. Belongs into the transaction that
/// completes the job.
///
/// # Errors
/// Gives up if the database was deleted meanwhile.
pub async fn set_gplvm(
    connection: &mut PgConnection,
    run: Uuid,
    request: &TrainGplvm,
    stored: &Stored,
) -> Result<(), JobError> {
    let sql = "INSERT INTO motion_database_models
                   (motion_database_id, method, train_run_id, parameters, store_key, bytes, blake3)
               SELECT id, 'gplvm', $2, $3, $4, $5, $6 FROM motion_databases WHERE id = $1
               ON CONFLICT (motion_database_id, method) DO UPDATE
               SET train_run_id = excluded.train_run_id, parameters = excluded.parameters,
                   store_key = excluded.store_key, bytes = excluded.bytes, blake3 = excluded.blake3,
                   trained_at = clock_timestamp()";
    let recorded = sqlx::query(sql)
        .bind(request.motion_database.id)
        .bind(run)
        .bind(Json(&request.parameters))
        .bind(stored.key.as_str())
        .bind(i64::try_from(stored.bytes).unwrap_or(i64::MAX))
        .bind(&stored.blake3)
        .execute(connection)
        .await?
        .rows_affected();
    if recorded == 1 {
        return Ok(());
    }
    Err(JobError::give_up("the motion database was deleted meanwhile", request.motion_database.id))
}
