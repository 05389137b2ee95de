//! Ending an attempt: completing, failing, handing back. Every write is fenced by the lease number.

use std::time::Duration;

use sqlx::{Acquire, PgConnection};

use crate::enqueue_many;
use crate::lease::{update_run_progress, without_nul};
use crate::{Artefact, ChildJob, Error, JobId, JobState, LeaseNumber, OnComplete, RunId, RunState, channels};

/// The claim under which a worker writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lease {
    /// The job.
    pub job_id: JobId,
    /// The run that it belongs to.
    pub run_id: RunId,
    /// The number of the claim.
    pub lease_number: LeaseNumber,
}

/// What is stored together with a job's success.
#[derive(Default)]
pub struct Completion<'a> {
    /// Files that the job left in the object store.
    pub artefacts: &'a [Artefact],
    /// Jobs to add to the run.
    pub children: &'a [ChildJob],
    /// The handler's own SQL.
    pub on_complete: Option<&'a OnComplete>,
}

/// How an attempt failed.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// Try again after the delay if attempts are left; else the job has failed for good.
    Retry {
        /// For a developer.
        detail: String,
        /// Before the next attempt.
        delay: Duration,
    },
    /// The job has failed for good, and its run with it.
    GiveUp {
        /// For the user.
        message: String,
        /// For a developer.
        detail: String,
    },
}

/// What became of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Settled {
    /// The job has succeeded and everything that came with it is stored.
    Succeeded,
    /// The job will be tried again.
    Retrying,
    /// The job has failed for good, and its run with it.
    Failed,
    /// Nobody wanted it any more: the job is cancelled, nothing else was stored.
    Cancelled,
    /// The job is available again and the attempt is not counted.
    HandedBack,
    /// The lease was lost: nothing was stored, drop the result.
    LeaseLost,
}

/// Completes the job: stores its artefacts, adds its children, runs the handler's own SQL, unblocks its
/// dependents and, when it was the last, ends the run, all in one transaction.
///
/// May be called again after any transient error, even when the commit's answer was lost on the way.
pub async fn complete(
    connection: &mut PgConnection,
    lease: &Lease,
    completion: &Completion<'_>,
) -> Result<Settled, Error> {
    let mut transaction = connection.begin().await?;
    if lock_existing_run(&mut transaction, lease.run_id).await?.is_none() {
        return Ok(Settled::LeaseLost);
    }
    let (succeeded, unblocked): (bool, Vec<String>) =
        sqlx::query_as(include_str!("../queries/succeed_job.sql"))
            .bind(lease.job_id)
            .bind(lease.lease_number)
            .fetch_one(&mut *transaction)
            .await?;
    if !succeeded {
        return refused(transaction, lease).await;
    }
    channels::notify(&mut transaction, channels::AVAILABLE, unblocked.iter().map(String::as_str)).await?;
    insert_artefacts(&mut transaction, lease, completion.artefacts).await?;
    if !completion.children.is_empty() {
        enqueue_many(&mut transaction, lease.run_id, completion.children).await?;
    }
    if let Some(on_complete) = completion.on_complete {
        on_complete(&mut transaction).await.map_err(Error::OnComplete)?;
    }
    settle_run(&mut transaction, lease).await?;
    transaction.commit().await?;
    Ok(Settled::Succeeded)
}

/// Ends a failed attempt: the job is tried again, or has failed for good together with its run.
pub async fn fail(connection: &mut PgConnection, lease: &Lease, failure: &Failure) -> Result<Settled, Error> {
    let mut transaction = connection.begin().await?;
    if lock_existing_run(&mut transaction, lease.run_id).await?.is_none() {
        return Ok(Settled::LeaseLost);
    }
    let used_up = match failure {
        Failure::Retry { detail, .. } => {
            format!("this step failed too often, the last time because: {}", shown(detail))
        }
        Failure::GiveUp { .. } => String::new(),
    };
    let settled = fail_locked(&mut transaction, lease, failure, &used_up).await?;
    match settled {
        Some(settled) => {
            transaction.commit().await?;
            Ok(settled)
        }
        None => refused(transaction, lease).await,
    }
}

/// Most characters of a cause that people are shown.
const SHOWN: usize = 300;

