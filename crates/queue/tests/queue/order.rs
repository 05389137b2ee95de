//! Which job goes first.

use std::time::Instant;

use queue::{ChildJob, Completion, ProjectId};
use serde_json::json;
use uuid::Uuid;

use crate::leases::lease;
use crate::support::{Chunk, Queue, job, jobs};

#[tokio::test]
async fn higher_priorities_go_first_and_equals_in_the_order_of_enqueueing() {
    let queue = Queue::new().await;
    let job = |name: &str, priority| ChildJob { priority, ..job(Chunk, json!(name)) };
    queue.run(&[job("low", -5), job("first", 0), job("second", 0), job("high", 7)]).await;
    let mut order = Vec::new();
    for _ in 0..4 {
        order.push(queue.claim("chunk", 1).await.remove(0).payload);
    }
    assert_eq!(order, ["high", "first", "second", "low"]);
}

#[tokio::test]
async fn a_small_project_does_not_wait_behind_a_big_one() {
    let queue = Queue::new().await;
    let (big, small) = (queue.project, ProjectId(Uuid::new_v4()));
    queue.run_of(big, &jobs(Chunk, 500)).await;
    queue.run_of(small, &jobs(Chunk, 4)).await;
    let batch = queue.claim("chunk", 8).await;
    let from_small = batch.iter().filter(|job| job.project_id == small).count();
    assert_eq!(from_small, 4, "half of the slots, though it came last");
    // The big one has 4 running; a third project gets as many before the big one gets a fifth.
    let third = ProjectId(Uuid::new_v4());
    queue.run_of(third, &jobs(Chunk, 50)).await;
    let batch = queue.claim("chunk", 4).await;
    assert!(batch.iter().all(|job| job.project_id == third));
}

#[tokio::test]
async fn a_failed_attempt_waits_its_time_and_lets_others_pass() {
    let queue = Queue::new().await;
    queue.run(&jobs(Chunk, 2)).await;
    let first = queue.claim("chunk", 1).await.remove(0);
    let mut connection = queue.pool.acquire().await.unwrap();
    let failure =
        queue::Failure::Retry { detail: "busy".into(), delay: std::time::Duration::from_secs(3600) };
    queue::fail(&mut connection, &lease(&first), &failure).await.unwrap();
    let claimed = queue.claim("chunk", 9).await;
    assert!(claimed.len() == 1 && claimed[0].id != first.id);
    assert!(queue.claim("chunk", 9).await.is_empty());
}

#[tokio::test]
async fn a_claim_stays_quick_with_twenty_thousand_jobs_of_fifty_projects() {
    let queue = Queue::new().await;
    for _ in 0..50 {
        queue.run_of(ProjectId(Uuid::new_v4()), &jobs(Chunk, 400)).await;
    }
    queue.execute("ANALYZE jobs").await.unwrap();
    queue.claim("chunk", 1).await;
    let began = Instant::now();
    let mut claimed = Vec::new();
    for _ in 0..50 {
        claimed.extend(queue.claim("chunk", 4).await);
    }
    let each = began.elapsed() / 50;
    println!("a claim of 4 among 20,000 jobs of 50 projects: {each:?}");
    assert!(each.as_millis() < 100, "{each:?} a claim");
    let mut connection = queue.pool.acquire().await.unwrap();
    queue::complete(&mut connection, &lease(&claimed[0]), &Completion::default()).await.unwrap();
}
