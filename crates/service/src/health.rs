//! Health as gRPC knows it (`grpc.health.v1`), following whether the database answers.

use crate::database;
use sqlx::PgPool;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use tonic_health::{ServingStatus, server::HealthReporter};

/// Between two looks at the database.
const LOOK_EVERY: Duration = Duration::from_secs(2);
/// A database that takes longer than this to answer counts as away.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);

/// Keeps the status of `names` (and of the server as a whole, `""`) true until shutdown, then says not serving.
pub async fn follow(
    reporter: HealthReporter,
    names: &[&'static str],
    pool: PgPool,
    shutdown: CancellationToken,
) {
    let mut was_ready = None;
    loop {
        let is_ready = is_ready(&pool).await;
        if was_ready != Some(is_ready) {
            report(&reporter, names, is_ready).await;
            match (was_ready, is_ready) {
                (_, false) => tracing::warn!("not ready: the database does not answer"),
                (Some(false), true) => tracing::info!("ready again"),
                (_, true) => {}
            }
            was_ready = Some(is_ready);
        }
        tokio::select! {
            () = tokio::time::sleep(LOOK_EVERY) => {}
            () = shutdown.cancelled() => break,
        }
    }
    report(&reporter, names, false).await;
}

async fn is_ready(pool: &PgPool) -> bool {
    matches!(tokio::time::timeout(ANSWER_WITHIN, database::is_reachable(pool)).await, Ok(Ok(())))
}

/// Says of `names`, and of the server as a whole (`""`), whether they are ready.
pub async fn report(reporter: &HealthReporter, names: &[&'static str], is_ready: bool) {
    let status = if is_ready { ServingStatus::Serving } else { ServingStatus::NotServing };
    for name in names.iter().copied().chain([""]) {
        reporter.set_service_status(name, status).await;
    }
}
