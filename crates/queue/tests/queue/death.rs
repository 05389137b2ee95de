//! Workers that die.

use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use queue::{ChildJob, Outcome, RetryPolicy, RunState, Worker};
use serde_json::json;
use sqlx::PgPool;
use sqlx::postgres::PgConnectOptions;
use tokio_util::sync::CancellationToken;

use crate::support::{Chunk, Held, Nothing, Poison, Queue, does, job, jobs, quick, succeeds, wait_until};

/// Tells the child process of a test where the queue is.
const CHILD_DATABASE: &str = "QUEUE_TEST_CHILD_DATABASE";

/// This test binary again, running only [`child_that_works`].
fn start_child(queue: &Queue) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "death::child_that_works", "--nocapture"])
        .env(CHILD_DATABASE, queue.database.url())
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

/// Not a test by itself: a worker process that takes jobs and never ends them, or dies of them.
#[tokio::test]
async fn child_that_works() {
    let Ok(url) = std::env::var(CHILD_DATABASE) else { return };
    let options: PgConnectOptions = url.parse().unwrap();
    let pool = PgPool::connect_with(options).await.unwrap();
    let endless = does(Chunk, async |_| std::future::pending().await);
    let poison = does(Poison, async |_| std::process::abort());
    let worker = quick(Worker::builder(pool)).name("child").handler(endless).handler(poison).concurrency(4);
    worker.start(CancellationToken::new()).stopped().await;
}

#[tokio::test]
async fn jobs_of_a_process_that_is_killed_go_to_another() {
    let queue = Queue::new().await;
    queue.set_staleness(Duration::from_secs(2)).await;
    let (run_id, ids) = queue.run(&jobs(Chunk, 3)).await;
    let mut child = start_child(&queue);
    for id in &ids {
        queue.wait_for_job(*id, "running").await;
        assert_eq!(queue.job(*id, "leased_by").await, "child");
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let _worker = queue.worker().handler(succeeds(Chunk)).start(CancellationToken::new());
    queue.wait_for_run(run_id, RunState::Succeeded).await;
    for id in ids {
        assert_eq!(
            (queue.job(id, "attempts").await, queue.job(id, "lease_number").await),
            ("2".into(), "2".into())
        );
    }
}

#[tokio::test]
async fn a_job_that_kills_every_worker_ends_as_failed_with_that_reason() {
    let queue = Queue::new().await;
    queue.set_staleness(Duration::from_secs(1)).await;
    let (run_id, ids) = queue.run(&[ChildJob { max_attempts: 2, ..job(Poison, json!(null)) }]).await;
    // Only reaps.
    let _worker = queue.worker().handler(succeeds(Nothing)).start(CancellationToken::new());
    for attempt in 1..=2 {
        let status = start_child(&queue).wait().unwrap();
        assert!(!status.success(), "attempt {attempt} kills its process");
    }
    let status = queue.wait_for_run(run_id, RunState::Failed).await;
    let message = status.error_message.unwrap();
    assert_eq!(message, "the process running this step died each time it was tried");
    assert!(status.error_detail.unwrap().contains("attempt 2 of 2"));
    assert_eq!(queue.job(ids[0], "attempts").await, "2");
}

#[tokio::test]
async fn a_worker_that_is_dropped_loses_its_jobs_to_another() {
    let queue = Queue::new().await;
    queue.set_staleness(Duration::from_secs(1)).await;
    let runs = Arc::new(AtomicUsize::new(0));
    let counted = runs.clone();
    let handler = does(Chunk, move |job| {
        counted.fetch_add(1, Ordering::SeqCst);
        async move {
            if job.attempt() == 1 {
                std::future::pending::<()>().await;
            }
            Ok(Outcome::default())
        }
    });
    let (run_id, _) = queue.run(&jobs(Chunk, 1)).await;
    let first = queue.worker().handler(handler.clone()).start(CancellationToken::new());
    wait_until("the first attempt", async || (runs.load(Ordering::SeqCst) == 1).then_some(())).await;
    first.abort();
    let _second = queue.worker().handler(handler).start(CancellationToken::new());
    queue.wait_for_run(run_id, RunState::Succeeded).await;
    assert_eq!(runs.load(Ordering::SeqCst), 2);
}

#[tokio::test]
async fn a_flagged_job_whose_worker_died_is_cancelled_by_the_reaper() {
    let queue = Queue::new().await;
    queue.set_staleness(Duration::from_millis(250)).await;
    let (run_id, ids) = queue.run(&jobs(Chunk, 1)).await;
    queue.claim("chunk", 1).await;
    queue.cancel(run_id).await;
    let _worker = queue.worker().handler(succeeds(Nothing)).start(CancellationToken::new());
    queue.wait_for_job(ids[0], "cancelled").await;
}

#[tokio::test]
async fn one_bad_row_does_not_block_the_sweep() {
    let queue = Queue::new().await;
    let (_, ids) = queue.run(&jobs(Chunk, 5)).await;
    assert_eq!(queue.claim("chunk", 9).await.len(), 5);
    // Nobody can write the first; someone holds the run of another for ever.
    queue
        .execute(
            "CREATE FUNCTION refuse() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN RAISE 'bad row'; END $$;",
        )
        .await
        .unwrap();
    queue
        .execute(format!(
            "CREATE TRIGGER refuse BEFORE UPDATE ON jobs FOR EACH ROW WHEN (OLD.id = {} AND NEW.state <> 'running') \
             EXECUTE FUNCTION refuse()",
            ids[0]
        ))
        .await
        .unwrap();
    let (held_run, held) = queue.run(&jobs(Held, 1)).await;
    queue.claim("held", 1).await;
    let mut holder = queue.pool.begin().await.unwrap();
    sqlx::query("SELECT FROM runs WHERE id = $1 FOR UPDATE")
        .bind(held_run)
        .execute(&mut *holder)
        .await
        .unwrap();

    queue.set_staleness(Duration::from_millis(250)).await;
    queue.execute("UPDATE jobs SET heartbeat_at = '2000-01-01'").await.unwrap();
    tokio::time::sleep(Duration::from_millis(300)).await;
    let mut connection = queue.pool.acquire().await.unwrap();
    let reaped = queue::reap(&mut connection, &RetryPolicy::default()).await.unwrap();
    let reaped: Vec<_> = reaped.into_iter().map(|reaped| reaped.job_id).collect();
    assert_eq!(reaped, ids[1..]);
    assert_eq!(queue.job(ids[0], "state").await, "running");
    assert_eq!(queue.job(held[0], "state").await, "running");
}

#[tokio::test]
async fn after_a_start_of_the_server_workers_get_the_staleness_to_be_heard_again() {
    let queue = Queue::new().await;
    queue.set_staleness(Duration::from_secs(3600)).await;
    queue.run(&jobs(Chunk, 1)).await;
    queue.claim("chunk", 1).await;
    queue.execute("UPDATE jobs SET heartbeat_at = '2000-01-01'").await.unwrap();
    let mut connection = queue.pool.acquire().await.unwrap();
    assert!(queue::reap(&mut connection, &RetryPolicy::default()).await.unwrap().is_empty());
}
