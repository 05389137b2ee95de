//! The worker: claims jobs of some kinds, runs them and keeps their leases.

mod attempt;
mod claimer;
mod context;
mod handler;
mod keeper;
mod link;
mod listener;
mod shared;

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use futures::future::BoxFuture;
use sqlx::PgPool;
use tokio::sync::{Notify, watch};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

pub use context::JobContext;
pub use handler::{Handler, Outcome};

use crate::{Job, RetryPolicy};
use context::HeldJobs;
use handler::{BeforeAttempt, DynHandler};
use shared::{Shared, Wake};

/// Entrance to [`WorkerBuilder`].
pub struct Worker;

impl Worker {
    /// A worker on this pool. Completions use the pool; claiming, beating and listening use three
    /// connections of their own with the same options, so that handlers cannot starve them.
    pub fn builder(pool: PgPool) -> WorkerBuilder {
        WorkerBuilder {
            pool,
            name: format!("worker-{}", Uuid::now_v7()),
            handlers: HashMap::new(),
            before_attempt: None,
            concurrency: 1,
            poll_interval: Duration::from_secs(1),
            grace: Duration::from_secs(10),
            patience: Duration::from_secs(2),
            retry: RetryPolicy::default(),
        }
    }
}

/// Sets a worker up.
pub struct WorkerBuilder {
    pool: PgPool,
    name: String,
    handlers: HashMap<&'static str, Arc<dyn DynHandler>>,
    before_attempt: Option<Arc<BeforeAttempt>>,
    concurrency: usize,
    poll_interval: Duration,
    grace: Duration,
    patience: Duration,
    retry: RetryPolicy,
}

impl WorkerBuilder {
    /// Runs jobs of this handler's kind; a later handler of a kind replaces an earlier one.
    #[must_use]
    pub fn handler<H: Handler>(mut self, handler: H) -> Self {
        self.handlers.insert(H::Job::KIND, Arc::new(handler));
        self
    }

    /// Does this before every attempt at a job, whatever its kind, as a part of the attempt.
    #[must_use]
    pub fn before_attempt(
        mut self,
        before: impl Fn(JobContext) -> BoxFuture<'static, ()> + Send + Sync + 'static,
    ) -> Self {
        self.before_attempt = Some(Arc::new(before));
        self
    }

    /// How many jobs run at once. Default 1.
    #[must_use]
    pub fn concurrency(mut self, jobs: usize) -> Self {
        self.concurrency = jobs.max(1);
        self
    }

    /// The name in the rows of the jobs that it holds, for people. Default is a random one.
    #[must_use]
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// How often to look without being woken. Default 1 s: a lost notification costs no more.
    #[must_use]
    pub fn poll_interval(mut self, interval: Duration) -> Self {
        self.poll_interval = interval;
        self
    }

    /// How long jobs may go on after the shutdown began, before they are handed back. Default 10 s.
    #[must_use]
    pub fn grace(mut self, grace: Duration) -> Self {
        self.grace = grace;
        self
    }

    /// How long a handler that was told to stop may take to do so, before it is left behind. Default 2 s.
    #[must_use]
    pub fn patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
    }

    /// Waits between attempts.
    #[must_use]
    pub fn retry(mut self, policy: RetryPolicy) -> Self {
        self.retry = policy;
        self
    }

    /// Starts the worker on the current tokio runtime. It runs until `shutdown`, whatever happens to the
    /// database meanwhile; then it claims nothing more, gives its jobs the grace to end, hands the rest back
    /// and stops.
    pub fn start(self, shutdown: CancellationToken) -> WorkerHandle {
        let shared = Arc::new(Shared {
            pool: self.pool,
            name: self.name,
            handlers: self.handlers,
            before_attempt: self.before_attempt,
            concurrency: self.concurrency,
            poll_interval: self.poll_interval,
            grace: self.grace,
            patience: self.patience,
            retry: self.retry,
            shutdown,
            held: HeldJobs::default(),
            wake: Wake { available: Notify::new(), cancelled: Notify::new() },
            heartbeat_interval: watch::Sender::new(None),
            is_connected: AtomicBool::new(false),
        });
        let task = tokio::spawn(claimer::work(shared.clone()));
        WorkerHandle { shared, task }
    }
}

/// A worker that runs.
pub struct WorkerHandle {
    shared: Arc<Shared>,
    task: JoinHandle<()>,
}

impl WorkerHandle {
    /// Whether the database answered when it was last asked: ready to work.
    pub fn is_connected(&self) -> bool {
        self.shared.is_connected.load(Ordering::Relaxed)
    }

    /// How many jobs it holds now.
    pub fn jobs_held(&self) -> usize {
        self.shared.held.all().len()
    }

    /// Resolves when the worker has stopped: every job has ended or is handed back.
    pub async fn stopped(self) {
        if let Err(error) = self.task.await {
            tracing::error!(%error, "worker ended abnormally");
        }
    }

    /// Ends the worker at once, as if its process had died: nothing is handed back, leases run out.
    pub fn abort(self) {
        self.task.abort();
    }
}
