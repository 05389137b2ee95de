//! `marey up`: everything in one process, with a PostgreSQL of its own and a folder as object store.

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::Context;
use client::{DEFAULT_DATA_DIR, Server};
use gateway::{
    Gateway,
    access::{self, Scope},
};
use private_postgres::PrivateCluster;
use service::config::{TelemetryConfig, Variables, environment};
use sqlx::{Connection, PgConnection};
use store::Location;
use tokio_util::sync::CancellationToken;

use crate::{CODE, serve::runtime};

/// Running jobs get so long to end after Ctrl-C, before they are handed back to be done again.
const GRACE: Duration = Duration::from_secs(5);

/// Start everything on this machine
///
/// PostgreSQL, the HTTP interface and the services that do the work, in one process. Everything is kept in the data folder:
/// when you start it again, all of it is still there. Ctrl-C stops it. Only this machine can reach it, unless you change
/// --listen.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:
  marey up
  marey up --data-dir /srv/marey --listen 0.0.0.0:8080 --workers 8")]
pub struct Args {
    /// Folder in which everything is kept
    #[arg(long, default_value = DEFAULT_DATA_DIR, value_name = "DIR")]
    pub data_dir: PathBuf,
    /// Address and port of the HTTP interface; port 0 takes a free one
    #[arg(long, default_value = "127.0.0.1:8080", value_name = "ADDRESS")]
    pub listen: SocketAddr,
    /// Jobs to work on at the same time [default: number of cores]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..))]
    pub workers: Option<u32>,
}

/// Runs `marey up` until SIGTERM or SIGINT.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut telemetry = TelemetryConfig::from_variables(&Variables::new(&environment))?;
    telemetry.filter.get_or_insert_with(|| "warn,sqlx=error".into());
    service::telemetry::start(&telemetry)?;
    runtime()?.block_on(async {
        let shutdown = service::shutdown::on_signal()?;
        let Some(everything) = Everything::start(args, shutdown.clone()).await? else {
            return Ok(());
        };
        let server = &everything.server;
        println!("Marey is up.\n");
        println!("  address   {}", server.url);
        println!("  API page  {}/docs", server.url);
        println!("  API key   {}", server.api_key);
        println!("  data      {}", everything.data_dir.display());
        if everything.cluster_dir.parent() != Some(&everything.data_dir) {
            println!("  database  {}", everything.cluster_dir.display());
        }
        if everything.data_dir.ends_with(DEFAULT_DATA_DIR) {
            println!(
                "\nCommands run in this folder find it by themselves; try `marey --help`. Ctrl-C stops it."
            );
        } else {
            println!("\nFor commands in another terminal:");
            println!("  export MAREY_URL={} MAREY_API_KEY={}", server.url, server.api_key);
            println!("Ctrl-C stops it.");
        }
        everything.until_stopped(shutdown).await
    })
}

/// All services, running.
pub struct Everything {
    /// how to talk to it
    pub server: Server,
    /// where everything is kept
    pub data_dir: PathBuf,
    /// where PostgreSQL keeps its files
    pub cluster_dir: PathBuf,
    cluster: PrivateCluster,
    gateway: Gateway,
    services: [service::Running; 4],
}

impl Everything {
    /// Starts it all; `None` if `shutdown` came first.
    ///
    /// # Errors
    /// If a part can't be started; those started before are stopped.
    pub async fn start(args: &Args, shutdown: CancellationToken) -> anyhow::Result<Option<Self>> {
        std::fs::create_dir_all(&args.data_dir).with_context(|| args.data_dir.display().to_string())?;
        let data_dir = args.data_dir.canonicalize()?;
        let starting = data_dir.clone();
        let cluster = tokio::task::spawn_blocking(move || start_cluster(&starting)).await??;
        let cluster_dir = cluster.config().data_dir.clone();
        if shutdown.is_cancelled() {
            stop(cluster).await?;
            return Ok(None);
        }
        let stop_started = shutdown.child_token();
        match start_services(args, &data_dir, &cluster, stop_started.clone()).await {
            Ok((server, gateway, services)) => {
                Ok(Some(Self { server, data_dir, cluster_dir, cluster, gateway, services }))
            }
            Err(error) => {
                stop_started.cancel();
                stop(cluster).await?;
                Err(error)
            }
        }
    }

