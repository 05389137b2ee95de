//! Jobs that depend on jobs, and what they leave behind.

use std::time::Instant;

use queue::{Artefact, ChildJob, JobContext, JobError, Outcome, RunState};
use serde_json::json;
use tokio_util::sync::CancellationToken;

use crate::support::{Build, Chunk, Merge, Plan, Queue, does, job, jobs, reads};

fn artefact(name: &str, store_key: String, is_result: bool) -> Artefact {
    Artefact {
        name: name.to_owned(),
        store_key,
        bytes: 3,
        blake3: "ab".repeat(32),
        media_type: "text/plain".to_owned(),
        is_result,
    }
}

#[tokio::test]
async fn a_thousand_chunks_fan_out_of_one_job_and_into_one() {
    const CHUNKS: usize = 1000;
    let queue = Queue::new().await;
    let plan = does(Plan, async |_| {
        let mut children = jobs(Chunk, CHUNKS);
        children.push(job(Merge, json!(null)).depends_on(0..CHUNKS));
        Ok(Outcome::default().children(children))
    });
    let chunk = reads(async |context: JobContext, Chunk(index)| {
        let key = format!("{}/{}/{index}", context.id(), context.lease_number());
        Ok(Outcome::default().artefact(artefact("poses", key, false)))
    });
    let pool = queue.pool.clone();
    let merge = does(Merge, move |job| {
        let pool = pool.clone();
        async move {
            let mut connection = pool.acquire().await?;
            let inputs = queue::dependency_artefacts(&mut connection, job.id()).await?;
            for (index, input) in inputs.iter().enumerate() {
                assert!(
                    input.artefact.store_key.ends_with(&format!("/{index}")),
                    "in the order of the chunks"
                );
            }
            let key = format!("{}/{}", job.id(), inputs.len());
            Ok(Outcome::default().artefact(artefact("motion.bvh", key, true)))
        }
    });
    let began = Instant::now();
    let (run_id, _) = queue.run(&[job(Plan, json!(null))]).await;
    let shutdown = CancellationToken::new();
    let _workers: Vec<_> = (0..2)
        .map(|_| {
            let worker = queue.worker().handler(plan.clone()).handler(chunk.clone()).handler(merge.clone());
            worker.concurrency(4).start(shutdown.clone())
        })
        .collect();
    queue.wait_for_run(run_id, RunState::Succeeded).await;
    println!("1 + 1,000 + 1 jobs: {:?}", began.elapsed());
    let mut connection = queue.pool.acquire().await.unwrap();
    let results = queue::run_results(&mut connection, run_id).await.unwrap();
    assert_eq!(results.len(), 1);
    assert!(results[0].store_key.ends_with("/1000"));
    let jobs: i64 =
        sqlx::query_scalar("SELECT count(*) FROM jobs WHERE state = 'succeeded' AND attempts = 1")
            .fetch_one(&queue.pool)
            .await
            .unwrap();
    assert_eq!(jobs as usize, CHUNKS + 2);
}

#[tokio::test]
async fn dependencies_and_runs_that_cannot_be_are_refused() {
    let queue = Queue::new().await;
    let (run_id, _) = queue.run(&jobs(Chunk, 1)).await;
    let mut connection = queue.pool.acquire().await.unwrap();
    let on_itself = [job(Chunk, json!(0)).depends_on([0])];
    let refused = queue::enqueue_many(&mut connection, run_id, &on_itself).await;
    assert!(matches!(refused, Err(queue::Error::DependencyNotEarlier { index: 0, depends_on: 0 })));
    let nowhere = queue::RunId(uuid::Uuid::nil());
    let refused = queue::enqueue_many(&mut connection, nowhere, &jobs(Chunk, 1)).await;
    assert!(matches!(refused, Err(queue::Error::NoSuchRun(_))));
}

#[tokio::test]
async fn sql_of_the_handler_is_committed_with_the_completion_or_not_at_all() {
    let queue = Queue::new().await;
    queue.execute("CREATE TABLE indices (job_id bigint PRIMARY KEY, attempt integer)").await.unwrap();
    let handler = does(Build, async |job| {
        let (id, attempt) = (job.id(), job.attempt());
        let outcome = Outcome::default().artefact(artefact("index", format!("{id}/{attempt}"), true));
        Ok(outcome.on_complete(move |connection| {
            Box::pin(async move {
                sqlx::query("INSERT INTO indices (job_id, attempt) VALUES ($1, $2)")
                    .bind(id)
                    .bind(attempt)
                    .execute(connection)
                    .await?;
                if attempt == 1 { Err(JobError::retry("not yet")) } else { Ok(()) }
            })
        }))
    });
    let (run_id, ids) = queue.run(&[job(Build, json!(null))]).await;
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    queue.wait_for_run(run_id, RunState::Succeeded).await;
    let rows: Vec<(i64, i32)> =
        sqlx::query_as("SELECT job_id, attempt FROM indices").fetch_all(&queue.pool).await.unwrap();
    assert_eq!(rows, [(ids[0].0, 2)]);
    assert_eq!(queue.job(ids[0], "error_detail").await, "not yet");
    let mut connection = queue.pool.acquire().await.unwrap();
    let results = queue::run_results(&mut connection, run_id).await.unwrap();
    assert_eq!(results[0].store_key, format!("{}/2", ids[0]));
}

#[tokio::test]
async fn an_outcome_that_the_database_refuses_is_a_failed_attempt() {
    let queue = Queue::new().await;
    let handler = does(Build, async |_| {
        let bad = Artefact { blake3: "not a hash".into(), ..artefact("index", "key".into(), false) };
        Ok(Outcome::default().artefact(bad))
    });
    let (run_id, _) = queue.run(&[ChildJob { max_attempts: 1, ..job(Build, json!(null)) }]).await;
    let _worker = queue.worker().handler(handler).start(CancellationToken::new());
    let status = queue.wait_for_run(run_id, RunState::Failed).await;
    assert!(status.error_detail.unwrap().contains("artefacts_blake3_check"));
}

#[tokio::test]
async fn depth_counts_unfinished_jobs_by_kind_and_state() {
    let queue = Queue::new().await;
    let merge = job(Merge, json!(null)).depends_on([0]);
    queue.run(&[jobs(Chunk, 2), vec![merge]].concat()).await;
    queue.claim("chunk", 1).await;
    let mut connection = queue.pool.acquire().await.unwrap();
    let depth = queue::depth(&mut connection).await.unwrap();
    let found: Vec<_> = depth.iter().map(|row| (row.kind.as_str(), row.state.as_str(), row.jobs)).collect();
    assert_eq!(found, [("chunk", "available", 1), ("chunk", "running", 1), ("merge", "blocked", 1)]);
}
