//! The numbers that all workers share, kept in the database.

use std::time::Duration;

use sqlx::PgConnection;

use crate::Error;

/// How many beats fit into the staleness.
const BEATS_PER_STALENESS: u32 = 5;

/// How long a running job may go without a heartbeat before its worker counts as lost.
pub async fn staleness(connection: &mut PgConnection) -> Result<Duration, Error> {
    let seconds: f64 =
        sqlx::query_scalar(include_str!("../queries/staleness.sql")).fetch_one(connection).await?;
    Ok(Duration::from_secs_f64(seconds.max(0.0)))
}

/// Changes it for everyone, between 250 ms and 1 h. Workers take it up within a beat of the old one.
pub async fn set_staleness(connection: &mut PgConnection, staleness: Duration) -> Result<(), Error> {
    sqlx::query(include_str!("../queries/set_staleness.sql"))
        .bind(staleness.as_secs_f64())
        .execute(connection)
        .await?;
    Ok(())
}

/// How often a worker beats.
pub fn heartbeat_interval(staleness: Duration) -> Duration {
    staleness / BEATS_PER_STALENESS
}