/// The first line of what a developer is told.
fn shown(detail: &str) -> String {
    without_nul(detail).lines().next().unwrap_or_default().chars().take(SHOWN).collect()
}

/// Gives the job to someone else without counting the attempt.
pub async fn hand_back(connection: &mut PgConnection, lease: &Lease) -> Result<Settled, Error> {
    let mut transaction = connection.begin().await?;
    let kind: Option<String> = sqlx::query_scalar(include_str!("../queries/hand_back_job.sql"))
        .bind(lease.job_id)
        .bind(lease.lease_number)
        .fetch_optional(&mut *transaction)
        .await?;
    let Some(kind) = kind else {
        return refused(transaction, lease).await;
    };
    channels::notify(&mut transaction, channels::AVAILABLE, [kind.as_str()]).await?;
    transaction.commit().await?;
    Ok(Settled::HandedBack)
}

/// Says that a cancelled job is no longer being run.
pub async fn acknowledge_cancel(connection: &mut PgConnection, lease: &Lease) -> Result<Settled, Error> {
    let transaction = connection.begin().await?;
    refused(transaction, lease).await
}

/// With the run locked: `None` when the lease does not hold or the job is cancelled.
pub(crate) async fn fail_locked(
    connection: &mut PgConnection,
    lease: &Lease,
    failure: &Failure,
    used_up: &str,
) -> Result<Option<Settled>, Error> {
    let (message, detail) = match failure {
        Failure::Retry { detail, delay } => {
            let retried = sqlx::query(include_str!("../queries/retry_job.sql"))
                .bind(lease.job_id)
                .bind(lease.lease_number)
                .bind(used_up)
                .bind(without_nul(detail))
                .bind(delay.as_secs_f64())
                .execute(&mut *connection)
                .await?;
            if retried.rows_affected() > 0 {
                return Ok(Some(Settled::Retrying));
            }
            (used_up.to_owned(), without_nul(detail))
        }
        Failure::GiveUp { message, detail } => (without_nul(message), without_nul(detail)),
    };
    let failed = sqlx::query(include_str!("../queries/fail_job.sql"))
        .bind(lease.job_id)
        .bind(lease.lease_number)
        .bind(&message)
        .bind(&detail)
        .execute(&mut *connection)
        .await?;
    if failed.rows_affected() == 0 {
        return Ok(None);
    }
    end_run(connection, lease.run_id, Remaining::failed(message, detail)).await?;
    Ok(Some(Settled::Failed))
}

/// How a run ends early.
pub(crate) struct Remaining {
    state: RunState,
    error: Option<(String, String)>,
}

impl Remaining {
    pub(crate) fn cancelled_by_user() -> Self {
        Self { state: RunState::Cancelled, error: None }
    }

    fn failed(message: String, detail: String) -> Self {
        Self { state: RunState::Failed, error: Some((message, detail)) }
    }
}

/// Locks the run before any of its jobs.
pub(crate) async fn lock_run(connection: &mut PgConnection, run_id: RunId) -> Result<RunState, Error> {
    lock_existing_run(connection, run_id).await?.ok_or(Error::NoSuchRun(run_id))
}

pub(crate) async fn lock_existing_run(
    connection: &mut PgConnection,
    run_id: RunId,
) -> Result<Option<RunState>, Error> {
    let state: Option<String> = sqlx::query_scalar(include_str!("../queries/lock_run.sql"))
        .bind(run_id)
        .fetch_optional(connection)
        .await?;
    Ok(state.map(|state| state.parse()).transpose()?)
}

/// With the run locked: ends it, cancels what waits and flags what runs.
pub(crate) async fn end_run(
    connection: &mut PgConnection,
    run_id: RunId,
    remaining: Remaining,
) -> Result<(), Error> {
    let statements = [
        include_str!("../queries/lock_unfinished_jobs.sql"),
        include_str!("../queries/cancel_waiting_jobs.sql"),
        include_str!("../queries/flag_running_jobs.sql"),
    ];
    for statement in statements {
        sqlx::query(statement).bind(run_id).execute(&mut *connection).await?;
    }
    let (message, detail) = remaining.error.unzip();
    sqlx::query(include_str!("../queries/end_run.sql"))
        .bind(run_id)
        .bind(remaining.state.as_str())
        .bind(message)
        .bind(detail)
        .execute(&mut *connection)
        .await?;
    let id = run_id.to_string();
    channels::notify(connection, channels::CANCELLED, [id.as_str()]).await?;
    channels::notify(connection, channels::RUNS, [id.as_str()]).await
}

