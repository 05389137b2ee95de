//! Finding jobs whose worker has died.

use sqlx::{Acquire, PgConnection};

use crate::finish::{Failure, Lease, Settled, fail_locked, lock_existing_run};
use crate::{Error, JobId, LeaseNumber, RetryPolicy, RunId};

#[derive(sqlx::FromRow)]
struct Stale {
    id: JobId,
    run_id: RunId,
    kind: String,
    attempt: i32,
    max_attempts: i32,
    lease_number: LeaseNumber,
    cancel_requested: bool,
}

/// What became of a job whose worker was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reaped {
    /// The job.
    pub job_id: JobId,
    /// [`Settled::Retrying`], [`Settled::Failed`] or [`Settled::Cancelled`].
    pub settled: Settled,
}

/// Takes the jobs away from workers that have not been heard for the staleness. The attempt is counted, so
/// a job that kills every worker ends as failed. Any number of reapers may run at once.
///
/// Each job is a transaction of its own: one that cannot be written is logged and left, the rest is done.
///
/// # Errors
/// Only when the sweep as a whole cannot go on: the list of jobs cannot be read, or the connection is gone.
pub async fn reap(connection: &mut PgConnection, policy: &RetryPolicy) -> Result<Vec<Reaped>, Error> {
    let stale: Vec<Stale> =
        sqlx::query_as(include_str!("../queries/stale_jobs.sql")).fetch_all(&mut *connection).await?;
    let mut reaped = Vec::new();
    for job in stale {
        match reap_one(connection, &job, policy).await {
            Ok(Some(settled)) => {
                tracing::warn!(job.id = %job.id, job.kind, job.attempt, ?settled, "worker of a job was lost");
                reaped.push(Reaped { job_id: job.id, settled });
            }
            Ok(None) => {}
            Err(Error::Database(error)) if !matches!(error, sqlx::Error::Database(_)) => {
                return Err(error.into());
            }
            Err(error) => tracing::error!(job.id = %job.id, job.kind, %error, "job could not be reaped"),
        }
    }
    Ok(reaped)
}

async fn reap_one(
    connection: &mut PgConnection,
    job: &Stale,
    policy: &RetryPolicy,
) -> Result<Option<Settled>, Error> {
    let mut transaction = connection.begin().await?;
    // Whoever holds the run that long must not stop the sweep.
    sqlx::query("SET LOCAL lock_timeout = '2s'").execute(&mut *transaction).await?;
    lock_existing_run(&mut transaction, job.run_id).await?;
    let locked = sqlx::query(include_str!("../queries/lock_stale_job.sql"))
        .bind(job.id)
        .bind(job.lease_number)
        .fetch_optional(&mut *transaction)
        .await?;
    if locked.is_none() {
        return Ok(None);
    }
    let lease = Lease { job_id: job.id, run_id: job.run_id, lease_number: job.lease_number };
    let settled = if job.cancel_requested {
        sqlx::query(include_str!("../queries/cancel_flagged_job.sql"))
            .bind(job.id)
            .bind(job.lease_number)
            .execute(&mut *transaction)
            .await?;
        Some(Settled::Cancelled)
    } else {
        let detail = format!(
            "no heartbeat within the staleness on attempt {} of {}, lease {}",
            job.attempt, job.max_attempts, job.lease_number
        );
        let failure = Failure::Retry { detail, delay: policy.delay(job.id, job.attempt) };
        let used_up = "the process running this step died each time it was tried";
        fail_locked(&mut transaction, &lease, &failure, used_up).await?
    };
    transaction.commit().await?;
    Ok(settled)
}
