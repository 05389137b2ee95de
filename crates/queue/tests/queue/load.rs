//! Many jobs, many workers, and a database that goes away.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use queue::{ChildJob, JobContext, JobId, Outcome, RunState};
use serde_json::json;
use testkit::postgres::TestDatabase;
use tokio_util::sync::CancellationToken;

use crate::support::{Chunk, Does, Queue, does, job, jobs};

type Counts = Arc<Mutex<HashMap<JobId, usize>>>;

fn counting(counts: &Counts) -> Does<Chunk> {
    let counts = counts.clone();
    does(Chunk, move |job: JobContext| {
        *counts.lock().unwrap().entry(job.id()).or_default() += 1;
        async { Ok(Outcome::default()) }
    })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn ten_thousand_jobs_and_sixteen_workers_do_each_job_exactly_once() {
    let queue = Queue::new().await;
    let mut runs = Vec::new();
    for _ in 0..20 {
        runs.push(queue.run(&jobs(Chunk, 500)).await.0);
    }
    let counts = Counts::default();
    let shutdown = CancellationToken::new();
    let began = Instant::now();
    let workers: Vec<_> = (0..16)
        .map(|_| queue.worker().handler(counting(&counts)).concurrency(4).start(shutdown.clone()))
        .collect();
    for run in runs {
        queue.wait_for_run(run, RunState::Succeeded).await;
    }
    println!("10,000 jobs, 16 workers: {:?}", began.elapsed());
    shutdown.cancel();
    for worker in workers {
        worker.stopped().await;
    }
    let counts = counts.lock().unwrap();
    assert_eq!(counts.len(), 10_000);
    assert!(counts.values().all(|count| *count == 1));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_database_that_crashes_under_load_loses_no_job_and_no_worker() {
    let queue = Queue::on(TestDatabase::in_own_cluster().await.unwrap());
    let handler = does(Chunk, async |job| {
        for step in 0..10 {
            job.progress(f64::from(step) / 10.0, "working");
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        Ok(Outcome::default())
    });
    let mut chunks: Vec<_> =
        jobs(Chunk, 600).into_iter().map(|job| ChildJob { max_attempts: 10, ..job }).collect();
    chunks.push(job(Chunk, json!(null)).depends_on(0..600));
    let (run_id, _) = queue.run(&chunks).await;
    let shutdown = CancellationToken::new();
    let workers: Vec<_> = (0..3)
        .map(|_| queue.worker().handler(handler.clone()).concurrency(4).start(shutdown.clone()))
        .collect();
    for share in [0.1, 0.4] {
        crate::support::wait_until("progress", async || {
            (queue.status(run_id).await.progress > share).then_some(())
        })
        .await;
        queue.database.restart_immediate().await.unwrap();
    }
    let status = queue.wait_for_run(run_id, RunState::Succeeded).await;
    assert_eq!(status.progress, 1.0);
    let unfinished: i64 = sqlx::query_scalar("SELECT count(*) FROM jobs WHERE state <> 'succeeded'")
        .fetch_one(&queue.pool)
        .await
        .unwrap();
    assert_eq!(unfinished, 0);
    assert!(workers.iter().all(|worker| worker.is_connected()));
    shutdown.cancel();
    for worker in workers {
        worker.stopped().await;
    }
}
