//! The NOTIFY channels. They only wake; whoever is woken looks for itself, and everyone polls besides.

use sqlx::PgConnection;

use crate::Error;

/// Jobs have become available. The payload is their kind.
pub const AVAILABLE: &str = "marey_jobs_available";

/// A run has ended early and its running jobs are flagged. The payload is the run's id.
pub const CANCELLED: &str = "marey_jobs_cancelled";

/// A run's state, progress or phrase has changed. The payload is the run's id.
pub const RUNS: &str = "marey_runs";

/// Notifies when the transaction commits; equal notifications of one transaction are sent once.
pub(crate) async fn notify<'a>(
    connection: &mut PgConnection,
    channel: &str,
    payloads: impl IntoIterator<Item = &'a str>,
) -> Result<(), Error> {
    let payloads: Vec<&str> = payloads.into_iter().collect();
    if !payloads.is_empty() {
        sqlx::query(include_str!("../queries/notify.sql"))
            .bind(channel)
            .bind(payloads)
            .execute(connection)
            .await?;
    }
    Ok(())
}
