//! What the queue refuses.

use crate::{JobError, JobId, RunId, RunState};

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
    /// A job depends on a job that is not in its run.
    #[error("run {run_id} has {found} of the {expected} jobs to depend on: {depends_on:?}")]
    NoSuchDependency {
        /// The run.
        run_id: RunId,
        /// What was asked for.
        depends_on: Vec<JobId>,
        /// How many of them there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// The handler's own SQL in the completing transaction refused.
    #[error("on_complete: {0}")]
    OnComplete(#[source] JobError),
    /// A word in the database that this version does not know.
    #[error("unknown state {found:?}, expected one of {expected}")]
    UnknownState {
        /// The word.
        found: String,
        /// The known words.
        expected: &'static str,
    },
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