/// Runs an update with the parameters (id, lease number); whether the row was there.
async fn fenced(
    statement: &'static str,
    lease: &Lease,
    connection: &mut PgConnection,
) -> Result<bool, Error> {
    let done = sqlx::query(statement).bind(lease.job_id).bind(lease.lease_number).execute(connection).await?;
    Ok(done.rows_affected() > 0)
}

/// A fenced write met no row: finds out why. The transaction has written nothing yet.
async fn refused(mut transaction: sqlx::PgTransaction<'_>, lease: &Lease) -> Result<Settled, Error> {
    if fenced(include_str!("../queries/cancel_flagged_job.sql"), lease, &mut transaction).await? {
        transaction.commit().await?;
        return Ok(Settled::Cancelled);
    }
    let row: Option<(String, LeaseNumber)> = sqlx::query_as(include_str!("../queries/job_outcome.sql"))
        .bind(lease.job_id)
        .fetch_optional(&mut *transaction)
        .await?;
    transaction.rollback().await?;
    match row {
        // Our own earlier call, whose answer was lost on the way.
        Some((state, number)) if number == lease.lease_number => Ok(match state.parse()? {
            JobState::Succeeded => Settled::Succeeded,
            JobState::Failed => Settled::Failed,
            JobState::Cancelled => Settled::Cancelled,
            JobState::Blocked | JobState::Available | JobState::Running => Settled::LeaseLost,
        }),
        _ => Ok(Settled::LeaseLost),
    }
}

async fn insert_artefacts(
    connection: &mut PgConnection,
    lease: &Lease,
    artefacts: &[Artefact],
) -> Result<(), Error> {
    if artefacts.is_empty() {
        return Ok(());
    }
    fn column<'a, T>(artefacts: &'a [Artefact], get: impl Fn(&'a Artefact) -> T) -> Vec<T> {
        artefacts.iter().map(get).collect()
    }
    sqlx::query(include_str!("../queries/insert_artefacts.sql"))
        .bind(lease.run_id)
        .bind(lease.job_id)
        .bind(column(artefacts, |artefact| artefact.name.as_str()))
        .bind(column(artefacts, |artefact| artefact.store_key.as_str()))
        .bind(column(artefacts, |artefact| artefact.bytes))
        .bind(column(artefacts, |artefact| artefact.blake3.as_str()))
        .bind(column(artefacts, |artefact| artefact.media_type.as_str()))
        .bind(column(artefacts, |artefact| artefact.is_result))
        .execute(connection)
        .await?;
    Ok(())
}

/// With the run locked: succeeds it if nothing is left to do, else brings its progress up to date.
async fn settle_run(connection: &mut PgConnection, lease: &Lease) -> Result<(), Error> {
    let left = is_anything_left(connection, lease.run_id).await?;
    if !left.unfinished {
        // Someone may be adding a job at this moment in a transaction that we cannot see.
        sqlx::query(include_str!("../queries/lock_run_to_end.sql"))
            .bind(lease.run_id)
            .execute(&mut *connection)
            .await?;
        if !is_anything_left(connection, lease.run_id).await?.unfinished {
            sqlx::query(include_str!("../queries/succeed_run.sql"))
                .bind(lease.run_id)
                .execute(&mut *connection)
                .await?;
            return channels::notify(connection, channels::RUNS, [lease.run_id.to_string().as_str()]).await;
        }
    }
    if left.progress_due {
        update_run_progress(connection, &[lease.job_id]).await?;
    }
    Ok(())
}

#[derive(sqlx::FromRow)]
struct Left {
    unfinished: bool,
    progress_due: bool,
}

async fn is_anything_left(connection: &mut PgConnection, run_id: RunId) -> Result<Left, Error> {
    Ok(sqlx::query_as(include_str!("../queries/is_anything_left.sql"))
        .bind(run_id)
        .fetch_one(connection)
        .await?)
}
