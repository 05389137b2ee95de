//! Wakes the worker when something is notified. Only to be quick: everyone polls besides.

use std::sync::Arc;

use sqlx::postgres::{PgListener, PgPoolOptions};
use tokio_util::sync::CancellationToken;

use super::link::Reconnect;
use super::shared::Shared;
use crate::{Error, channels};

/// Listens until `done`, over a connection of its own. Subscribes before it wakes for the first time, so
/// that nothing which is enqueued after the look that follows goes unheard.
pub(super) async fn listen(shared: Arc<Shared>, done: CancellationToken) {
    let options = shared.pool.connect_options();
    let mut reconnect = Reconnect::new();
    loop {
        let listening = async {
            let pool = PgPoolOptions::new().max_connections(1).connect_lazy_with((*options).clone());
            let mut listener = PgListener::connect_with(&pool).await?;
            listener.listen_all([channels::AVAILABLE, channels::CANCELLED]).await?;
            reconnect.succeeded();
            shared.wake.available.notify_one();
            shared.wake.cancelled.notify_one();
            // `None`: the connection broke, and what was notified meanwhile is lost.
            while let Some(notification) = listener.try_recv().await? {
                if notification.channel() == channels::CANCELLED {
                    shared.wake.cancelled.notify_one();
                } else if shared.handlers.contains_key(notification.payload()) {
                    shared.wake.available.notify_one();
                }
            }
            Ok::<(), Error>(())
        };
        tokio::select! {
            () = done.cancelled() => return,
            ended = listening => if let Err(error) = ended {
                tracing::warn!(%error, "listening for jobs failed, polling meanwhile");
            },
        }
        tokio::select! {
            () = done.cancelled() => return,
            () = tokio::time::sleep(reconnect.next()) => {}
        }
    }
}
