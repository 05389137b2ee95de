//! Stopping a worker.

use std::time::Duration;

use queue::{JobError, Outcome, RunState};
use tokio_util::sync::CancellationToken;

use crate::support::{Chunk, Deaf, Queue, Told, does, jobs, succeeds};

#[tokio::test]
async fn a_shutdown_lets_jobs_end_within_the_grace_and_claims_no_more() {
    let queue = Queue::new().await;
    let shutdown = CancellationToken::new();
    let seen = shutdown.clone();
    let (started, mut starts) = tokio::sync::mpsc::channel(2);
    let handler = does(Chunk, move |job| {
        let (seen, started) = (seen.clone(), started.clone());
        async move {
            started.send(()).await.map_err(JobError::retry)?;
            seen.cancelled().await;
            assert!(!job.is_cancelled(), "a shutdown is not a cancel");
            Ok(Outcome::default())
        }
    });
    let (_, ids) = queue.run(&jobs(Chunk, 3)).await;
    let worker = queue.worker().handler(handler).concurrency(2).start(shutdown.clone());
    for _ in 0..2 {
        starts.recv().await.expect("both slots are filled");
    }
    shutdown.cancel();
    worker.stopped().await;
    let mut states = Vec::new();
    for id in ids {
        states.push(queue.job(id, "state").await);
    }
    assert_eq!(states, ["succeeded", "succeeded", "available"]);
}

#[tokio::test]
async fn a_shutdown_hands_back_what_does_not_end_and_no_attempt_is_counted() {
    let queue = Queue::new().await;
    let told = does(Told, async |job| {
        job.cancelled().await;
        Err(JobError::Stopped)
    });
    let deaf = does(Deaf, async |_| std::future::pending().await);
    let (run_id, ids) = queue.run(&[jobs(Told, 1), jobs(Deaf, 1)].concat()).await;
    let shutdown = CancellationToken::new();
    let worker = queue.worker().handler(told).handler(deaf).concurrency(2);
    let worker = worker.grace(Duration::from_millis(50)).patience(Duration::from_millis(50));
    let worker = worker.start(shutdown.clone());
    for id in &ids {
        queue.wait_for_job(*id, "running").await;
    }
    shutdown.cancel();
    worker.stopped().await;
    for id in &ids {
        assert_eq!(
            (queue.job(*id, "state").await, queue.job(*id, "attempts").await),
            ("available".into(), "0".into())
        );
    }
    let next = queue.worker().handler(succeeds(Told)).handler(succeeds(Deaf));
    let _next = next.start(CancellationToken::new());
    queue.wait_for_run(run_id, RunState::Succeeded).await;
}

#[tokio::test]
async fn a_worker_that_never_reached_the_database_stops_at_once() {
    let options = sqlx::postgres::PgConnectOptions::new_without_pgpass().socket("/nonexistent");
    let pool = sqlx::postgres::PgPoolOptions::new().connect_lazy_with(options);
    let shutdown = CancellationToken::new();
    let worker = queue::Worker::builder(pool).handler(succeeds(Chunk)).start(shutdown.clone());
    assert!(!worker.is_connected());
    shutdown.cancel();
    tokio::time::timeout(Duration::from_secs(5), worker.stopped()).await.expect("a prompt stop");
}
