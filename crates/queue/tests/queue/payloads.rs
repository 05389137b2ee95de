//! Payloads that can't be read, and payloads of other versions of the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use queue::{ChildJob, Job, NewRun, Outcome, RunState};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

use crate::support::{Chunk, Queue, does, job, jobs, reads};

/// What version 3 of `chunk` is given: version 2 counted in seconds, version 1 in nothing that we know any more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Frames {
    first_frame: u32,
}

impl Job for Frames {
    const KIND: &'static str = Chunk::KIND;
    const VERSION: i32 = 3;

    fn upgrade(version: i32, payload: Value) -> Option<Value> {
        match version {
            2 => Some(json!({ "first_frame": payload["first_second"].as_u64()? * 60 })),
            _ => None,
        }
    }
}

/// The one job of a run, as a program enqueued it whose payloads had that version.
fn versioned(payload_version: i32, payload: Value) -> ChildJob {
    ChildJob { payload_version, ..job(Chunk, payload) }
}

#[tokio::test]
async fn an_unreadable_payload_fails_at_once_with_a_message() {
    let queue = Queue::new().await;
    let handler = reads(async |_, _: Frames| Ok(Outcome::default()));
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    let (run_id, ids) = queue.run(&[versioned(3, json!({ "first_frame": "one" }))]).await;
    let status = queue.wait_for_run(run_id, RunState::Failed).await;
    assert_eq!(queue.job(ids[0], "attempts").await, "1");
    let message = status.error_message.unwrap();
    assert!(
        message.starts_with("the payload of this chunk job cannot be read: invalid type: string"),
        "{message}"
    );
    assert!(status.error_detail.unwrap().contains("u32"));
}

#[tokio::test]
async fn payloads_of_this_version_and_of_an_older_one_that_is_understood_are_read() {
    let queue = Queue::new().await;
    let handler = reads(async |_, frames: Frames| {
        assert_eq!(frames, Frames { first_frame: 120 });
        Ok(Outcome::default())
    });
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    let own = ChildJob::new(&Frames { first_frame: 120 }).unwrap();
    let older = versioned(2, json!({ "first_second": 2 }));
    let (run_id, ids) = queue.run(&[own, older]).await;
    queue.wait_for_run(run_id, RunState::Succeeded).await;
    assert_eq!(queue.job(ids[0], "payload_version").await, "3");
    assert_eq!(queue.job(ids[1], "payload_version").await, "2", "the row stays as it was enqueued");
}

#[tokio::test]
async fn a_payload_of_a_version_that_is_not_understood_is_refused_and_not_misread() {
    let queue = Queue::new().await;
    let handler = reads(async |_, _: Frames| panic!("it ran"));
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    // Each could be read as one of version 3.
    for version in [1, 4] {
        let (run_id, ids) = queue.run(&[versioned(version, json!({ "first_frame": 1 }))]).await;
        let status = queue.wait_for_run(run_id, RunState::Failed).await;
        let message = status.error_message.unwrap();
        let said = format!("its payload has version {version}, this one reads 3");
        assert!(message.contains("chunk job") && message.contains(&said), "{message}");
        assert_eq!(queue.job(ids[0], "attempts").await, "1", "another attempt helps nobody");
    }
}

#[tokio::test]
async fn what_is_to_be_done_before_an_attempt_is_done_before_every_one() {
    let queue = Queue::new().await;
    let begun = Arc::new(AtomicUsize::new(0));
    let (before, seen) = (begun.clone(), begun.clone());
    let handler = does(Chunk, move |context| {
        let seen = seen.load(Ordering::SeqCst);
        async move {
            assert_eq!(seen as i32, context.attempt(), "it was done before this attempt");
            if context.attempt() < 3 { Err(queue::JobError::retry("again")) } else { Ok(Outcome::default()) }
        }
    });
    let worker = queue.worker().handler(handler).before_attempt(move |_| {
        let before = before.clone();
        Box::pin(async move {
            before.fetch_add(1, Ordering::SeqCst);
        })
    });
    let _worker = worker.start(CancellationToken::new());
    let (run_id, _) = queue.run(&jobs(Chunk, 1)).await;
    queue.wait_for_run(run_id, RunState::Succeeded).await;
    assert_eq!(begun.load(Ordering::SeqCst), 3);
}

#[tokio::test]
async fn a_job_that_an_older_program_enqueues_by_a_former_name_gets_the_present_one() {
    let queue = Queue::new().await;
    let former = ChildJob { kind: "initialise-body", ..job(Chunk, json!(null)) };
    let (_, ids) = queue.run(&[former]).await;
    assert_eq!(queue.job(ids[0], "kind").await, "fit-shape");
}

#[tokio::test]
async fn a_run_that_an_older_program_adds_by_a_former_name_gets_the_present_one() {
    let queue = Queue::new().await;
    let former =
        NewRun { project_id: queue.project, kind: "reconstruction", session_id: None, parameters: json!({}) };
    let mut connection = queue.pool.acquire().await.unwrap();
    let run_id = queue::enqueue_run(&mut connection, &former).await.unwrap();
    assert_eq!(queue.status(run_id).await.kind, "sparse");
}
