//! The motion-index service: builds motion databases from uploaded files and answers questions on them.
//!
//! [`start`] runs the gRPC server (`marey.v1.MotionIndex`, health, reflection) and claims four kinds of job:
//!
//! ```text
//! plan-motion-database ──► import-motion × n ──► build-motion-database          train-gplvm
//! ```
//!
//! The plan unpacks what people uploaded and divides it into parts; imports read, smooth and augment one part each; the
//! build puts them together, after the clips of an earlier version if it is one to be added to, and writes the index
//! file or files. How the files are divided does not show in the result. Databases are read from the object store when
//! they are first asked for and kept in memory up to a bound; the shards of large ones are kept by several replicas.

mod build_job;
pub mod config;
mod contents;
mod databases;
mod error;
mod fan_out;
mod import_job;
mod inputs;
mod peers;
mod plan_job;
mod rpc;
mod search;
mod shards;
mod sources;
mod train_job;

pub use config::Config;
pub use error::Error;

use databases::Databases;
use fan_out::FanOut;
use peers::Peers;
use proto::v1::motion_index_server::MotionIndexServer;
use service::{Parts, Resources, Running};
use std::net::SocketAddr;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;

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
pub async fn start(
    config: impl Into<Config>,
    shutdown: CancellationToken,
) -> Result<Running, service::Error> {
    let Config { service: config, peers } = config.into();
    let resources = Resources::open(&config, NAME)?;
    let pool = resources.pool.clone();
    let peers = Peers::new(&peers).map_err(|error| service::Error::BadValue {
        name: "MAREY_MOTION_INDEX_PEERS",
        found: error.found,
        expected: format!("addresses such as http://10.0.0.7:50051: {}", error.reason),
    })?;
    let databases = Databases::new(pool.clone(), resources.store.clone(), &config.memory);
    let routes = Routes::new(MotionIndexServer::new(rpc::Rpc::new(FanOut { databases, peers })));
    let builder = resources.worker(&config.worker).map(|builder| {
        builder
            .handler(plan_job::PlanHandler { resources: resources.clone() })
            .handler(import_job::ImportHandler { resources: resources.clone() })
            .handler(resources.making_versions(build_job::BuildHandler { resources: resources.clone() }))
            .handler(resources.making_versions(train_job::TrainHandler { resources: resources.clone() }))
    });
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
pub async fn run(config: impl Into<Config>, shutdown: CancellationToken) -> Result<(), service::Error> {
    start(config, shutdown).await?.stopped().await
}
