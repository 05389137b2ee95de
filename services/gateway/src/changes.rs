//! Hearing that runs have changed: one LISTEN connection for all watchers of this process.

use std::time::Duration;

use sqlx::{PgPool, postgres::PgListener};
use tokio::sync::broadcast;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

/// Between two tries to connect.
const RETRY: Duration = Duration::from_secs(1);

/// Tells which runs have changed.
#[derive(Debug, Clone)]
pub(crate) struct Changes(broadcast::Sender<Uuid>);

impl Default for Changes {
    fn default() -> Self {
        // A watcher that falls behind is told so, and looks; see `Watch::wait_for`.
        Self(broadcast::channel(1024).0)
    }
}

impl Changes {
    /// Hears of every change from now on.
    pub fn subscribe(&self) -> Watch {
        Watch(self.0.subscribe())
    }

    /// Listens until `shutdown`; connects again when the connection is lost.
    pub async fn listen(self, db: PgPool, shutdown: CancellationToken) {
        let listening = async {
            loop {
                if let Err(error) = self.pass_on(&db).await {
                    tracing::warn!(%error, "not listening to changes of runs; they are polled meanwhile");
                }
                tokio::time::sleep(RETRY).await;
            }
        };
        tokio::select! {
            () = listening => {}
            () = shutdown.cancelled() => {}
        }
    }

    async fn pass_on(&self, db: &PgPool) -> sqlx::Result<()> {
        let mut listener = PgListener::connect_with(db).await?;
        listener.listen(queue::channels::RUNS).await?;
        loop {
            let notification = listener.recv().await?;
            if let Ok(run) = Uuid::try_parse(notification.payload()) {
                // no watchers is no error
                let _ = self.0.send(run);
            }
        }
    }
}

/// One watcher's ear.
#[derive(Debug)]
pub(crate) struct Watch(broadcast::Receiver<Uuid>);

impl Watch {
    /// Returns when that run may have changed.
    pub async fn wait_for(&mut self, run: Uuid) {
        loop {
            match self.0.recv().await {
                Ok(changed) if changed == run => return,
                Ok(_) => {}
                Err(broadcast::error::RecvError::Lagged(_)) => return,
                Err(broadcast::error::RecvError::Closed) => std::future::pending().await,
            }
        }
    }
}
