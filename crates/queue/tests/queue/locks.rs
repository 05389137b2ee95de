//! What an open transaction may and may not keep waiting.

use std::time::Duration;

use queue::{Completion, Settled};
use serde_json::json;

use crate::leases::lease;
use crate::support::{Chunk, DEADLINE, Late, Merge, Queue, job, jobs, new_run};

/// What must not wait for a lock gets this long.
const AT_ONCE: Duration = Duration::from_secs(5);

#[tokio::test]
async fn an_open_transaction_that_has_enqueued_keeps_nobody_waiting() {
    let queue = Queue::new().await;
    let (run_id, _) = queue.run(&jobs(Chunk, 4)).await;
    let mut open = queue.pool.begin().await.unwrap();
    let other_run = queue::enqueue_run(&mut open, &new_run(queue.project)).await.unwrap();
    queue::enqueue_many(&mut open, other_run, &jobs(Chunk, 3)).await.unwrap();
    // Into a run that others use as well, and whose jobs are being claimed.
    let more = [job(Chunk, json!(0)), job(Merge, json!(1)).depends_on([0])];
    queue::enqueue_many(&mut open, run_id, &more).await.unwrap();

    tokio::time::timeout(AT_ONCE, async {
        let mut second = queue.pool.begin().await.unwrap();
        queue::enqueue_many(&mut second, run_id, &more).await.unwrap();
        second.commit().await.unwrap();
        queue.run(&jobs(Chunk, 1)).await;

        let claimed = queue.claim("chunk", 99).await;
        assert_eq!(claimed.len(), 6, "what is committed can be claimed");
        let mut connection = queue.pool.acquire().await.unwrap();
        let beats: Vec<_> = claimed
            .iter()
            .map(|job| queue::Beat {
                job_id: job.id,
                lease_number: job.lease_number,
                progress: Some((0.5, "halfway".to_owned())),
            })
            .collect();
        let answers = queue::heartbeat(&mut connection, &beats).await.unwrap();
        assert!(answers.iter().all(|answer| *answer == queue::BeatAnswer::Held));
        // And a job of another run completes.
        let other = claimed.iter().find(|job| job.run_id != run_id).unwrap();
        let settled = queue::complete(&mut connection, &lease(other), &Completion::default()).await.unwrap();
        assert_eq!(settled, Settled::Succeeded);
    })
    .await
    .expect("no waiting for the open transaction");
    open.commit().await.unwrap();
}

#[tokio::test]
async fn jobs_complete_while_a_job_is_being_added_to_their_run_but_the_run_does_not_end() {
    let queue = Queue::new().await;
    let (run_id, _) = queue.run(&jobs(Chunk, 2)).await;
    let claimed = queue.claim("chunk", 2).await;
    let mut open = queue.pool.begin().await.unwrap();
    queue::enqueue_many(&mut open, run_id, &jobs(Late, 1)).await.unwrap();

    let mut connection = queue.pool.acquire().await.unwrap();
    let (first, completion) = (lease(&claimed[0]), Completion::default());
    let completed = tokio::time::timeout(AT_ONCE, queue::complete(&mut connection, &first, &completion));
    assert_eq!(completed.await.expect("no waiting").unwrap(), Settled::Succeeded);

    // The last one would end the run: it waits to see what is being added.
    let last = lease(&claimed[1]);
    let pool = queue.pool.clone();
    let completing = tokio::spawn(async move {
        let mut connection = pool.acquire().await.unwrap();
        queue::complete(&mut connection, &last, &Completion::default()).await.unwrap()
    });
    open.commit().await.unwrap();
    let completed = tokio::time::timeout(DEADLINE, completing).await.unwrap().unwrap();
    assert_eq!(completed, Settled::Succeeded);
    assert_eq!(queue.status(run_id).await.state, queue::RunState::Running);
    let late = queue.claim("late", 1).await.remove(0);
    queue::complete(&mut connection, &lease(&late), &Completion::default()).await.unwrap();
    assert_eq!(queue.status(run_id).await.state, queue::RunState::Succeeded);
}

#[tokio::test]
async fn the_last_two_jobs_of_a_run_may_complete_at_once() {
    let queue = Queue::new().await;
    for _ in 0..30 {
        let merge = job(Merge, json!(null)).depends_on([0, 1]);
        let (run_id, _) = queue.run(&[jobs(Chunk, 2), vec![merge]].concat()).await;
        let claimed = queue.claim("chunk", 2).await;
        let complete = async |job| {
            let mut connection = queue.pool.acquire().await.unwrap();
            queue::complete(&mut connection, &lease(job), &Completion::default()).await.unwrap();
        };
        tokio::join!(complete(&claimed[0]), complete(&claimed[1]));
        let merge = queue.claim("merge", 1).await;
        complete(&merge[0]).await;
        assert_eq!(queue.status(run_id).await.state, queue::RunState::Succeeded);
    }
}
