//! Connecting to PostgreSQL.

use crate::{Error, config::DatabaseConfig};
use sqlx::{PgPool, postgres::PgPoolOptions};
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// Between two looks at a database that is not there yet.
const RETRY_EVERY: Duration = Duration::from_millis(500);
/// How often to say that the database is not there yet, looks.
const SAY_EVERY: u32 = 20;

/// A pool that connects when it is first used.
///
/// # Errors
/// [`Error::Database`] if the URL can't be read.
pub fn pool(config: &DatabaseConfig) -> Result<PgPool, Error> {
    Ok(PgPoolOptions::new()
        .max_connections(config.max_connections)
        .acquire_timeout(config.acquire_timeout)
        .connect_lazy(&config.url)?)
}

/// Waits until the database answers and has the schema that the gateway (or `marey up`) puts there.
///
/// Services start in any order; none of them dies because another is later.
///
/// # Errors
/// [`Error::StoppedEarly`] if `shutdown` comes first.
pub async fn wait_until_ready(
    service: &'static str,
    pool: &PgPool,
    shutdown: &CancellationToken,
) -> Result<(), Error> {
    let mut looks = 0u32;
    loop {
        let problem = match has_schema(pool).await {
            Ok(true) => return Ok(()),
            Ok(false) => "the database has no schema yet, or an older one than this program needs".to_owned(),
            Err(error) => error.to_string(),
        };
        if looks.is_multiple_of(SAY_EVERY) {
            tracing::warn!(service, problem, "waiting for the database");
        }
        looks += 1;
        tokio::select! {
            () = tokio::time::sleep(RETRY_EVERY) => {}
            () = shutdown.cancelled() => return Err(Error::StoppedEarly { service }),
        }
    }
}

/// Whether the database answers a question at all.
///
/// # Errors
/// [`sqlx::Error`] if it does not.
pub async fn is_reachable(pool: &PgPool) -> Result<(), sqlx::Error> {
    sqlx::query_scalar::<_, i32>("SELECT 1").fetch_one(pool).await.map(|_| ())
}

/// Whether the schema is at least as new as this program: an older gateway may be about to be replaced by one that brings it up
/// to date.
async fn has_schema(pool: &PgPool) -> Result<bool, sqlx::Error> {
    let is_migrated: bool =
        sqlx::query_scalar("SELECT to_regclass('_sqlx_migrations') IS NOT NULL").fetch_one(pool).await?;
    if !is_migrated {
        return Ok(false);
    }
    let newest = queue::MIGRATOR.iter().map(|migration| migration.version).max();
    sqlx::query_scalar("SELECT EXISTS (SELECT FROM _sqlx_migrations WHERE version >= $1 AND success)")
        .bind(newest)
        .fetch_one(pool)
        .await
}
