//! A PostgreSQL cluster of one's own: the system's binaries, a data folder, a socket, no TCP port.
//!
//! The server refuses to run as root; then it runs as the user `postgres`, or `nobody` where there is none,
//! and the folders belong to that user. A watchdog process stops the server when the process that started
//! it ends in whatever way, so no server is left behind.
//!
//! Starting and stopping block: from asynchronous code use `spawn_blocking`.
//!
//! ```no_run
//! # async fn example() -> Result<(), private_postgres::Error> {
//! use private_postgres::{Config, PrivateCluster};
//!
//! let cluster = PrivateCluster::start(Config {
//!     data_dir: "/var/lib/marey/postgres".into(),
//!     socket_dir: "/var/lib/marey/socket".into(),
//!     durable: true,
//! })?;
//! cluster.create_database("marey").await?;
//! let options = cluster.connect_options("marey");
//! // … PgPoolOptions::new().connect_with(options) …
//! cluster.stop()?;
//! # Ok(())
//! # }
//! ```

mod cluster;
mod config;
mod error;
mod lock_file;
mod programs;
mod server_user;
mod watchdog;

pub use cluster::{PrivateCluster, SUPERUSER};
pub use config::Config;
pub use error::Error;
