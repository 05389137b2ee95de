use chrono::{DateTime, Utc};
use serde::Serialize;
use serde_json::Value;
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::{
    error::{Error, Result},
    page::Item,
};

/// A run: what was asked for and how far it is.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct Run {
    /// id
    pub id: Uuid,
    /// `sparse`, `multi-view` or `inverse-kinematics` (of a session); `motion-database` or `body-model` (a build), or
    /// `training` (of a motion database)
    #[schema(example = "sparse")]
    pub kind: String,
    /// `queued`, `running`, `succeeded`, `failed` or `cancelled`
    #[schema(example = "running")]
    pub state: String,
    /// 0 to 1
    #[schema(example = 0.4)]
    pub progress: f64,
    /// what is being done, in words
    #[schema(example = "reconstructing frames 600 to 1200")]
    pub phrase: String,
    /// why it failed; null unless `failed`
    pub error: Option<String>,
    /// the session that it reconstructs
    pub session_id: Option<Uuid>,
    /// the motion database that it uses
    pub motion_database_id: Option<Uuid>,
    /// the body model that it uses; null for the shipped one
    pub body_model_id: Option<Uuid>,
    /// everything that determines the result, resolved: files, points, database, parameters of the method
    pub parameters: Value,
    /// when it was asked for
    pub created_at: DateTime<Utc>,
    /// when its first job was begun
    pub started_at: Option<DateTime<Utc>>,
    /// when it ended
    pub finished_at: Option<DateTime<Utc>>,
}

impl Item for Run {
    fn id(&self) -> Uuid {
        self.id
    }
}

/// A run and its jobs.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunWithJobs {
    #[serde(flatten)]
    run: Run,
    /// its jobs by kind and state
    jobs: Vec<JobSummary>,
}

/// Jobs of one kind in one state.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct JobSummary {
    /// kind of job
    #[schema(example = "reconstruct-chunk")]
    kind: String,
    /// `blocked`, `available`, `running`, `succeeded`, `failed` or `cancelled`
    #[schema(example = "succeeded")]
    state: String,
    /// how many
    count: i64,
    /// attempts that they took together
    attempts: i64,
    /// the workers that had them last
    workers: Vec<String>,
}

/// The columns of [`Run`]. A run's position in lists is its id: time-ordered.
macro_rules! select_runs {
    ($rest:literal) => {
        concat!(
            "SELECT id, kind, state, progress, phrase, error_message AS error, session_id, motion_database_id,
                    body_model_id, parameters, created_at, started_at, finished_at FROM runs ",
            $rest
        )
    };
}

/// The runs of project `$1` with an id below `$2`, newest first, at most `$3`.
pub(crate) const SELECT_BY_PROJECT: &str =
    select_runs!("WHERE project_id = $1 AND id < $2 ORDER BY id DESC LIMIT $3");

/// The same of session `$1`.
pub(crate) const SELECT_BY_SESSION: &str =
    select_runs!("WHERE session_id = $1 AND id < $2 ORDER BY id DESC LIMIT $3");

/// The run of that id in the project.
pub(crate) async fn find(db: &mut PgConnection, project_id: Uuid, id: Uuid) -> Result<Run> {
    sqlx::query_as(select_runs!("WHERE id = $1 AND project_id = $2"))
        .bind(id)
        .bind(project_id)
        .fetch_optional(db)
        .await?
        .ok_or_else(|| Error::not_found("run", id))
}

pub(crate) async fn with_jobs(db: &mut PgConnection, run: Run) -> Result<RunWithJobs> {
    let jobs = sqlx::query_as(
        "SELECT kind, state, count(*) AS count, sum(attempts) AS attempts,
                coalesce(array_agg(DISTINCT last_worker) FILTER (WHERE last_worker IS NOT NULL), '{}') AS workers
         FROM jobs WHERE run_id = $1 GROUP BY kind, state ORDER BY min(id), state",
    )
    .bind(run.id)
    .fetch_all(db)
    .await?;
    Ok(RunWithJobs { run, jobs })
}
