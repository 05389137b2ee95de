//! What a service implements to run one kind of job.

use futures::future::BoxFuture;
use serde_json::Value;
use sqlx::PgConnection;

use super::JobContext;
use crate::{Artefact, ChildJob, Error};

/// Runs one kind of job.
///
/// **Delivery is at least once.** A job is run again after a failed attempt, after its worker died or was
/// cut off, and even while an older attempt whose lease was lost is still on its last steps. So:
///
/// - be idempotent: the same payload must lead to the same result, bit for bit;
/// - write files only under names that contain [`JobContext::lease_number`], and name them in the
///   [`Outcome`]: only the attempt that completes has its artefacts recorded;
/// - write to the database only in [`Outcome::on_complete`], which is rolled back if the lease is lost;
/// - ask [`JobContext::is_cancelled`] (or await [`JobContext::cancelled`]) often enough that a cancelled
///   job ends within a heartbeat. Work on other threads is not stopped otherwise.
///
/// A panic is a failed attempt. Work that keeps a CPU busy belongs on `tokio::task::spawn_blocking`.
pub trait Handler: Send + Sync + 'static {
    /// The kind of job that it runs.
    fn kind(&self) -> &'static str;

    /// Runs one attempt at a job.
    fn run(&self, job: JobContext) -> impl Future<Output = Result<Outcome, JobError>> + Send;
}

/// [`Handler`] as a trait object.
pub(super) trait DynHandler: Send + Sync + 'static {
    fn run(&self, job: JobContext) -> BoxFuture<'_, Result<Outcome, JobError>>;
}

impl<H: Handler> DynHandler for H {
    fn run(&self, job: JobContext) -> BoxFuture<'_, Result<Outcome, JobError>> {
        Box::pin(Handler::run(self, job))
    }
}

/// SQL of a handler's own, run in the transaction that completes the job. It may be run again when that
/// transaction could not be committed.
pub type OnComplete =
    dyn for<'c> Fn(&'c mut PgConnection) -> BoxFuture<'c, Result<(), JobError>> + Send + Sync;

/// What a successful attempt leaves behind. All of it is stored in one transaction, or none.
#[derive(Default)]
pub struct Outcome {
    /// Files that it wrote to the object store.
    pub artefacts: Vec<Artefact>,
    /// Jobs to add to the run; dependencies are positions in this list.
    pub children: Vec<ChildJob>,
    /// SQL of its own.
    pub on_complete: Option<Box<OnComplete>>,
}

impl Outcome {
    /// The same outcome with one more file.
    #[must_use]
    pub fn artefact(mut self, artefact: Artefact) -> Self {
        self.artefacts.push(artefact);
        self
    }

    /// The same outcome with these jobs to add to the run.
    #[must_use]
    pub fn children(mut self, children: Vec<ChildJob>) -> Self {
        self.children = children;
        self
    }

    /// The same outcome with SQL of its own: `|connection| Box::pin(async move { … })`.
    #[must_use]
    pub fn on_complete(
        mut self,
        statements: impl for<'c> Fn(&'c mut PgConnection) -> BoxFuture<'c, Result<(), JobError>>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        self.on_complete = Some(Box::new(statements));
        self
    }
}

/// Why an attempt did not succeed.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// Something outside failed that may work later: the network, the object store, a lock.
    #[error("{detail}")]
    Retry {
        /// For a developer.
        detail: String,
    },
    /// The input is bad: no further attempt will help.
    #[error("{message}: {detail}")]
    GiveUp {
        /// For the user, who can do something about it.
        message: String,
        /// For a developer.
        detail: String,
    },
    /// It stopped because [`JobContext::is_cancelled`] said so.
    #[error("stopped before the end")]
    Stopped,
    /// The database failed; the attempt, or in [`Outcome::on_complete`] the completion, is tried again.
    #[error("database: {0}")]
    Database(#[from] sqlx::Error),
}

impl JobError {
    /// An attempt that may succeed later.
    pub fn retry(detail: impl ToString) -> Self {
        Self::Retry { detail: detail.to_string() }
    }

    /// Bad input. `message` is for the user, `detail` for a developer.
    pub fn give_up(message: impl Into<String>, detail: impl ToString) -> Self {
        Self::GiveUp { message: message.into(), detail: detail.to_string() }
    }

    /// Bad input of which an error tells everything: its message is for the user, all that it holds for a developer.
    pub fn bad_input(error: impl std::error::Error) -> Self {
        Self::give_up(error.to_string(), format!("{error:?}"))
    }
}

impl From<Error> for JobError {
    fn from(error: Error) -> Self {
        match error {
            Error::Database(error) => Self::Database(error),
            Error::OnComplete(error) => error,
            error => Self::retry(error),
        }
    }
}

/// Reads a payload; one that cannot be read is bad input, not a crash.
pub(super) fn read_payload<T: serde::de::DeserializeOwned>(
    kind: &str,
    payload: &Value,
) -> Result<T, JobError> {
    T::deserialize(payload)
        .map_err(|error| JobError::give_up(format!("the payload of this {kind} job cannot be read"), error))
}
