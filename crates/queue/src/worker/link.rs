//! A connection of the worker's own, opened again when it breaks.

use std::time::Duration;

use sqlx::postgres::PgConnectOptions;
use sqlx::{Connection, PgConnection};

use crate::Error;

/// Claims and heartbeats do not wait for a pool that handlers may have emptied.
pub(super) struct Link {
    options: PgConnectOptions,
    connection: Option<PgConnection>,
}

impl Link {
    pub(super) fn new(options: PgConnectOptions) -> Self {
        Self { options, connection: None }
    }

    /// Runs statements on the connection; it is dropped when they fail or take longer than `limit`.
    pub(super) async fn run<T>(
        &mut self,
        limit: Duration,
        statements: impl AsyncFnOnce(&mut PgConnection) -> Result<T, Error>,
    ) -> Result<T, Error> {
        // Taken out, so that an error, a timeout or a dropped future leaves no half-used connection.
        let kept = self.connection.take();
        let work = async {
            let mut connection = match kept {
                Some(connection) => connection,
                None => PgConnection::connect_with(&self.options).await?,
            };
            let answer = statements(&mut connection).await?;
            Ok::<_, Error>((connection, answer))
        };
        let (connection, answer) = tokio::time::timeout(limit, work)
            .await
            .map_err(|_| Error::Database(sqlx::Error::Io(std::io::ErrorKind::TimedOut.into())))??;
        self.connection = Some(connection);
        Ok(answer)
    }
}

/// Bounded exponential waits between tries to reach the database.
pub(super) struct Reconnect {
    wait: Duration,
}

impl Reconnect {
    const FIRST: Duration = Duration::from_millis(50);
    const LONGEST: Duration = Duration::from_secs(2);

    pub(super) fn new() -> Self {
        Self { wait: Self::FIRST }
    }

    pub(super) fn succeeded(&mut self) {
        self.wait = Self::FIRST;
    }

    /// How long to wait now.
    pub(super) fn next(&mut self) -> Duration {
        let wait = self.wait;
        self.wait = (wait * 2).min(Self::LONGEST);
        wait
    }
}
