//! Looking at what the queue holds.

use sqlx::PgConnection;

use crate::{Artefact, Error, JobId, JobState, RunId};

/// An artefact of a job that another job depended on.
#[derive(Debug, Clone, PartialEq, Eq, sqlx::FromRow)]
pub struct InputArtefact {
    /// The job that made it.
    pub job_id: JobId,
    /// The artefact.
    #[sqlx(flatten)]
    pub artefact: Artefact,
}

/// How many unfinished jobs of one kind stand in one state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Depth {
    /// The kind of job.
    pub kind: String,
    /// Blocked, available or running.
    pub state: JobState,
    /// How many.
    pub jobs: i64,
}

/// The results of a run, by name.
pub async fn run_results(connection: &mut PgConnection, run_id: RunId) -> Result<Vec<Artefact>, Error> {
    Ok(sqlx::query_as(include_str!("../queries/run_results.sql")).bind(run_id).fetch_all(connection).await?)
}

/// What the jobs that this job depended on have left, in the order in which those were enqueued.
pub async fn dependency_artefacts(
    connection: &mut PgConnection,
    job_id: JobId,
) -> Result<Vec<InputArtefact>, Error> {
    Ok(sqlx::query_as(include_str!("../queries/dependency_artefacts.sql"))
        .bind(job_id)
        .fetch_all(connection)
        .await?)
}

/// How much there is to do, by kind and state.
pub async fn depth(connection: &mut PgConnection) -> Result<Vec<Depth>, Error> {
    let rows: Vec<(String, String, i64)> =
        sqlx::query_as(include_str!("../queries/depth.sql")).fetch_all(connection).await?;
    rows.into_iter().map(|(kind, state, jobs)| Ok(Depth { kind, state: state.parse()?, jobs })).collect()
}
