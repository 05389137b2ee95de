//! Who may write for a job.

use std::time::Duration;

use queue::{Beat, BeatAnswer, ClaimedJob, Completion, Failure, Lease, LeaseNumber, RetryPolicy, Settled};
use tokio_util::sync::CancellationToken;

use crate::support::{Chunk, Merge, Queue, does, jobs};

pub fn lease(job: &ClaimedJob) -> Lease {
    Lease { job_id: job.id, run_id: job.run_id, lease_number: job.lease_number }
}

fn beat(job: &ClaimedJob) -> Beat {
    Beat { job_id: job.id, lease_number: job.lease_number, progress: None }
}

/// Takes the job from its worker as the reaper would.
async fn lose_lease(queue: &Queue, job: &ClaimedJob) {
    queue.set_staleness(Duration::from_millis(250)).await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    queue.execute("UPDATE jobs SET heartbeat_at = '2000-01-01' WHERE state = 'running'").await.unwrap();
    let mut connection = queue.pool.acquire().await.unwrap();
    let policy = RetryPolicy { base: Duration::ZERO, max: Duration::ZERO };
    let reaped = queue::reap(&mut connection, &policy).await.unwrap();
    assert!(reaped.iter().any(|reaped| reaped.job_id == job.id && reaped.settled == Settled::Retrying));
}

#[tokio::test]
async fn two_workers_claim_one_row_and_one_gets_it() {
    let queue = Queue::new().await;
    for _ in 0..20 {
        queue.run(&jobs(Chunk, 1)).await;
        let (one, other) = tokio::join!(queue.claim("chunk", 1), queue.claim("chunk", 1));
        assert_eq!(one.len() + other.len(), 1);
    }
}

#[tokio::test]
async fn a_claim_takes_only_its_kinds_and_starts_the_run() {
    let queue = Queue::new().await;
    let (run_id, _) = queue.run(&jobs(Merge, 2)).await;
    assert!(queue.claim("chunk", 9).await.is_empty());
    assert_eq!(queue.status(run_id).await.state, queue::RunState::Queued);
    assert_eq!(queue.claim("merge", 1).await.len(), 1);
    assert_eq!(queue.status(run_id).await.state, queue::RunState::Running);
}

#[tokio::test]
async fn a_late_completion_after_a_lost_lease_is_dropped() {
    let queue = Queue::new().await;
    let (run_id, _) = queue.run(&jobs(Chunk, 1)).await;
    let late = queue.claim("chunk", 1).await.remove(0);
    lose_lease(&queue, &late).await;
    let current = queue.claim("chunk", 1).await.remove(0);
    assert_eq!((current.id, current.attempt), (late.id, 2));
    assert!(current.lease_number > late.lease_number);

    let mut connection = queue.pool.acquire().await.unwrap();
    let completion = Completion { children: &jobs(Merge, 1), ..Completion::default() };
    let settled = queue::complete(&mut connection, &lease(&late), &completion).await.unwrap();
    assert_eq!(settled, Settled::LeaseLost);
    let failure = Failure::GiveUp { message: "bad".into(), detail: String::new() };
    assert_eq!(queue::fail(&mut connection, &lease(&late), &failure).await.unwrap(), Settled::LeaseLost);
    assert_eq!(queue::hand_back(&mut connection, &lease(&late)).await.unwrap(), Settled::LeaseLost);
    assert_eq!(queue.job(current.id, "state").await, "running");

    let completion = Completion::default();
    let settled = queue::complete(&mut connection, &lease(&current), &completion).await.unwrap();
    assert_eq!(settled, Settled::Succeeded);
    assert_eq!(queue.status(run_id).await.state, queue::RunState::Succeeded);
}

