//! The motion-index service: builds motion databases from uploaded files and answers questions on them.
//!
//! [`start`] runs the gRPC server (`marey.v1.MotionIndex`, health, reflection) and claims jobs of kind
//! [`BUILD_MOTION_DATABASE`]. Databases are read from the object store when they are first asked for and
//! kept in memory up to a bound.

mod build_job;
mod catalogue;
mod databases;
mod error;
mod inputs;
mod payload;
mod rpc;
mod search;

pub use error::Error;
pub use payload::{BuildMotionDatabase, InputFile, MotionDatabaseName};

use build_job::BuildHandler;
use databases::Databases;
use proto::v1::motion_index_server::MotionIndexServer;
use service::{Config, Parts, Running};
use std::net::SocketAddr;
use std::sync::Arc;
use store::Store;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;

/// The kind of job this service claims.
pub const BUILD_MOTION_DATABASE: &str = "build-motion-database";

/// Name of the service in logs and in the queue.
pub const NAME: &str = "motion-index";

/// Where it listens unless told otherwise: this machine only.
pub const DEFAULT_LISTEN: SocketAddr =
    SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 50051);

/// Starts the service; it runs until `shutdown`. [`Running::address`] says where it listens.
///
/// # Errors
/// If the address, the store or the database's URL can't be used. A database that does not answer yet is
/// waited for.
pub async fn start(config: Config, shutdown: CancellationToken) -> Result<Running, service::Error> {
    let pool = service::database::pool(&config.database)?;
    let store = Store::open(&config.store)?;
    let databases = Arc::new(Databases::new(pool.clone(), store.clone(), &config.memory));
    let routes = Routes::new(MotionIndexServer::new(rpc::Rpc::new(databases)));
    let builder = config.worker.builder(NAME, &pool);
    let builder = builder.map(|b| b.handler(BuildHandler::new(store, config.memory.clone())));
    let parts = Parts {
        name: NAME,
        grpc_names: &["marey.v1.MotionIndex"],
        routes,
        descriptors: proto::FILE_DESCRIPTOR_SET,
        worker: builder.map(|b| move |stop| b.start(stop)),
    };
    service::start(&config, parts, pool, shutdown).await
}

/// Runs the service until `shutdown`.
///
/// # Errors
/// As [`start`], and whatever made it stop before.
pub async fn run(config: Config, shutdown: CancellationToken) -> Result<(), service::Error> {
    start(config, shutdown).await?.stopped().await
}