    /// Waits for `shutdown`, or for a part to fail, and stops everything in order.
    ///
    /// # Errors
    /// Of the part that failed.
    pub async fn until_stopped(self, shutdown: CancellationToken) -> anyhow::Result<()> {
        let [motion_index, reconstruction, shape_init, refinement] = self.services;
        let gateway = async { self.gateway.stopped().await.context("gateway") };
        let motion_index = async { motion_index.stopped().await.context("motion-index") };
        let reconstruction = async { reconstruction.stopped().await.context("reconstruction") };
        let shape_init = async { shape_init.stopped().await.context("shape-init") };
        let refinement = async { refinement.stopped().await.context("refinement") };
        // whichever ends takes the others with it
        let ended = |result: anyhow::Result<()>| {
            shutdown.cancel();
            result
        };
        let (a, b, c, d, e) = tokio::join!(
            async { ended(gateway.await) },
            async { ended(motion_index.await) },
            async { ended(reconstruction.await) },
            async { ended(shape_init.await) },
            async { ended(refinement.await) },
        );
        stop(self.cluster).await?;
        a.and(b).and(c).and(d).and(e)
    }
}

async fn start_services(
    args: &Args,
    data_dir: &Path,
    cluster: &PrivateCluster,
    shutdown: CancellationToken,
) -> anyhow::Result<(Server, Gateway, [service::Running; 4])> {
    cluster.create_database("marey").await?;
    let database_url = cluster.url("marey");
    let store = Location::folder(data_dir.join("objects"));

    let mut config = gateway::Config::new(&database_url, store.clone());
    config.listen = args.listen;
    let replicas = config.reconstruction.clone();
    let gateway = Gateway::start(&config, shutdown.clone()).await?;
    let api_key = api_key(data_dir, &database_url).await?;

    let any_port = SocketAddr::from(([127, 0, 0, 1], 0));
    let mut config = service::Config::new(&database_url, store, any_port);
    config.code = CODE;
    config.grpc.shutdown_grace = GRACE;
    config.worker.shutdown_grace = GRACE;
    if let Some(workers) = args.workers {
        config.worker.concurrency = workers as usize;
    }
    let reconstruction = reconstruction::start(config.clone(), shutdown.clone()).await?;
    replicas.set(reconstruction.address);
    let shape_init = shape_init::start(config.clone(), shutdown.clone()).await?;
    let refinement = refinement::start(config.clone(), shutdown.clone()).await?;
    let motion_index = motion_index::start(config, shutdown).await?;

    let server =
        Server { url: format!("http://{}", gateway.address()), api_key, database_url: Some(database_url) };
    server.write(data_dir)?;
    Ok((server, gateway, [motion_index, reconstruction, shape_init, refinement]))
}

/// The key of earlier times, or a new one.
async fn api_key(data_dir: &Path, database_url: &str) -> anyhow::Result<String> {
    let mut db = PgConnection::connect(database_url).await?;
    if let Some(server) = Server::in_data_dir(data_dir)?
        && access::is_known(&mut db, &server.api_key).await?
    {
        return Ok(server.api_key);
    }
    Ok(access::create_key(&mut db, "default", "marey up", &Scope::ALL).await?)
}

/// PostgreSQL in the data folder, or, where its user may not enter that, in one of the system's.
fn start_cluster(data_dir: &Path) -> anyhow::Result<PrivateCluster> {
    let id = &blake3::hash(data_dir.as_os_str().as_encoded_bytes()).to_hex()[..12];
    let start = |folder: &Path| {
        let socket_dir = match folder.join("socket") {
            // with the socket's own name this stays within the kernel's limit
            short if short.as_os_str().len() < 85 => short,
            _ => std::env::temp_dir().join(format!("marey-{id}")),
        };
        PrivateCluster::start(private_postgres::Config {
            data_dir: folder.join("postgres"),
            socket_dir,
            durable: true,
        })
    };
    match start(data_dir) {
        Err(private_postgres::Error::NotTraversable { .. }) => {
            Ok(start(&Path::new("/var/lib/marey").join(id))?)
        }
        result => Ok(result?),
    }
}

async fn stop(cluster: PrivateCluster) -> anyhow::Result<()> {
    tokio::task::spawn_blocking(move || cluster.stop()).await??;
    Ok(())
}
