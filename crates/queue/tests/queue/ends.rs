//! How jobs and runs end.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};
use std::time::{Duration, Instant};

use queue::{JobError, Outcome, RunState};
use serde_json::json;
use tokio_util::sync::CancellationToken;

use crate::support::{Chunk, Cursed, Hopeless, Merge, Patient, Queue, does, job, jobs, succeeds};

#[tokio::test]
async fn a_run_that_is_cancelled_while_queued_never_runs() {
    let queue = Queue::new().await;
    let merge = job(Chunk, json!(null)).depends_on([0]);
    let (run_id, ids) = queue.run(&[jobs(Chunk, 1), vec![merge]].concat()).await;
    assert_eq!(queue.cancel(run_id).await, RunState::Cancelled);
    assert!(queue.claim("chunk", 9).await.is_empty());
    for id in ids {
        assert_eq!(queue.job(id, "state").await, "cancelled");
    }
}

#[tokio::test]
async fn a_cancel_reaches_a_running_job_within_two_heartbeats_and_drops_its_result() {
    let queue = Queue::new().await;
    queue.set_staleness(Duration::from_secs(5)).await;
    let handler = does(Chunk, async |job| {
        // On a thread of its own, as real work is.
        tokio::task::spawn_blocking(move || {
            while !job.is_cancelled() {
                std::thread::sleep(Duration::from_millis(1));
            }
        })
        .await
        .map_err(JobError::retry)?;
        Ok(Outcome::default().children(jobs(Chunk, 1)))
    });
    let (run_id, ids) = queue.run(&jobs(Chunk, 1)).await;
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    queue.wait_for_job(ids[0], "running").await;
    let began = Instant::now();
    queue.cancel(run_id).await;
    queue.wait_for_job(ids[0], "cancelled").await;
    let took = began.elapsed();
    assert!(took < Duration::from_secs(2), "{took:?}, two heartbeats are 2 s");
    let children: i64 = sqlx::query_scalar("SELECT count(*) FROM jobs").fetch_one(&queue.pool).await.unwrap();
    assert_eq!(children, 1, "nothing that it handed in is kept");
}

#[tokio::test]
async fn a_handler_that_ignores_the_cancel_is_left_behind() {
    let queue = Queue::new().await;
    let handler = does(Chunk, async |_| std::future::pending().await);
    let (run_id, ids) = queue.run(&jobs(Chunk, 1)).await;
    let worker = queue.worker().handler(handler).patience(Duration::from_millis(50));
    let _worker = worker.start(CancellationToken::new());
    queue.wait_for_job(ids[0], "running").await;
    queue.cancel(run_id).await;
    queue.wait_for_job(ids[0], "cancelled").await;
}

#[tokio::test]
async fn a_job_whose_attempts_are_used_up_fails_its_run_and_cancels_the_rest() {
    let queue = Queue::new().await;
    let tries = Arc::new(AtomicI32::new(0));
    let counted = tries.clone();
    let handler = does(Chunk, move |job| {
        counted.fetch_max(job.attempt(), Ordering::SeqCst);
        async { Err(JobError::retry("the store does not answer")) }
    });
    let merge = job(Merge, json!(null)).depends_on([0]);
    let (run_id, ids) = queue.run(&[jobs(Chunk, 1), vec![merge]].concat()).await;
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    let status = queue.wait_for_run(run_id, RunState::Failed).await;
    assert_eq!(tries.load(Ordering::SeqCst), queue::DEFAULT_MAX_ATTEMPTS);
    assert_eq!(status.error_detail.as_deref(), Some("the store does not answer"));
    assert_eq!(queue.job(ids[0], "state").await, "failed");
    assert_eq!(queue.job(ids[1], "state").await, "cancelled");
}

#[tokio::test]
async fn a_panic_is_a_failed_attempt_and_the_worker_goes_on() {
    let queue = Queue::new().await;
    let handler = does(Chunk, async |job| {
        assert!(job.attempt() > 1, "stumbled over frame 12");
        Ok(Outcome::default())
    });
    let always = does(Cursed, async |_| panic!("frame 13"));
    let worker = queue.worker().handler(handler).handler(always).start(CancellationToken::new());
    let (run_id, ids) = queue.run(&jobs(Chunk, 1)).await;
    queue.wait_for_run(run_id, RunState::Succeeded).await;
    assert_eq!(queue.job(ids[0], "attempts").await, "2");
    assert!(queue.job(ids[0], "error_detail").await.contains("stumbled over frame 12"));
    let (cursed, _) = queue.run(&jobs(Cursed, 1)).await;
    let status = queue.wait_for_run(cursed, RunState::Failed).await;
    assert_eq!(status.error_detail.as_deref(), Some("panicked: frame 13"));
    assert!(worker.is_connected());
}

#[tokio::test]
async fn bad_input_fails_at_once_with_the_message_for_the_user() {
    let queue = Queue::new().await;
    let handler =
        does(Chunk, async |_| Err(JobError::give_up("line 7: frame 3 is missing", "in \0 markers.csv")));
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    let (run_id, ids) = queue.run(&jobs(Chunk, 1)).await;
    let status = queue.wait_for_run(run_id, RunState::Failed).await;
    assert_eq!(status.error_message.as_deref(), Some("line 7: frame 3 is missing"));
    assert_eq!(queue.job(ids[0], "attempts").await, "1");
}

#[tokio::test]
async fn a_failing_job_flags_those_of_its_run_that_run() {
    let queue = Queue::new().await;
    let patient = does(Patient, async |job| {
        job.cancelled().await;
        Err(JobError::Stopped)
    });
    let (run_id, ids) = queue.run(&[jobs(Patient, 3), jobs(Hopeless, 1)].concat()).await;
    let _worker = queue.worker().handler(patient).concurrency(3).start(CancellationToken::new());
    for id in &ids[..3] {
        queue.wait_for_job(*id, "running").await;
    }
    let hopeless = does(Hopeless, async |_| Err(JobError::give_up("no", "")));
    let _other = queue.worker().handler(hopeless).start(CancellationToken::new());
    queue.wait_for_run(run_id, RunState::Failed).await;
    for id in &ids[..3] {
        queue.wait_for_job(*id, "cancelled").await;
    }
}

#[tokio::test]
async fn progress_of_a_run_is_the_mean_of_its_jobs_by_weight_with_the_newest_phrase() {
    let queue = Queue::new().await;
    let handler = does(Chunk, async |job| {
        job.progress(0.1, "opening");
        job.progress(0.5, "frame 60 of 120");
        job.cancelled().await;
        Err(JobError::Stopped)
    });
    let heavy = job(Chunk, json!(null)).weight(3.0);
    let light = job(Merge, json!(null)).weight(1.0);
    let (run_id, _) = queue.run(&[heavy, light]).await;
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    crate::support::wait_until("progress 0.375", async || {
        let status = queue.status(run_id).await;
        (status.progress == 0.375 && status.phrase == "frame 60 of 120").then_some(())
    })
    .await;
}

#[tokio::test]
async fn a_run_whose_jobs_have_all_succeeded_has_succeeded() {
    let queue = Queue::new().await;
    let (run_id, _) = queue.run(&jobs(Chunk, 5)).await;
    let _worker = queue.worker().handler(succeeds(Chunk)).concurrency(2).start(CancellationToken::new());
    let status = queue.wait_for_run(run_id, RunState::Succeeded).await;
    assert_eq!(status.progress, 1.0);
    assert!(status.started_at.unwrap() <= status.finished_at.unwrap());
}
