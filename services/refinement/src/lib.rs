//! The refinement service: a person of known shape is followed through the silhouettes of several cameras.
//!
//! [`start`] runs the gRPC server (`marey.v1.Refinement`, health, reflection) and claims two kinds of job:
//!
//! ```text
//! fit-shape (shape-init) ──► track-chunk × n ──► merge-tracks ──► draw-overlay × cameras (shape-init)
//! ```
//!
//! Each chunk begins with a key frame that is found without a start, so that any number of workers share one session. How a
//! session is cut depends on its length and parameters alone, so the result does not depend on how many workers there were or
//! what happened to them.

mod csv;
mod error;
mod export;
mod finished;
mod merge_job;
mod options;
mod refine;
mod report;
mod rpc;
mod track_job;

pub use error::InputError;

use library::body_model::Models;
use proto::v1::refinement_server::RefinementServer;
use service::{Config, Parts, Resources, Running};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;

/// Name of the service in logs and in the queue.
pub const NAME: &str = "refinement";

/// Where it listens unless told otherwise: this machine only.
pub const DEFAULT_LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 50054);

/// What all handlers of one process share.
struct Shared {
    resources: Resources,
    models: Models,
}

/// Starts the service; it runs until `shutdown`. [`Running::address`] says where it listens.
///
/// # Errors
/// If the address, the store or the database's URL can't be used. A database that does not answer yet is
/// waited for.
pub async fn start(config: Config, shutdown: CancellationToken) -> Result<Running, service::Error> {
    let resources = Resources::open(&config, NAME)?;
    let pool = resources.pool.clone();
    let shared = Arc::new(Shared { models: Models::new(resources.clone()), resources });
    let rpc = RefinementServer::new(rpc::Rpc::new(shared.clone()))
        .max_decoding_message_size(rpc::MAX_REQUEST_BYTES);
    let builder = shared.resources.worker(&config.worker).map(|builder| {
        builder
            .handler(track_job::TrackHandler { shared: shared.clone() })
            .handler(merge_job::MergeHandler { shared })
    });
    let parts = Parts {
        name: NAME,
        grpc_names: &["marey.v1.Refinement"],
        routes: Routes::new(rpc),
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
