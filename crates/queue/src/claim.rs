//! Taking jobs.

use std::collections::BTreeSet;

use sqlx::PgConnection;

use crate::{ClaimedJob, Error, RunId, channels};

/// Claims up to `limit` jobs of these kinds for the worker of this name, fairly between projects. Every
/// job comes with a fresh lease. Commits by itself, so call it outside a transaction.
///
/// An empty answer may mean that others were taking the same jobs at that moment: ask
/// [`is_any_available`].
pub async fn claim(
    connection: &mut PgConnection,
    worker: &str,
    kinds: &[&str],
    limit: usize,
) -> Result<Vec<ClaimedJob>, Error> {
    let mut jobs: Vec<ClaimedJob> = sqlx::query_as(include_str!("../queries/claim.sql"))
        .bind(worker)
        .bind(kinds)
        .bind(limit as i64)
        .fetch_all(&mut *connection)
        .await?;
    jobs.sort_by_key(|job| job.id);
    if jobs.is_empty() {
        return Ok(jobs);
    }
    let runs: BTreeSet<RunId> = jobs.iter().map(|job| job.run_id).collect();
    let started: Result<Vec<String>, _> = sqlx::query_scalar(include_str!("../queries/start_runs.sql"))
        .bind(runs.into_iter().collect::<Vec<_>>())
        .fetch_all(&mut *connection)
        .await;
    // The jobs are ours already and must not be dropped: the run's state comes with the next progress.
    match started {
        Ok(started) if !started.is_empty() => {
            if let Err(error) =
                channels::notify(connection, channels::RUNS, started.iter().map(String::as_str)).await
            {
                tracing::debug!(%error, "start of runs not notified");
            }
        }
        Ok(_) => {}
        Err(error) => tracing::debug!(%error, "runs not marked as running"),
    }
    Ok(jobs)
}

/// Whether a job of these kinds could be claimed now.
pub async fn is_any_available(connection: &mut PgConnection, kinds: &[&str]) -> Result<bool, Error> {
    Ok(sqlx::query_scalar(include_str!("../queries/is_any_available.sql"))
        .bind(kinds)
        .fetch_one(connection)
        .await?)
}
