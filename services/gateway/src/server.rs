//! Starting and stopping the gateway.

use std::{net::SocketAddr, time::Duration};

use anyhow::Context;
use axum::serve::ListenerExt;
use sqlx::postgres::PgPoolOptions;
use store::Store;
use tokio::{net::TcpListener, task::JoinHandle};
use tokio_util::sync::CancellationToken;

use crate::{App, Config, access, housekeeping, routes};

/// After a shutdown was asked for, requests under way get so long to end.
const GRACE: Duration = Duration::from_secs(20);

/// A gateway that serves.
#[derive(Debug)]
pub struct Gateway {
    address: SocketAddr,
    server: JoinHandle<anyhow::Result<()>>,
}

impl Gateway {
    /// Brings the database's schema up to date, and serves until `shutdown`. Returns once it listens.
    ///
    /// # Errors
    /// If the database, the store or the address can't be reached or opened.
    pub async fn start(config: &Config, shutdown: CancellationToken) -> anyhow::Result<Self> {
        let db = PgPoolOptions::new()
            .max_connections(config.max_connections)
            .acquire_timeout(Duration::from_secs(10))
            .connect(&config.database_url)
            .await
            .context("the database can't be reached")?;
        queue::MIGRATOR.run(&db).await.context("the database's schema can't be brought up to date")?;
        if let Some(key) = &config.bootstrap_key {
            access::ensure_key(&db, key).await.context("the bootstrap key can't be stored")?;
        }
        let store = Store::open(&config.store)?;
        let app = App::new(db.clone(), store, config, shutdown.clone());
        let listener = TcpListener::bind(config.listen)
            .await
            .with_context(|| format!("can't listen on {}", config.listen))?;
        let address = listener.local_addr()?;
        // Small answers must not wait for the acknowledgement of the last one.
        let listener = listener.tap_io(|connection| {
            if let Err(error) = connection.set_nodelay(true) {
                tracing::debug!(%error, "a connection holds small answers back");
            }
        });
        tracing::info!(%address, "gateway listens");
        let streams = app.live.tasks.clone();
        let background = [
            tokio::spawn(app.changes.clone().listen(db.clone(), shutdown.clone())),
            tokio::spawn(housekeeping::run(app.clone(), shutdown.clone())),
        ];
        let server = tokio::spawn(async move {
            let serving = axum::serve(listener, routes::router(app))
                .with_graceful_shutdown(shutdown.clone().cancelled_owned())
                .into_future();
            // Live streams are no requests any more: their last states are waited for as well.
            let serving = async {
                let served = serving.await;
                streams.close();
                streams.wait().await;
                served
            };
            tokio::select! {
                served = serving => served?,
                () = async { shutdown.cancelled().await; tokio::time::sleep(GRACE).await } => {
                    tracing::warn!("requests were still under way after the grace period");
                }
            }
            for task in background {
                task.await?;
            }
            db.close().await;
            Ok(())
        });
        Ok(Self { address, server })
    }

    /// Where it listens: with port 0 in the configuration, the port that was free.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Waits until it has stopped.
    ///
    /// # Errors
    /// If serving failed.
    pub async fn stopped(self) -> anyhow::Result<()> {
        self.server.await.context("the gateway panicked")?
    }
}

/// Serves until `shutdown`.
///
/// # Errors
/// As [`Gateway::start`] and [`Gateway::stopped`].
pub async fn run(config: Config, shutdown: CancellationToken) -> anyhow::Result<()> {
    Gateway::start(&config, shutdown).await?.stopped().await
}
