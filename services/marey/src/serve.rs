//! `marey serve`: one service as a process of its own.

use anyhow::Context;
use service::config::{TelemetryConfig, Variables, environment};

use crate::CODE;

/// What every service with a worker is told.
const VARIABLES: &str = "\
Must be set:
  MAREY_DATABASE_URL          PostgreSQL, postgres://user@host/name
  MAREY_STORE                 folder or URL for objects
May be set:
  MAREY_LISTEN                address to listen on
  MAREY_WORKER_CONCURRENCY    jobs at once [default: number of cores]; 0 answers calls only
  MAREY_WORKER_NAME           name in the queue and in run.json
  MAREY_DATABASE_CONNECTIONS  PostgreSQL connections, besides three of the worker [default: 8]
  MAREY_SHUTDOWN_GRACE_SECS   time for calls and jobs after a signal [default: 20]
  MAREY_DATABASE_CACHE_BYTES  what was learned and is kept in memory [default: 2 GiB]
  MAREY_MAX_OBJECT_BYTES      largest object read into memory [default: 1 GiB]
  MAREY_MAX_INPUT_BYTES       unpacked files of one build [default: 8 GiB]
  MAREY_MAX_BUILD_BYTES       what one job of a build keeps in memory [default: 2 GiB]
  MAREY_MAX_SESSION_FRAMES    frames of one session at 60 a second [default: 432000]
  MAREY_LOG                   filter, such as warn,motion_index=debug [default: info,sqlx=warn]
  MAREY_LOG_FORMAT            pretty or json [default: pretty]";

/// `marey serve …`
#[derive(Debug, clap::Subcommand)]
pub enum Service {
    /// The HTTP interface
    ///
    /// MAREY_DATABASE_URL and MAREY_STORE must be set. MAREY_LISTEN (127.0.0.1:8080), MAREY_MAX_UPLOAD_BYTES (536870912),
    /// MAREY_BOOTSTRAP_KEY, MAREY_RECONSTRUCTION (http://127.0.0.1:50052, where live streams go), MAREY_LOG and MAREY_LOG_FORMAT
    /// may be set.
    Gateway,
    /// Builds motion databases and answers queries on them
    ///
    /// Listens on 127.0.0.1:50051. Several replicas are given MAREY_MOTION_INDEX_PEERS (the addresses of all) and
    /// MAREY_MOTION_INDEX_SELF (which of them this one is).
    #[command(after_help = VARIABLES)]
    MotionIndex,
    /// Reconstructs motion
    ///
    /// Listens on 127.0.0.1:50052. MAREY_LIVE_STREAMS (8 a core) and MAREY_LIVE_IDLE_SECS (60) bound live streams.
    #[command(after_help = VARIABLES)]
    Reconstruction,
    /// Learns body models, makes silhouettes, finds pose and shape in them, draws what was found over videos
    ///
    /// Listens on 127.0.0.1:50053. Videos need the program ffmpeg and room for a copy in TMPDIR.
    #[command(after_help = VARIABLES)]
    ShapeInit,
    /// Follows people through the frames of sessions with cameras
    ///
    /// Listens on 127.0.0.1:50054.
    #[command(after_help = VARIABLES)]
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

#[cfg(test)]
mod tests {
    use super::VARIABLES;

    #[test]
    fn help_names_every_variable_of_a_service_with_its_default() {
        let table = include_str!("../../../crates/service/src/config.rs");
        let rows = table.lines().filter_map(|line| line.strip_prefix("//! | `MAREY_"));
        let mut count = 0;
        for row in rows {
            let mut cells = row.split('|').map(|cell| cell.trim().trim_matches('`'));
            let (name, default) = (cells.next().unwrap_or_default(), cells.next().unwrap_or_default());
            let stated =
                VARIABLES.lines().find(|line| line.trim_start().starts_with(&format!("MAREY_{name} ")));
            let stated = stated.unwrap_or_else(|| panic!("MAREY_{name} is not in the help"));
            if default.starts_with(|c: char| c.is_ascii_digit()) || name.starts_with("LOG") {
                assert!(stated.contains(&format!("[default: {default}]")), "{stated} is not {default}");
            }
            count += 1;
        }
        assert!(count >= 14, "{count}");
    }
}
