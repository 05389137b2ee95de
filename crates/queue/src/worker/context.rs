//! What a handler knows of the job that it runs, and what the worker knows of it.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;

use crate::lease::clamp;
use crate::{ClaimedJob, Job, JobError, JobId, Lease, LeaseNumber, ProjectId, RunId};

/// One attempt at a job, as its [`Handler`](super::Handler) sees it. Cheap to clone.
#[derive(Clone)]
pub struct JobContext {
    job: Arc<ClaimedJob>,
    held: Arc<Held>,
    started: Instant,
}

impl JobContext {
    /// Of an attempt that begins now.
    pub(super) fn new(job: Arc<ClaimedJob>, held: Arc<Held>) -> Self {
        Self { job, held, started: Instant::now() }
    }

    /// The job.
    pub fn id(&self) -> JobId {
        self.job.id
    }

    /// The run that it belongs to.
    pub fn run_id(&self) -> RunId {
        self.job.run_id
    }

    /// The project that it belongs to.
    pub fn project_id(&self) -> ProjectId {
        self.job.project_id
    }

    /// Which attempt this is, from 1.
    pub fn attempt(&self) -> i32 {
        self.job.attempt
    }

    /// How many attempts there are.
    pub fn max_attempts(&self) -> i32 {
        self.job.max_attempts
    }

    /// The number of this claim; no two attempts at a job share one. Belongs into the name of every file
    /// that the attempt writes.
    pub fn lease_number(&self) -> LeaseNumber {
        self.job.lease_number
    }

    /// How long the attempt has taken so far.
    pub fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// What the job was given.
    ///
    /// # Errors
    /// [`JobError::GiveUp`] if it is not a `J`, or of a version that a `J` can't be made of: bad input, not a crash.
    pub(super) fn read<J: Job>(&self) -> Result<J, JobError> {
        let ClaimedJob { kind, payload, payload_version: version, .. } = &*self.job;
        let unreadable = |error: serde_json::Error| {
            let message =
                format!("the payload of this {kind} job cannot be read: {error}; start the run again");
            JobError::give_up(message, error)
        };
        if *version == J::VERSION {
            return J::deserialize(payload).map_err(unreadable);
        }
        let Some(upgraded) = J::upgrade(*version, payload.clone()) else {
            let message = format!(
                "this {kind} job was enqueued by another version of the program: its payload has version {version}, this \
                 one reads {}; start the run again",
                J::VERSION
            );
            return Err(JobError::give_up(message, format!("no upgrade from {version} to {}", J::VERSION)));
        };
        J::deserialize(upgraded).map_err(unreadable)
    }

    /// Tells the user how far the job is: 0 to 1, and a phrase. Cheap enough for every frame: only the
    /// newest is sent, a few times a second.
    pub fn progress(&self, fraction: f64, phrase: impl Into<String>) {
        *lock(&self.held.progress) = Some((clamp(fraction), phrase.into()));
        self.held.progressed.notify_one();
    }

    /// Whether to stop: the run was cancelled, the lease was lost, or the worker shuts down and its grace
    /// is over. For work on other threads.
    pub fn is_cancelled(&self) -> bool {
        self.held.stop.is_cancelled()
    }

    /// Resolves when it is time to stop.
    pub async fn cancelled(&self) {
        self.held.stop.cancelled().await;
    }

    /// `job.check()?` stops the handler when it is time to.
    ///
    /// # Errors
    /// [`JobError::Stopped`].
    pub fn check(&self) -> Result<(), JobError> {
        if self.is_cancelled() { Err(JobError::Stopped) } else { Ok(()) }
    }
}

/// Why a handler is stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    Cancelled,
    LeaseLost,
    Shutdown,
}

/// A lease that this worker holds.
pub(super) struct Held {
    pub(super) lease: Lease,
    pub(super) stop: CancellationToken,
    reason: OnceLock<Stop>,
    progress: Mutex<Option<(f64, String)>>,
    /// Shared by all of a worker.
    progressed: Arc<Notify>,
}

impl Held {
    /// Tells the handler to stop. The first reason counts.
    pub(super) fn stop(&self, reason: Stop) {
        self.reason.get_or_init(|| reason);
        self.stop.cancel();
    }

    pub(super) fn stopped(&self) -> Option<Stop> {
        self.reason.get().copied()
    }

    pub(super) fn take_progress(&self) -> Option<(f64, String)> {
        lock(&self.progress).take()
    }

    /// What could not be sent is sent with the next beat, unless there is something newer by then.
    pub(super) fn put_back_progress(&self, unsent: Option<(f64, String)>) {
        let mut progress = lock(&self.progress);
        if progress.is_none() {
            *progress = unsent;
        }
    }

    pub(super) fn has_progress(&self) -> bool {
        lock(&self.progress).is_some()
    }
}

/// All leases that a worker holds.
#[derive(Default)]
pub(super) struct HeldJobs {
    // By claim and not by job: after a lost lease the same worker may get the job again.
    jobs: Mutex<HashMap<(JobId, LeaseNumber), Arc<Held>>>,
    /// Some job has new progress.
    pub(super) progressed: Arc<Notify>,
}

impl HeldJobs {
    pub(super) fn add(&self, lease: Lease) -> Arc<Held> {
        let held = Arc::new(Held {
            lease,
            stop: CancellationToken::new(),
            reason: OnceLock::new(),
            progress: Mutex::new(None),
            progressed: self.progressed.clone(),
        });
        lock(&self.jobs).insert((lease.job_id, lease.lease_number), held.clone());
        held
    }

    pub(super) fn remove(&self, lease: &Lease) {
        lock(&self.jobs).remove(&(lease.job_id, lease.lease_number));
    }

    pub(super) fn all(&self) -> Vec<Arc<Held>> {
        lock(&self.jobs).values().cloned().collect()
    }
}

/// A panic of someone who held the lock leaves nothing half-done in what we keep under one.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
