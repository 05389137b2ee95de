//! Prints how soon an enqueued job starts and how many jobs a second go through.
//!
//! `cargo bench -p queue`. On a throw-away PostgreSQL on this machine without fsync, so: the cost of the
//! queue, not of a disk.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use queue::{
    ChildJob, Handler, Job, JobContext, JobError, NewRun, Outcome, ProjectId, RunId, RunState, Worker,
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use sqlx::PgPool;
use testkit::postgres::TestDatabase;
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

const LATENCY_JOBS: usize = 500;
const THROUGHPUT_JOBS: usize = 10_000;
const WORKERS: usize = 4;
const SLOTS: usize = 8;

/// A job that is waited for.
#[derive(Serialize, Deserialize)]
struct Latency(usize);

impl Job for Latency {
    const KIND: &'static str = "latency";
}

/// One of many jobs.
#[derive(Serialize, Deserialize)]
struct Throughput(usize);

impl Job for Throughput {
    const KIND: &'static str = "throughput";
}

/// Tells when it was started.
struct Starts(mpsc::UnboundedSender<Instant>);

impl Handler for Starts {
    type Job = Latency;

    async fn run(&self, _context: JobContext, _job: Latency) -> Result<Outcome, JobError> {
        self.0.send(Instant::now()).map_err(JobError::retry)?;
        Ok(Outcome::default())
    }
}

/// Does nothing.
struct Nothing(Arc<Mutex<usize>>);

impl Handler for Nothing {
    type Job = Throughput;

    async fn run(&self, _context: JobContext, _job: Throughput) -> Result<Outcome, JobError> {
        *self.0.lock().map_err(JobError::retry)? += 1;
        Ok(Outcome::default())
    }
}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let database = TestDatabase::new().await?;
    let pool = database.pool();
    latency(&pool).await?;
    throughput(&pool).await?;
    Ok(())
}

async fn enqueue<J: Job>(
    pool: &PgPool,
    job: fn(usize) -> J,
    count: usize,
) -> Result<RunId, Box<dyn std::error::Error>> {
    let mut transaction = pool.begin().await?;
    let project_id = ProjectId(Uuid::new_v4());
    let run = NewRun { project_id, kind: "bench", session_id: None, parameters: json!({}) };
    let run_id = queue::enqueue_run(&mut transaction, &run).await?;
    let jobs: Result<Vec<_>, _> = (0..count).map(|index| ChildJob::new(&job(index))).collect();
    queue::enqueue_many(&mut transaction, run_id, &jobs?).await?;
    transaction.commit().await?;
    Ok(run_id)
}

async fn latency(pool: &PgPool) -> Result<(), Box<dyn std::error::Error>> {
    #[expect(clippy::disallowed_methods, reason = "holds one number a job, of which there is a fixed number")]
    let (starts, mut started) = mpsc::unbounded_channel();
    let shutdown = CancellationToken::new();
    let worker =
        Worker::builder(pool.clone()).handler(Starts(starts)).concurrency(SLOTS).start(shutdown.clone());
    let mut millis = Vec::new();
    // The first few find the worker still connecting.
    for round in 0..LATENCY_JOBS + 20 {
        let enqueued = Instant::now();
        enqueue(pool, Latency, 1).await?;
        let start = started.recv().await.ok_or("the worker stopped")?;
        if round >= 20 {
            millis.push(start.duration_since(enqueued).as_secs_f64() * 1e3);
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    millis.sort_by(f64::total_cmp);
    let quantile = |share: f64| millis[((millis.len() - 1) as f64 * share).round() as usize];
    println!(
        "enqueue to start, commit included, 1 worker idle: p50 {:.2} ms, p95 {:.2} ms, max {:.2} ms ({} jobs)",
        quantile(0.5),
        quantile(0.95),
        quantile(1.0),
        millis.len()
    );
    shutdown.cancel();
    worker.stopped().await;
    Ok(())
}

async fn throughput(pool: &PgPool) -> Result<(), Box<dyn std::error::Error>> {
    let began = Instant::now();
    let mut runs = Vec::new();
    for _ in 0..WORKERS {
        runs.push(enqueue(pool, Throughput, THROUGHPUT_JOBS / WORKERS).await?);
    }
    println!("enqueue in batches: {:.0} jobs/s", THROUGHPUT_JOBS as f64 / began.elapsed().as_secs_f64());
    let done = Arc::new(Mutex::new(0));
    let shutdown = CancellationToken::new();
    let began = Instant::now();
    let workers: Vec<_> = (0..WORKERS)
        .map(|_| {
            let worker = Worker::builder(pool.clone()).handler(Nothing(done.clone()));
            worker.concurrency(SLOTS).start(shutdown.clone())
        })
        .collect();
    for run in runs {
        let mut connection = pool.acquire().await?;
        while queue::run_status(&mut connection, run).await?.map(|run| run.state) != Some(RunState::Succeeded)
        {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
    let elapsed = began.elapsed();
    println!(
        "claim, run, complete: {:.0} jobs/s ({THROUGHPUT_JOBS} jobs, {WORKERS} workers with {SLOTS} slots)",
        THROUGHPUT_JOBS as f64 / elapsed.as_secs_f64()
    );
    shutdown.cancel();
    for worker in workers {
        worker.stopped().await;
    }
    Ok(())
}
