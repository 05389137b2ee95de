//! What the queue refuses, and why attempts at jobs fail.

use crate::{RunId, RunState, UnknownState};

/// What can go wrong in a call to the queue.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// PostgreSQL or the way to it failed.
    #[error("database: {0}")]
    Database(#[from] sqlx::Error),
    /// There is no such run.
    #[error("run {0} does not exist")]
    NoSuchRun(RunId),
    /// Nothing can be added to a run that has ended.
    #[error("run {run_id} is {state}, expected one that has not ended")]
    RunFinished {
        /// The run.
        run_id: RunId,
        /// How it ended.
        state: RunState,
    },
    /// A job of a batch may depend only on earlier jobs of the batch.
    #[error("job {index} of the batch depends on job {depends_on}, expected an earlier one")]
    DependencyNotEarlier {
        /// Position in the batch.
        index: usize,
        /// The position it named.
        depends_on: usize,
    },
    /// A payload that is no JSON.
    #[error("the payload of a {kind} job can't be stored: {source}")]
    Payload {
        /// Kind of the job.
        kind: &'static str,
        /// Why not.
        source: serde_json::Error,
    },
    /// The handler's own SQL in the completing transaction refused.
    #[error("on_complete: {0}")]
    OnComplete(#[source] JobError),
    /// A word in the database that this version does not know.
    #[error(transparent)]
    UnknownState(#[from] UnknownState),
}

impl Error {
    /// Whether the same call may succeed later: the connection broke, the server restarts, a deadlock
    /// was resolved against us, something ran out.
    pub fn is_transient(&self) -> bool {
        match self {
            Self::Database(error) | Self::OnComplete(JobError::Database(error)) => is_transient(error),
            _ => false,
        }
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
    /// It stopped because [`JobContext::is_cancelled`](crate::JobContext::is_cancelled) said so.
    #[error("stopped before the end")]
    Stopped,
    /// The database failed; the attempt, or in [`Outcome::on_complete`](crate::Outcome::on_complete) the completion, is tried again.
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

/// Whether the same statement may succeed later.
pub(crate) fn is_transient(error: &sqlx::Error) -> bool {
    match error {
        sqlx::Error::Io(_)
        | sqlx::Error::Tls(_)
        | sqlx::Error::Protocol(_)
        | sqlx::Error::PoolTimedOut
        | sqlx::Error::WorkerCrashed => true,
        sqlx::Error::Database(error) => error.code().is_some_and(|code| {
            // connection; rollback (deadlock, serialisation); resources; intervention; lock not available
            ["08", "40", "53", "57", "58"].iter().any(|class| code.starts_with(class)) || code == "55P03"
        }),
        _ => false,
    }
}
