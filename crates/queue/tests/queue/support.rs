//! Runs, handlers and waiting.

use std::sync::Arc;
use std::time::Duration;

use futures::future::BoxFuture;
use queue::{
    ChildJob, ClaimedJob, Handler, JobContext, JobError, JobId, NewRun, Outcome, ProjectId, RetryPolicy,
    RunId, RunState, RunStatus, Worker, WorkerBuilder,
};
use serde_json::json;
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
    NewRun { project_id, kind: "reconstruction", session_id: None, parameters: json!({ "points": 6 }) }
}

pub fn jobs(kind: &str, count: usize) -> Vec<ChildJob> {
    (0..count).map(|index| ChildJob::new(kind, json!(index))).collect()
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

type Work = dyn Fn(JobContext) -> BoxFuture<'static, Result<Outcome, JobError>> + Send + Sync;

/// A handler from a closure.
#[derive(Clone)]
pub struct Does {
    kind: &'static str,
    work: Arc<Work>,
}

pub fn does<F>(kind: &'static str, work: impl Fn(JobContext) -> F + Send + Sync + 'static) -> Does
where
    F: Future<Output = Result<Outcome, JobError>> + Send + 'static,
{
    Does { kind, work: Arc::new(move |job| Box::pin(work(job))) }
}

impl Handler for Does {
    fn kind(&self) -> &'static str {
        self.kind
    }

    async fn run(&self, job: JobContext) -> Result<Outcome, JobError> {
        (self.work)(job).await
    }
}

/// A handler that has nothing to do.
pub fn succeeds(kind: &'static str) -> Does {
    does(kind, async |_| Ok(Outcome::default()))
}
