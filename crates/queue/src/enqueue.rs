//! Adding jobs to a run, inside the caller's transaction.

use std::collections::BTreeSet;

use serde_json::Value;
use sqlx::PgConnection;

use crate::{ChildJob, Error, JobId, ProjectId, RunId, RunState, channels};

/// Adds jobs that depend on each other to a run. Returns their ids in the order given.
///
/// In an open transaction this keeps no other enqueuer waiting, whatever the run. (Until it ends, the run itself cannot
/// end.)
///
/// # Errors
/// [`Error::NoSuchRun`], [`Error::RunFinished`], [`Error::DependencyNotEarlier`].
pub async fn enqueue_many(
    connection: &mut PgConnection,
    run_id: RunId,
    jobs: &[ChildJob],
) -> Result<Vec<JobId>, Error> {
    let mut edges = Vec::new();
    let mut pending = Vec::with_capacity(jobs.len());
    for (index, job) in jobs.iter().enumerate() {
        let dependencies: BTreeSet<usize> = job.depends_on.iter().copied().collect();
        if let Some(&depends_on) = dependencies.iter().find(|&&earlier| earlier >= index) {
            return Err(Error::DependencyNotEarlier { index, depends_on });
        }
        pending.push(dependencies.len() as i32);
        edges.extend(dependencies.into_iter().map(|earlier| (index, earlier)));
    }
    let project_id = lock_run(connection, run_id).await?;
    if jobs.is_empty() {
        return Ok(Vec::new());
    }
    let ids = draw_ids(connection, jobs.len()).await?;
    let rows = Rows {
        ids: ids.clone(),
        kinds: jobs.iter().map(|job| job.kind).collect(),
        payloads: jobs.iter().map(|job| &job.payload).collect(),
        payload_versions: jobs.iter().map(|job| job.payload_version).collect(),
        priorities: jobs.iter().map(|job| job.priority).collect(),
        weights: jobs.iter().map(|job| job.weight).collect(),
        max_attempts: jobs.iter().map(|job| job.max_attempts).collect(),
        pending,
    };
    rows.insert(connection, run_id, project_id).await?;
    let (dependents, depends_on): (Vec<JobId>, Vec<JobId>) =
        edges.into_iter().map(|(job, earlier)| (ids[job], ids[earlier])).unzip();
    insert_dependencies(connection, run_id, &dependents, &depends_on).await?;
    Ok(ids)
}

async fn lock_run(connection: &mut PgConnection, run_id: RunId) -> Result<ProjectId, Error> {
    let row: Option<(ProjectId, String)> = sqlx::query_as(include_str!("../queries/run_for_enqueue.sql"))
        .bind(run_id)
        .fetch_optional(connection)
        .await?;
    let (project_id, state) = row.ok_or(Error::NoSuchRun(run_id))?;
    let state: RunState = state.parse()?;
    if state.is_finished() {
        return Err(Error::RunFinished { run_id, state });
    }
    Ok(project_id)
}

/// Drawn in one statement, but sorted by us: nothing promises the order of the rows.
async fn draw_ids(connection: &mut PgConnection, count: usize) -> Result<Vec<JobId>, Error> {
    let mut ids: Vec<JobId> = sqlx::query_scalar(include_str!("../queries/draw_job_ids.sql"))
        .bind(count as i64)
        .fetch_all(connection)
        .await?;
    ids.sort_unstable();
    Ok(ids)
}

/// The columns of the jobs to insert, all of one length.
struct Rows<'a> {
    ids: Vec<JobId>,
    kinds: Vec<&'a str>,
    payloads: Vec<&'a Value>,
    payload_versions: Vec<i32>,
    priorities: Vec<i16>,
    weights: Vec<f64>,
    max_attempts: Vec<i32>,
    pending: Vec<i32>,
}

impl Rows<'_> {
    async fn insert(
        &self,
        connection: &mut PgConnection,
        run_id: RunId,
        project_id: ProjectId,
    ) -> Result<(), Error> {
        sqlx::query(include_str!("../queries/insert_jobs.sql"))
            .bind(run_id)
            .bind(project_id)
            .bind(&self.ids)
            .bind(&self.kinds)
            .bind(self.payloads.iter().map(|payload| (*payload).clone()).collect::<Vec<Value>>())
            .bind(&self.payload_versions)
            .bind(&self.priorities)
            .bind(&self.weights)
            .bind(&self.max_attempts)
            .bind(&self.pending)
            .execute(&mut *connection)
            .await?;
        let available = self.kinds.iter().zip(&self.pending).filter(|(_, pending)| **pending == 0);
        let kinds: BTreeSet<&str> = available.map(|(kind, _)| *kind).collect();
        channels::notify(connection, channels::AVAILABLE, kinds).await
    }
}

async fn insert_dependencies(
    connection: &mut PgConnection,
    run_id: RunId,
    dependents: &[JobId],
    depends_on: &[JobId],
) -> Result<(), Error> {
    if !dependents.is_empty() {
        sqlx::query(include_str!("../queries/insert_dependencies.sql"))
            .bind(run_id)
            .bind(dependents)
            .bind(depends_on)
            .execute(connection)
            .await?;
    }
    Ok(())
}
