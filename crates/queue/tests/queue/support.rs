//! Runs, handlers and waiting.

use std::sync::Arc;
use std::time::Duration;

use futures::future::BoxFuture;
use queue::{
    ChildJob, ClaimedJob, Handler, Job, JobContext, JobError, JobId, NewRun, Outcome, ProjectId, RetryPolicy,
    RunId, RunState, RunStatus, Worker, WorkerBuilder,
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sqlx::{AssertSqlSafe, PgPool};
use testkit::postgres::TestDatabase;
use uuid::Uuid;

/// Nothing that is waited for takes longer, even on a busy machine.
pub const DEADLINE: Duration = Duration::from_secs(60);

pub struct Queue {
    pub database: TestDatabase,
    pub pool: PgPool,
    pub project: ProjectId,
}

impl Queue {
    pub async fn new() -> Self {
        Self::on(TestDatabase::new().await.unwrap())
    }

    pub fn on(database: TestDatabase) -> Self {
        let pool = database.pool();
        Self { database, pool, project: ProjectId(Uuid::new_v4()) }
    }

    pub async fn run(&self, jobs: &[ChildJob]) -> (RunId, Vec<JobId>) {
        self.run_of(self.project, jobs).await
    }

    pub async fn run_of(&self, project_id: ProjectId, jobs: &[ChildJob]) -> (RunId, Vec<JobId>) {
        let mut transaction = self.pool.begin().await.unwrap();
        let run = new_run(project_id);
        let run_id = queue::enqueue_run(&mut transaction, &run).await.unwrap();
        let ids = queue::enqueue_many(&mut transaction, run_id, jobs).await.unwrap();
        transaction.commit().await.unwrap();
        (run_id, ids)
    }

    pub async fn claim(&self, kind: &str, limit: usize) -> Vec<ClaimedJob> {
        let mut connection = self.pool.acquire().await.unwrap();
        queue::claim(&mut connection, "tester", &[kind], limit).await.unwrap()
    }

    pub async fn status(&self, run_id: RunId) -> RunStatus {
        let mut connection = self.pool.acquire().await.unwrap();
        queue::run_status(&mut connection, run_id).await.unwrap().unwrap()
    }

    pub async fn set_staleness(&self, staleness: Duration) {
        let mut connection = self.pool.acquire().await.unwrap();
        queue::set_staleness(&mut connection, staleness).await.unwrap();
    }

    pub async fn cancel(&self, run_id: RunId) -> RunState {
        let mut connection = self.pool.acquire().await.unwrap();
        queue::cancel_run(&mut connection, run_id).await.unwrap()
    }

    pub async fn execute(&self, statement: impl Into<String>) -> Result<u64, sqlx::Error> {
        let statement = AssertSqlSafe(statement.into());
        Ok(sqlx::query(statement).execute(&self.pool).await?.rows_affected())
    }

    /// One column of the job's row, as text.
    pub async fn job(&self, id: JobId, column: &str) -> String {
        let query = AssertSqlSafe(format!("SELECT coalesce({column}::text, '-') FROM jobs WHERE id = $1"));
        sqlx::query_scalar(query).bind(id).fetch_one(&self.pool).await.unwrap()
    }

    pub async fn wait_for_run(&self, run_id: RunId, state: RunState) -> RunStatus {
        wait_until(&format!("run in state {state}"), async || {
            let mut connection = self.pool.acquire().await.ok()?;
            let status = queue::run_status(&mut connection, run_id).await.ok()??;
            assert!(
                status.state == state || !status.state.is_finished(),
                "run ended {}, expected {state}: {:?} {:?}",
                status.state,
                status.error_message,
                status.error_detail
            );
            (status.state == state).then_some(status)
        })
        .await
    }

    pub async fn wait_for_job(&self, id: JobId, state: &str) {
        wait_until(&format!("job {id} in state {state}"), async || {
            (self.job(id, "state").await == state).then_some(())
        })
        .await;
    }

    /// A worker that retries and polls fast.
    pub fn worker(&self) -> WorkerBuilder {
        quick(Worker::builder(self.pool.clone()))
    }
}

pub fn quick(builder: WorkerBuilder) -> WorkerBuilder {
    let retry = RetryPolicy { base: Duration::from_millis(10), max: Duration::from_millis(100) };
    builder.retry(retry).poll_interval(Duration::from_millis(200))
}

pub fn new_run(project_id: ProjectId) -> NewRun<'static> {
    NewRun { project_id, kind: "sparse", session_id: None, parameters: json!({ "points": 6 }) }
}

/// Kinds of jobs that are given whatever a test likes.
macro_rules! kinds {
    ($($name:ident = $kind:literal),+ $(,)?) => {$(
        #[derive(Clone, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub Value);

        impl Job for $name {
            const KIND: &'static str = $kind;
        }
    )+};
}

kinds! {
    Build = "build",
    Chunk = "chunk",
    Cursed = "cursed",
    Deaf = "deaf",
    Held = "held",
    Hopeless = "hopeless",
    Late = "late",
    Merge = "merge",
    Nothing = "nothing",
    Patient = "patient",
    Plan = "plan",
    Poison = "poison",
    Told = "told",
}

pub fn job<J: Job>(kind: fn(Value) -> J, payload: Value) -> ChildJob {
    ChildJob::new(&kind(payload)).unwrap()
}

pub fn jobs<J: Job>(kind: fn(Value) -> J, count: usize) -> Vec<ChildJob> {
    (0..count).map(|index| job(kind, json!(index))).collect()
}

/// Looks again and again, for what no barrier tells.
pub async fn wait_until<T>(what: &str, look: impl AsyncFn() -> Option<T>) -> T {
    let waiting = async {
        loop {
            if let Some(found) = look().await {
                return found;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    match tokio::time::timeout(DEADLINE, waiting).await {
        Ok(found) => found,
        Err(_) => panic!("{what} did not come within {DEADLINE:?}"),
    }
}

type Work<J> = dyn Fn(JobContext, J) -> BoxFuture<'static, Result<Outcome, JobError>> + Send + Sync;

/// A handler from a closure.
pub struct Does<J> {
    work: Arc<Work<J>>,
}

impl<J> Clone for Does<J> {
    fn clone(&self) -> Self {
        Self { work: self.work.clone() }
    }
}

/// A handler that looks at what it is given.
pub fn reads<J: Job, F>(work: impl Fn(JobContext, J) -> F + Send + Sync + 'static) -> Does<J>
where
    F: Future<Output = Result<Outcome, JobError>> + Send + 'static,
{
    Does { work: Arc::new(move |context, job| Box::pin(work(context, job))) }
}

pub fn does<J: Job, F>(
    _kind: fn(Value) -> J,
    work: impl Fn(JobContext) -> F + Send + Sync + 'static,
) -> Does<J>
where
    F: Future<Output = Result<Outcome, JobError>> + Send + 'static,
{
    reads(move |context, _| work(context))
}

impl<J: Job> Handler for Does<J> {
    type Job = J;

    async fn run(&self, context: JobContext, job: J) -> Result<Outcome, JobError> {
        (self.work)(context, job).await
    }
}

/// A handler that has nothing to do.
pub fn succeeds<J: Job>(kind: fn(Value) -> J) -> Does<J> {
    does(kind, async |_| Ok(Outcome::default()))
}
