//! `marey serve`: one service as a process of its own.

use anyhow::Context;
use service::config::{TelemetryConfig, Variables, environment};

use crate::CODE;

/// `marey serve …`
#[derive(Debug, clap::Subcommand)]
pub enum Service {
    /// The HTTP interface
    ///
    /// MAREY_DATABASE_URL and MAREY_STORE must be set. MAREY_LISTEN (127.0.0.1:8080), MAREY_MAX_UPLOAD_BYTES (536870912),
    /// MAREY_BOOTSTRAP_KEY and MAREY_RECONSTRUCTION (http://127.0.0.1:50052, where live streams go) may be set.
    Gateway,
    /// Builds motion databases and answers queries on them
    ///
    /// MAREY_DATABASE_URL and MAREY_STORE must be set. MAREY_LISTEN (127.0.0.1:50051), MAREY_WORKER_CONCURRENCY and others
    /// may be set.
    MotionIndex,
    /// Reconstructs motion
    ///
    /// MAREY_DATABASE_URL and MAREY_STORE must be set. MAREY_LISTEN (127.0.0.1:50052), MAREY_WORKER_CONCURRENCY and others
    /// may be set.
    Reconstruction,
    /// Learns body models, makes silhouettes, finds pose and shape in them, draws what was found over videos
    ///
    /// MAREY_DATABASE_URL and MAREY_STORE must be set. MAREY_LISTEN (127.0.0.1:50053), MAREY_WORKER_CONCURRENCY and others
    /// may be set. Videos need the program ffmpeg and room for a copy in TMPDIR.
    ShapeInit,
    /// Follows people through the frames of sessions with cameras
    ///
    /// MAREY_DATABASE_URL and MAREY_STORE must be set. MAREY_LISTEN (127.0.0.1:50054), MAREY_WORKER_CONCURRENCY and others
    /// may be set.
    Refinement,
}

/// Runs `marey serve` until SIGTERM or SIGINT.
pub fn run(which: &Service) -> anyhow::Result<()> {
    let variables = Variables::new(&environment);
    service::telemetry::start(&TelemetryConfig::from_variables(&variables)?)?;
    runtime()?.block_on(async {
        let shutdown = service::shutdown::on_signal()?;
        match which {
            Service::Gateway => {
                let config = gateway::Config::from_variables(environment)?;
                gateway::run(config, shutdown).await
            }
            Service::MotionIndex => {
                let config = motion_index::Config::from_variables(&variables, CODE)?;
                Ok(motion_index::run(config, shutdown).await?)
            }
            Service::Reconstruction => {
                let config = reconstruction::Config::from_variables(&variables, CODE)?;
                Ok(reconstruction::run(config, shutdown).await?)
            }
            Service::ShapeInit => {
                let config = service::Config::from_variables(&variables, shape_init::DEFAULT_LISTEN, CODE)?;
                Ok(shape_init::run(config, shutdown).await?)
            }
            Service::Refinement => {
                let config = service::Config::from_variables(&variables, refinement::DEFAULT_LISTEN, CODE)?;
                Ok(refinement::run(config, shutdown).await?)
            }
        }
    })
}

/// The runtime of everything that serves.
pub fn runtime() -> anyhow::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build().context("the runtime can't be started")
}