#[tokio::test]
async fn completing_twice_says_succeeded_both_times_and_stores_once() {
    let queue = Queue::new().await;
    queue.run(&jobs(Chunk, 2)).await;
    let job = queue.claim("chunk", 1).await.remove(0);
    let children = jobs(Merge, 3);
    let completion = Completion { children: &children, ..Completion::default() };
    let mut connection = queue.pool.acquire().await.unwrap();
    for _ in 0..2 {
        let settled = queue::complete(&mut connection, &lease(&job), &completion).await.unwrap();
        assert_eq!(settled, Settled::Succeeded, "an answer lost on the way is asked for again");
    }
    assert_eq!(queue.claim("merge", 9).await.len(), 3);
}

#[tokio::test]
async fn a_heartbeat_tells_held_lost_and_cancelled_leases_apart_in_one_answer() {
    let queue = Queue::new().await;
    let (_, _) = queue.run(&jobs(Chunk, 1)).await;
    let (cancelled_run, _) = queue.run(&jobs(Chunk, 1)).await;
    let claimed = queue.claim("chunk", 2).await;
    let (held, cancelled) = (&claimed[0], &claimed[1]);
    queue.cancel(cancelled_run).await;
    let lost = Beat { lease_number: LeaseNumber(held.lease_number.0 - 1), ..beat(held) };
    let beats = [lost, beat(cancelled), beat(held)];
    let mut connection = queue.pool.acquire().await.unwrap();
    let answers = queue::heartbeat(&mut connection, &beats).await.unwrap();
    assert_eq!(answers, [BeatAnswer::Lost, BeatAnswer::Cancelled, BeatAnswer::Held]);
}

#[tokio::test]
async fn a_heartbeat_does_not_wait_for_a_locked_job() {
    let queue = Queue::new().await;
    queue.run(&jobs(Chunk, 2)).await;
    let claimed = queue.claim("chunk", 2).await;
    let mut holder = queue.pool.begin().await.unwrap();
    sqlx::query("SELECT FROM jobs WHERE id = $1 FOR UPDATE")
        .bind(claimed[0].id)
        .execute(&mut *holder)
        .await
        .unwrap();
    let mut connection = queue.pool.acquire().await.unwrap();
    let answers = queue::heartbeat(&mut connection, &[beat(&claimed[0]), beat(&claimed[1])]).await.unwrap();
    assert_eq!(answers, [BeatAnswer::Busy, BeatAnswer::Held]);
}

#[tokio::test]
async fn a_worker_whose_lease_was_lost_stops_the_handler_and_drops_its_result() {
    let queue = Queue::new().await;
    queue.set_staleness(Duration::from_millis(500)).await;
    let (_, ids) = queue.run(&jobs(Chunk, 1)).await;
    let (stopped, mut was_stopped) = tokio::sync::mpsc::channel(1);
    let handler = does(Chunk, move |job| {
        let stopped = stopped.clone();
        async move {
            job.cancelled().await;
            let _ = stopped.send(()).await;
            Ok(queue::Outcome::default())
        }
    });
    let worker = queue.worker().handler(handler).start(CancellationToken::new());
    queue.wait_for_job(ids[0], "running").await;
    // Someone else has it now.
    queue
        .execute("UPDATE jobs SET state = 'available', leased_by = NULL, heartbeat_at = NULL, available_at = 'infinity'")
        .await
        .unwrap();
    was_stopped.recv().await.unwrap();
    crate::support::wait_until("the slot to be free", async || (worker.jobs_held() == 0).then_some(())).await;
    assert_eq!(queue.job(ids[0], "state").await, "available");
    assert_eq!(queue.job(ids[0], "attempts").await, "1");
}

#[tokio::test]
async fn handing_back_costs_no_attempt_but_raises_the_lease_number() {
    let queue = Queue::new().await;
    queue.run(&jobs(Chunk, 1)).await;
    let mut connection = queue.pool.acquire().await.unwrap();
    for round in 1..=10 {
        let job = queue.claim("chunk", 1).await.remove(0);
        assert_eq!((job.attempt, job.lease_number), (1, LeaseNumber(round)));
        assert_eq!(queue::hand_back(&mut connection, &lease(&job)).await.unwrap(), Settled::HandedBack);
    }
}
