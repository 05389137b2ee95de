//! Runs: starting, watching and cancelling them.

use chrono::{DateTime, Utc};
use serde_json::Value;
use sqlx::PgConnection;
use uuid::Uuid;

use crate::finish::{self, Remaining};
use crate::{Error, ProjectId, RunId, RunState};

/// A run to be started.
#[derive(Debug, Clone)]
pub struct NewRun<'a> {
    /// The project that it belongs to and whose share of the slots it uses.
    pub project_id: ProjectId,
    /// What it does: `sparse`, `motion-database`.
    pub kind: &'a str,
    /// The capture session that it reads, if any.
    pub session_id: Option<Uuid>,
    /// Fully resolved parameters, kept with the results.
    pub parameters: Value,
}

/// Where a run stands.
#[derive(Debug, Clone, PartialEq)]
pub struct RunStatus {
    /// The run.
    pub id: RunId,
    /// The project that it belongs to.
    pub project_id: ProjectId,
    /// What it does.
    pub kind: String,
    /// The capture session that it reads, if any.
    pub session_id: Option<Uuid>,
    /// Fully resolved parameters.
    pub parameters: Value,
    /// Where it stands.
    pub state: RunState,
    /// Mean progress of its jobs by weight, 0 to 1.
    pub progress: f64,
    /// The newest phrase of any of its jobs; empty before the first.
    pub phrase: String,
    /// Why it failed, for the user.
    pub error_message: Option<String>,
    /// Why it failed, for a developer.
    pub error_detail: Option<String>,
    /// When it was enqueued.
    pub created_at: DateTime<Utc>,
    /// When its first job was claimed.
    pub started_at: Option<DateTime<Utc>>,
    /// When it ended.
    pub finished_at: Option<DateTime<Utc>>,
}

#[derive(sqlx::FromRow)]
struct StatusRow {
    id: RunId,
    project_id: ProjectId,
    kind: String,
    session_id: Option<Uuid>,
    parameters: Value,
    state: String,
    progress: f64,
    phrase: String,
    error_message: Option<String>,
    error_detail: Option<String>,
    created_at: DateTime<Utc>,
    started_at: Option<DateTime<Utc>>,
    finished_at: Option<DateTime<Utc>>,
}

/// Adds a run. It has no jobs yet: [`enqueue`](crate::enqueue) them in the same transaction, or the run
/// waits for ever.
pub async fn enqueue_run(connection: &mut PgConnection, run: &NewRun<'_>) -> Result<RunId, Error> {
    let id = RunId(Uuid::now_v7());
    sqlx::query(include_str!("../queries/insert_run.sql"))
        .bind(id)
        .bind(run.project_id)
        .bind(run.kind)
        .bind(run.session_id)
        .bind(&run.parameters)
        .execute(connection)
        .await?;
    Ok(id)
}

/// Where the run stands; `None` if there is no such run.
pub async fn run_status(connection: &mut PgConnection, run_id: RunId) -> Result<Option<RunStatus>, Error> {
    let row: Option<StatusRow> = sqlx::query_as(include_str!("../queries/run_status.sql"))
        .bind(run_id)
        .fetch_optional(connection)
        .await?;
    row.map(|row| {
        Ok(RunStatus {
            state: row.state.parse()?,
            id: row.id,
            project_id: row.project_id,
            kind: row.kind,
            session_id: row.session_id,
            parameters: row.parameters,
            progress: row.progress,
            phrase: row.phrase,
            error_message: row.error_message,
            error_detail: row.error_detail,
            created_at: row.created_at,
            started_at: row.started_at,
            finished_at: row.finished_at,
        })
    })
    .transpose()
}

/// Cancels the run. It is cancelled when this commits: waiting jobs end at once, running ones are flagged,
/// their workers hear of it within two heartbeats and nothing that they hand in is kept.
///
/// A run that has ended stays as it is. Returns the state that the run has now. Opens a (nested)
/// transaction of its own.
///
/// # Errors
/// [`Error::NoSuchRun`].
pub async fn cancel_run(connection: &mut PgConnection, run_id: RunId) -> Result<RunState, Error> {
    let mut transaction = sqlx::Acquire::begin(connection).await?;
    let state = finish::lock_run(&mut transaction, run_id).await?;
    if state.is_finished() {
        return Ok(state);
    }
    finish::end_run(&mut transaction, run_id, Remaining::cancelled_by_user()).await?;
    transaction.commit().await?;
    Ok(RunState::Cancelled)
}
