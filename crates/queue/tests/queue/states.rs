//! The state machine as the database holds it.

use sqlx::Error;

use crate::support::{Chunk, Queue, jobs};

/// The constraint that refused the statement.
async fn refused_by(queue: &Queue, statement: &str) -> String {
    match queue.execute(statement).await {
        Err(Error::Database(error)) => error.constraint().unwrap_or("no constraint").to_owned(),
        other => format!("{other:?}"),
    }
}

#[tokio::test]
async fn illegal_rows_are_refused_by_name() {
    let queue = Queue::new().await;
    queue.run(&jobs(Chunk, 1)).await;
    let refusals = [
        ("state = 'resting'", "jobs_state_check"),
        ("state = 'running', lease_number = 1, attempts = 1, started_at = now()", "jobs_running_iff_leased"),
        ("leased_by = 'someone', heartbeat_at = now()", "jobs_running_iff_leased"),
        (
            "state = 'running', lease_number = 1, leased_by = 'someone', heartbeat_at = now()",
            "jobs_running_has_begun",
        ),
        ("finished_at = now()", "jobs_finished_iff_finished_at"),
        ("state = 'cancelled'", "jobs_finished_iff_finished_at"),
        ("pending_dependencies = 1", "jobs_unblocked_by_everything"),
        ("attempts = 1", "jobs_attempts_are_limited"),
        ("cancel_requested = true", "jobs_cancel_is_for_running"),
        ("progress = 1.5", "jobs_progress_check"),
        ("progress = 'NaN'", "jobs_progress_check"),
        ("weight = 0", "jobs_weight_check"),
        ("weight = 'NaN'", "jobs_weight_check"),
        ("max_attempts = 1001", "jobs_max_attempts_check"),
    ];
    for (change, constraint) in refusals {
        // A new state is first seen by the trigger, so illegal steps have their own test.
        let found = refused_by(&queue, &format!("UPDATE jobs SET {change}")).await;
        let by_step = found == "jobs_legal_steps" && change.contains("resting");
        assert!(found == constraint || by_step, "{change}: refused by {found}, expected {constraint}");
    }
}

#[tokio::test]
async fn every_step_that_is_not_drawn_is_refused() {
    let queue = Queue::new().await;
    let states = ["blocked", "available", "running", "succeeded", "failed", "cancelled"];
    let legal = [
        ("blocked", "available"),
        ("blocked", "cancelled"),
        ("available", "running"),
        ("available", "cancelled"),
        ("running", "available"),
        ("running", "succeeded"),
        ("running", "failed"),
        ("running", "cancelled"),
    ];
    let columns = |state: &str, lease: i32| {
        let running = state == "running";
        let finished = ["succeeded", "failed", "cancelled"].contains(&state);
        [
            format!("state = '{state}'"),
            format!("pending_dependencies = {}", i32::from(state == "blocked")),
            format!("lease_number = {lease}, attempts = 1"),
            if running {
                "leased_by = 'w', heartbeat_at = now(), started_at = now()"
            } else {
                "leased_by = NULL, heartbeat_at = NULL"
            }
            .to_owned(),
            format!("finished_at = {}", if finished { "now()" } else { "NULL" }),
            format!("error_message = {}", if state == "failed" { "'why'" } else { "NULL" }),
            format!("progress = {}", i32::from(state == "succeeded")),
        ]
        .join(", ")
    };
    for from in states {
        for to in states.into_iter().filter(|to| *to != from) {
            let mut transaction = queue.pool.begin().await.unwrap();
            let run =
                queue::enqueue_run(&mut transaction, &crate::support::new_run(queue.project)).await.unwrap();
            queue::enqueue_many(&mut transaction, run, &jobs(Chunk, 1)).await.unwrap();
            // The way there is not the test's concern.
            for statement in [
                "ALTER TABLE jobs DISABLE TRIGGER jobs_legal_steps".to_owned(),
                format!("UPDATE jobs SET {} WHERE run_id = '{run}'", columns(from, 5)),
                "ALTER TABLE jobs ENABLE TRIGGER jobs_legal_steps".to_owned(),
            ] {
                sqlx::query(sqlx::AssertSqlSafe(statement)).execute(&mut *transaction).await.unwrap();
            }
            let lease = if to == "running" { 6 } else { 5 };
            let step = format!("UPDATE jobs SET {} WHERE run_id = '{run}'", columns(to, lease));
            let stepped = sqlx::query(sqlx::AssertSqlSafe(step)).execute(&mut *transaction).await;
            assert_eq!(stepped.is_ok(), legal.contains(&(from, to)), "{from} to {to}: {stepped:?}");
        }
    }
}

#[tokio::test]
async fn only_a_claim_moves_the_lease_number_and_only_by_one() {
    let queue = Queue::new().await;
    queue.run(&jobs(Chunk, 1)).await;
    queue.claim("chunk", 1).await;
    for number in [0, 2, 3] {
        let found = refused_by(&queue, &format!("UPDATE jobs SET lease_number = {number}")).await;
        assert_eq!(found, "jobs_lease_is_monotonic");
    }
}

#[tokio::test]
async fn a_run_that_has_ended_stays_as_it_is() {
    let queue = Queue::new().await;
    let (run_id, _) = queue.run(&jobs(Chunk, 1)).await;
    assert_eq!(queue.cancel(run_id).await, queue::RunState::Cancelled);
    assert_eq!(queue.cancel(run_id).await, queue::RunState::Cancelled);
    let change = "UPDATE runs SET state = 'running', finished_at = NULL, started_at = now()";
    assert_eq!(refused_by(&queue, change).await, "runs_legal_steps");
    let mut connection = queue.pool.acquire().await.unwrap();
    let added = queue::enqueue_many(&mut connection, run_id, &jobs(Chunk, 1)).await;
    assert!(matches!(added, Err(queue::Error::RunFinished { .. })), "{added:?}");
}
