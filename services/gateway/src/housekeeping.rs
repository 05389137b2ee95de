//! What the gateway tidies up while it runs.

use std::{collections::HashSet, time::Duration};

use queue::RunId;
use tokio_util::sync::CancellationToken;

use crate::{App, error::Result};

/// How often, seconds.
const INTERVAL: Duration = Duration::from_secs(3600);

/// An unfinished upload that nothing was added to for so long is not going on any more.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// Forgets idempotency keys after a day, and removes what jobs of ended builds left for each other and what uploads left
/// that a killed process never finished, until `shutdown`.
pub(crate) async fn run(app: App, shutdown: CancellationToken) {
    loop {
        let forgotten =
            sqlx::query("DELETE FROM idempotency_keys WHERE created_at < now() - interval '1 day'")
                .execute(&app.db)
                .await;
        match forgotten {
            Ok(done) => tracing::debug!(keys = done.rows_affected(), "forgot idempotency keys"),
            Err(error) => tracing::warn!(%error, "could not forget idempotency keys"),
        }
        match remove_parts(&app).await {
            Ok(removed) => tracing::debug!(removed, "removed parts of motion databases"),
            Err(error) => tracing::warn!(%error, "could not remove parts of motion databases"),
        }
        match app.store.remove_abandoned_uploads(ABANDONED).await {
            Ok(0) => {}
            Ok(removed) => tracing::info!(removed, "removed what was left of unfinished uploads"),
            Err(error) => tracing::warn!(%error, "could not remove what was left of unfinished uploads"),
        }
        tokio::select! {
            () = tokio::time::sleep(INTERVAL) => {}
            () = shutdown.cancelled() => return,
        }
    }
}

/// Removes the parts from which motion databases were put together: all that ended builds wrote but their results. As
/// much as was uploaded, unpacked, is of no use any more.
async fn remove_parts(app: &App) -> Result<usize> {
    let runs: Vec<RunId> = sqlx::query_scalar(
        "SELECT DISTINCT r.id FROM runs r JOIN artefacts a ON a.run_id = r.id
         WHERE r.kind = 'motion-database' AND r.finished_at < now() - interval '1 hour' AND NOT a.is_result",
    )
    .fetch_all(&app.db)
    .await?;
    let mut removed = 0;
    for run in runs {
        let kept: Vec<String> =
            sqlx::query_scalar("SELECT store_key FROM artefacts WHERE run_id = $1 AND is_result")
                .bind(run)
                .fetch_all(&app.db)
                .await?;
        let kept = kept.iter().map(|key| key.parse()).collect::<Result<HashSet<_>, _>>()?;
        removed += app.store.remove_orphans(&store::key::run_prefix(run.0), &kept).await?;
        sqlx::query("DELETE FROM artefacts WHERE run_id = $1 AND NOT is_result")
            .bind(run)
            .execute(&app.db)
            .await?;
    }
    Ok(removed)
}
