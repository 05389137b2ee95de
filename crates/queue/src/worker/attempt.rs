//! One attempt at one job, from its claim to the acknowledged end.

use std::any::Any;
use std::sync::Arc;

use futures::future::BoxFuture;
use sqlx::PgConnection;
use tokio::task::JoinError;
use tokio::time::{Instant, timeout};
use tokio_util::task::AbortOnDropHandle;
use tracing::Instrument;

use super::context::{Held, JobContext, Stop};
use super::handler::{DynHandler, Outcome};
use super::link::Reconnect;
use super::shared::Shared;
use crate::finish::{Completion, Failure, Settled, acknowledge_cancel, complete, fail, hand_back};
use crate::{ClaimedJob, Error, JobError, Lease};

/// Runs the job and returns when its end is acknowledged (or its lease is lost).
pub(super) async fn attempt(shared: Arc<Shared>, job: ClaimedJob) {
    let span = tracing::info_span!(
        "job", job.id = %job.id, job.kind = job.kind, run.id = %job.run_id, attempt = job.attempt,
        lease = %job.lease_number
    );
    let lease = Lease { job_id: job.id, run_id: job.run_id, lease_number: job.lease_number };
    let held = shared.held.add(lease);
    let job = Arc::new(job);
    async {
        let end = match shared.handlers.get(job.kind.as_str()) {
            // A claim that was on its way when the shutdown came.
            _ if shared.shutdown.is_cancelled() => Some(End::HandBack),
            Some(handler) => run(&shared, handler.clone(), &job, &held).await,
            None => Some(End::HandBack),
        };
        let Some(end) = end else {
            tracing::warn!("lease lost, result dropped");
            return;
        };
        let settled = settle(&shared, &job, &lease, end).await;
        tracing::debug!(?settled, "job settled");
    }
    .instrument(span)
    .await;
    shared.held.remove(&lease);
}

/// What is to be written.
enum End {
    Complete(Outcome),
    Fail(JobError),
    Panicked(String),
    AcknowledgeCancel,
    HandBack,
}

/// Runs the handler; nothing where the lease is lost, as then somebody else writes the end.
async fn run(
    shared: &Shared,
    handler: Arc<dyn DynHandler>,
    job: &Arc<ClaimedJob>,
    held: &Arc<Held>,
) -> Option<End> {
    let context = JobContext::new(job.clone(), held.clone());
    let before = shared.before_attempt.clone();
    // A task of its own: a panic ends the task, not the worker.
    let task = async move {
        if let Some(before) = before {
            before(context.clone()).await;
        }
        handler.run(context).await
    };
    let task = tokio::spawn(task.in_current_span());
    // Aborts it when it is left behind, or the whole worker is.
    let mut task = AbortOnDropHandle::new(task);
    let result = tokio::select! {
        result = &mut task => Some(result),
        () = held.stop.cancelled() => timeout(shared.patience, &mut task).await.ok(),
    };
    if result.is_none() {
        tracing::warn!(reason = ?held.stopped(), "handler did not stop when told to, left behind");
    }
    Some(match (result, held.stopped()) {
        (_, Some(Stop::LeaseLost)) => return None,
        (Some(Ok(Ok(outcome))), _) => End::Complete(outcome),
        (_, Some(Stop::Cancelled)) => End::AcknowledgeCancel,
        (_, Some(Stop::Shutdown)) | (None, None) => End::HandBack,
        (Some(Ok(Err(error))), None) => End::Fail(error),
        (Some(Err(error)), None) => End::Panicked(panic_message(error)),
    })
}

/// Writes the end until it is acknowledged: meanwhile the slot stays taken and the lease is kept.
async fn settle(shared: &Shared, job: &ClaimedJob, lease: &Lease, mut end: End) -> Option<Settled> {
    let mut reconnect = Reconnect::new();
    let mut give_up_at = None;
    loop {
        let error = match write(shared, job, lease, &end).await {
            Ok(settled) => return settled,
            Err(error) => error,
        };
        if error.is_transient() {
            tracing::warn!(%error, "end of job not acknowledged, trying again");
        } else if let End::Complete(_) = end {
            // The outcome itself is refused: that is a failed attempt.
            end = End::Fail(match error {
                Error::OnComplete(error) => error,
                error => JobError::retry(error),
            });
            continue;
        } else {
            tracing::error!(%error, "end of job refused, left to the reaper");
            return None;
        }
        if shared.shutdown.is_cancelled() {
            let give_up_at = *give_up_at.get_or_insert_with(|| Instant::now() + shared.grace);
            if Instant::now() >= give_up_at {
                tracing::error!("end of job not acknowledged before the shutdown, left to the reaper");
                return None;
            }
        }
        tokio::time::sleep(reconnect.next()).await;
    }
}

async fn write(
    shared: &Shared,
    job: &ClaimedJob,
    lease: &Lease,
    end: &End,
) -> Result<Option<Settled>, Error> {
    let mut connection = shared.pool.acquire().await?;
    let connection: &mut PgConnection = &mut connection;
    let retry = |detail: String| {
        let delay = shared.retry.delay(job.id, job.attempt);
        tracing::warn!(detail, "attempt failed");
        Failure::Retry { detail, delay }
    };
    let failure = match end {
        End::Complete(outcome) => {
            let completion = Completion {
                artefacts: &outcome.artefacts,
                children: &outcome.children,
                on_complete: outcome.on_complete.as_deref(),
            };
            let completing: BoxFuture<'_, _> = Box::pin(complete(connection, lease, &completion));
            return completing.await.map(Some);
        }
        End::AcknowledgeCancel => return acknowledge_cancel(connection, lease).await.map(Some),
        End::HandBack => return hand_back(connection, lease).await.map(Some),
        End::Fail(JobError::GiveUp { message, detail }) => {
            Failure::GiveUp { message: message.clone(), detail: detail.clone() }
        }
        End::Fail(error) => retry(error.to_string()),
        End::Panicked(message) => retry(format!("panicked: {message}")),
    };
    fail(connection, lease, &failure).await.map(Some)
}

fn panic_message(error: JoinError) -> String {
    let Ok(payload) = error.try_into_panic() else {
        return "the task was aborted".to_owned();
    };
    let payload: Box<dyn Any + Send> = payload;
    match payload.downcast::<String>() {
        Ok(message) => *message,
        Err(payload) => match payload.downcast::<&'static str>() {
            Ok(message) => (*message).to_owned(),
            Err(_) => "a panic without a message".to_owned(),
        },
    }
}
