//! What a service implements to run one kind of job.

use futures::future::BoxFuture;
use sqlx::PgConnection;

use super::context::JobContext;
use crate::{Artefact, ChildJob, Job, JobError, OnComplete};

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
    type Job: Job;

    /// Runs one attempt at a job.
    fn run(
        &self,
        context: JobContext,
        job: Self::Job,
    ) -> impl Future<Output = Result<Outcome, JobError>> + Send;
}

/// [`Handler`] as a trait object, whatever its kind of job.
pub(super) trait DynHandler: Send + Sync + 'static {
    fn run(&self, context: JobContext) -> BoxFuture<'_, Result<Outcome, JobError>>;
}

impl<H: Handler> DynHandler for H {
    fn run(&self, context: JobContext) -> BoxFuture<'_, Result<Outcome, JobError>> {
        Box::pin(async move {
            let job = context.read()?;
            Handler::run(self, context, job).await
        })
    }
}

/// What is done before every attempt at a job, whatever its kind.
pub(super) type BeforeAttempt = dyn Fn(JobContext) -> BoxFuture<'static, ()> + Send + Sync;

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

    /// The same outcome with more files.
    #[must_use]
    pub fn artefacts(mut self, artefacts: impl IntoIterator<Item = Artefact>) -> Self {
        self.artefacts.extend(artefacts);
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
