//! The shape-init service: body models from scans, silhouettes from cameras, pose and shape of a person in the first frames.
//!
//! [`start`] runs the gRPC server (`marey.v1.ShapeInit`, health, reflection) and claims five kinds of job:
//!
//! ```text
//! build-body-model     plan-multi-view ──► make-silhouettes × cameras ──► fit-shape ──► (refinement) ──► draw-overlay × cameras
//! ```
//!
//! The plan reads the calibration and finds out whose file is whose. One job a camera streams its frames and leaves packed
//! silhouettes, 600 frames an artefact, with what was found of their quality. `fit-shape` fits a body to the
//! first frames and enqueues the jobs that follow the person through all of them, which the refinement
//! service takes; what they found is drawn over what each camera saw.

mod build_job;
mod children;
mod drawing;
mod error;
mod export;
mod find;
mod fit;
mod frames;
mod hull;
mod members;
mod opened;
mod overlay_job;
mod plan_job;
mod rpc;
mod scratch;
mod segment;
mod shape_job;
mod shape_report;
mod silhouettes_job;
mod sources;

pub use error::InputError;

use library::body_model::Models;
use proto::v1::shape_init_server::ShapeInitServer;
use service::{Config, Parts, Resources, Running};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;

/// Name of the service in logs and in the queue.
pub const NAME: &str = "shape-init";

/// Where it listens unless told otherwise: this machine only.
pub const DEFAULT_LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 50053);

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
    let rpc =
        ShapeInitServer::new(rpc::Rpc::new(shared.clone())).max_decoding_message_size(rpc::MAX_REQUEST_BYTES);
    let builder = shared.resources.worker(&config.worker).map(|builder| {
        builder
            .handler(shared.resources.making_versions(build_job::BuildHandler { shared: shared.clone() }))
            .handler(plan_job::PlanHandler { shared: shared.clone() })
            .handler(silhouettes_job::SilhouettesHandler { shared: shared.clone() })
            .handler(shape_job::ShapeHandler { shared: shared.clone() })
            .handler(overlay_job::OverlayHandler { shared })
    });
    let parts = Parts {
        name: NAME,
        grpc_names: &["marey.v1.ShapeInit"],
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
