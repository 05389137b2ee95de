//! The reconstruction service: full-body motion from control points.
//!
//! [`start`] runs the gRPC server (`marey.v1.Reconstruction`, `marey.v1.Live`, health, reflection) and claims four kinds of job:
//!
//! ```text
//! plan-sparse ──► reconstruct-chunk × n ──► merge-chunks
//!
//! (make-silhouettes × cameras ──►) solve-inverse-kinematics
//! ```
//!
//! The plan reads what people uploaded and writes one canonical session; nothing after it reads an upload
//! again, but for the ground truth. How a session is cut depends on its length and parameters alone, so the result does
//! not depend on how many workers there were or what happened to them.

mod chunk_job;
pub mod config;
mod control;
mod error;
mod evaluate;
mod export;
mod feet;
mod ik;
mod inputs;
mod live;
mod merge_job;
mod performer;
mod plan_job;
mod priors;
mod rpc;
mod run_report;

pub use config::Config;
pub use error::InputError;

use library::body_model::Models;
use priors::Priors;
use proto::v1::{live_server::LiveServer, reconstruction_server::ReconstructionServer};
use service::{Parts, Resources, Running};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;

/// Name of the service in logs and in the queue.
pub const NAME: &str = "reconstruction";

/// Where it listens unless told otherwise: this machine only.
pub const DEFAULT_LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 50052);

/// What all handlers of one process share.
struct Shared {
    resources: Resources,
    priors: Priors,
    models: Models,
}

/// Starts the service; it runs until `shutdown`. [`Running::address`] says where it listens.
///
/// # Errors
/// If the address, the store or the database's URL can't be used. A database that does not answer yet is
/// waited for.
pub async fn start(
    config: impl Into<Config>,
    shutdown: CancellationToken,
) -> Result<Running, service::Error> {
    let Config { service: config, live } = config.into();
    let resources = Resources::open(&config, NAME)?;
    let pool = resources.pool.clone();
    let shared = Arc::new(Shared {
        priors: Priors::new(resources.store.clone(), &config.memory),
        models: Models::new(resources.clone()),
        resources,
    });
    let live = live::LiveRpc::new(shared.clone(), live, shutdown.clone());
    let live = LiveServer::new(live).max_decoding_message_size(live::MAX_REQUEST_BYTES);
    let rpc = ReconstructionServer::new(rpc::Rpc::new(shared.clone()))
        .max_decoding_message_size(ik::call::MAX_REQUEST_BYTES);
    let routes = Routes::new(rpc).add_service(live);
    let builder = shared.resources.worker(&config.worker).map(|builder| {
        builder
            .handler(plan_job::PlanHandler { shared: shared.clone() })
            .handler(chunk_job::ChunkHandler { shared: shared.clone() })
            .handler(merge_job::MergeHandler { shared: shared.clone() })
            .handler(ik::job::IkHandler { shared })
    });
    let parts = Parts {
        name: NAME,
        grpc_names: &["marey.v1.Reconstruction", "marey.v1.Live"],
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
