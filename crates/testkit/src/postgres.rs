//! Throw-away databases in a private cluster: one cluster a test process, one database a test.
//!
//! ```no_run
//! # async fn example() -> Result<(), testkit::postgres::Error> {
//! let database = testkit::postgres::TestDatabase::new().await?;
//! let pool = database.pool();
//! # Ok(())
//! # }
//! ```

use std::path::PathBuf;
use std::sync::Arc;

use private_postgres::{Config, PrivateCluster};
use sqlx::postgres::{PgConnectOptions, PgPoolOptions};
use sqlx::{AssertSqlSafe, ConnectOptions, Connection, Executor, PgPool};
use tokio::sync::OnceCell;
use uuid::Uuid;

/// A database with the migrations applied, copied for each test.
const TEMPLATE: &str = "migrated";

/// Why there is no test database.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The cluster did not start or stop.
    #[error("cluster: {0}")]
    Cluster(#[from] private_postgres::Error),
    /// A statement failed.
    #[error("database: {0}")]
    Database(#[from] sqlx::Error),
    /// A migration failed.
    #[error("migration: {0}")]
    Migration(#[from] sqlx::migrate::MigrateError),
    /// The task that starts or stops the cluster panicked.
    #[error("cluster task: {0}")]
    Task(#[from] tokio::task::JoinError),
}

/// A fresh database with all migrations applied.
pub struct TestDatabase {
    cluster: Arc<PrivateCluster>,
    name: String,
    pool: PgPool,
}

impl TestDatabase {
    /// In the cluster of this process, which is started by the first test that needs it and stopped and
    /// removed when the process ends, in whatever way.
    pub async fn new() -> Result<Self, Error> {
        static SHARED: OnceCell<Arc<PrivateCluster>> = OnceCell::const_new();
        Self::in_cluster(SHARED.get_or_try_init(start_cluster).await?.clone()).await
    }

    /// In a cluster that no other test uses, to be crashed and restarted.
    pub async fn in_own_cluster() -> Result<Self, Error> {
        Self::in_cluster(start_cluster().await?).await
    }

    async fn in_cluster(cluster: Arc<PrivateCluster>) -> Result<Self, Error> {
        let name = format!("test_{}", Uuid::new_v4().simple());
        let mut connection = cluster.connect_options("postgres").connect().await?;
        connection.execute(AssertSqlSafe(format!("CREATE DATABASE {name} TEMPLATE {TEMPLATE}"))).await?;
        connection.close().await?;
        let pool = PgPoolOptions::new().max_connections(16).connect_lazy_with(cluster.connect_options(&name));
        Ok(Self { cluster, name, pool })
    }

    /// A pool of up to 16 connections.
    pub fn pool(&self) -> PgPool {
        self.pool.clone()
    }

    /// How to connect to the database.
    pub fn connect_options(&self) -> PgConnectOptions {
        self.cluster.connect_options(&self.name)
    }

    /// The same as a URL, for other processes.
    pub fn url(&self) -> String {
        self.cluster.url(&self.name)
    }

    /// Crashes the server and starts it again. Meant for [`in_own_cluster`](Self::in_own_cluster).
    pub async fn restart_immediate(&self) -> Result<(), Error> {
        let cluster = self.cluster.clone();
        Ok(tokio::task::spawn_blocking(move || cluster.restart_immediate()).await??)
    }
}

async fn start_cluster() -> Result<Arc<PrivateCluster>, Error> {
    let cluster = tokio::task::spawn_blocking(|| {
        // Short, for the path of the socket; open to the user that runs the server.
        let folder = |what| PathBuf::from(format!("/var/tmp/mt-{}-{what}", Uuid::new_v4().simple()));
        PrivateCluster::start(Config {
            data_dir: folder("data"),
            socket_dir: folder("socket"),
            durable: false,
        })
    })
    .await??;
    cluster.create_database(TEMPLATE).await?;
    let mut connection = cluster.connect_options(TEMPLATE).connect().await?;
    queue::MIGRATOR.run(&mut connection).await?;
    // A template is copied only while nobody is connected to it.
    connection.close().await?;
    Ok(Arc::new(cluster))
}
