//! What the gateway tidies up while it runs.

use std::time::Duration;

use tokio_util::sync::CancellationToken;

use crate::App;

/// How often, seconds.
const INTERVAL: Duration = Duration::from_secs(3600);

/// Forgets idempotency keys after a day, until `shutdown`.
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
        tokio::select! {
            () = tokio::time::sleep(INTERVAL) => {}
            () = shutdown.cancelled() => return,
        }
    }
}
