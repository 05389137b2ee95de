//! The services, in this process or as processes of their own, on a database and a store that are thrown away.

use std::{
    net::SocketAddr,
    process::{Child, Command, Stdio},
    sync::OnceLock,
    time::Duration,
};

use anyhow::Context;
use gateway::{
    Gateway,
    access::{self, Scope},
};
use service::Running;
use store::Location;
use tempfile::TempDir;
use testkit::postgres::TestDatabase;
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;

use crate::Api;

/// Largest upload of the system under test, bytes.
pub const MAX_UPLOAD_BYTES: u64 = 8 << 20;

/// A gateway with whatever services a test starts beside it.
pub struct System {
    runtime: Option<Runtime>,
    database: TestDatabase,
    store: TempDir,
    shutdown: CancellationToken,
    gateway: Option<Gateway>,
    replicas: gateway::Replicas,
    services: Vec<Running>,
    url: String,
}

impl System {
    /// A gateway, nothing else.
    pub fn start() -> anyhow::Result<Self> {
        Self::start_on(TestDatabase::new())
    }

    /// A gateway on a database server that no other test uses.
    pub fn start_in_own_cluster() -> anyhow::Result<Self> {
        Self::start_on(TestDatabase::in_own_cluster())
    }

    fn start_on(
        database: impl Future<Output = Result<TestDatabase, testkit::postgres::Error>>,
    ) -> anyhow::Result<Self> {
        let runtime = Runtime::new()?;
        let shutdown = CancellationToken::new();
        let store = TempDir::new()?;
        let (database, gateway, replicas) = runtime.block_on(async {
            let database = database.await?;
            let mut config = gateway::Config::new(database.url(), Location::folder(store.path()));
            config.listen = any_port();
            config.max_upload_bytes = MAX_UPLOAD_BYTES;
            config.upload_stall = Duration::from_secs(5);
            config.max_connections = 8;
            let gateway = Gateway::start(&config, shutdown.clone()).await?;
            anyhow::Ok((database, gateway, config.reconstruction))
        })?;
        let url = format!("http://{}", gateway.address());
        Ok(Self {
            runtime: Some(runtime),
            database,
            store,
            shutdown,
            gateway: Some(gateway),
            replicas,
            services: Vec::new(),
            url,
        })
    }

    /// A gateway and one shape-init of so many jobs at once, in this process.
    pub fn with_shape_init(workers: usize) -> anyhow::Result<Self> {
        let mut system = Self::start()?;
        system.start_shape_init(workers)?;
        Ok(system)
    }

    /// A gateway, one motion-index and one reconstruction of so many jobs at once, in this process.
    pub fn with_services(workers: usize) -> anyhow::Result<Self> {
        let mut system = Self::start()?;
        system.start_motion_index()?;
        system.start_reconstruction(workers)?;
        Ok(system)
    }

    /// Starts a motion-index in this process.
    pub fn start_motion_index(&mut self) -> anyhow::Result<()> {
        let (config, shutdown) = (self.service_config(1), self.shutdown.clone());
        self.services.push(self.runtime()?.block_on(motion_index::start(config, shutdown))?);
        Ok(())
    }

    /// Starts a reconstruction in this process, of so many jobs at once.
    pub fn start_reconstruction(&mut self, workers: usize) -> anyhow::Result<()> {
        let (config, shutdown) = (self.service_config(workers), self.shutdown.clone());
        let service = self.runtime()?.block_on(reconstruction::start(config, shutdown))?;
        self.replicas.set(service.address);
        self.services.push(service);
        Ok(())
    }

    /// Starts a shape-init in this process, of so many jobs at once.
    pub fn start_shape_init(&mut self, workers: usize) -> anyhow::Result<()> {
        let (config, shutdown) = (self.service_config(workers), self.shutdown.clone());
        self.services.push(self.runtime()?.block_on(shape_init::start(config, shutdown))?);
        Ok(())
    }

    /// A gateway, one shape-init and one refinement of so many jobs at once, in this process.
    pub fn with_cameras(workers: usize) -> anyhow::Result<Self> {
        let mut system = Self::with_shape_init(workers)?;
        let (config, shutdown) = (system.service_config(workers), system.shutdown.clone());
        let service = system.runtime()?.block_on(refinement::start(config, shutdown))?;
        system.services.push(service);
        Ok(system)
    }

    fn service_config(&self, workers: usize) -> service::Config {
        let mut config =
            service::Config::new(self.database.url(), Location::folder(self.store.path()), any_port());
        config.worker.concurrency = workers;
        config.code = marey::CODE;
        config
    }

    /// `marey serve SERVICE` of this program as a process of its own, one job at once.
    pub fn spawn(&self, program: &str, service: &str, name: &str) -> anyhow::Result<Process> {
        let mut command = Command::new(program);
        command
            .args(["serve", service])
            .env("MAREY_DATABASE_URL", self.database.url())
            .env("MAREY_STORE", self.store.path())
            .env("MAREY_LISTEN", "127.0.0.1:0")
            .env("MAREY_WORKER_CONCURRENCY", "1")
            .env("MAREY_WORKER_NAME", name)
            .env("MAREY_LOG", "warn")
            .stdin(Stdio::null());
        Ok(Process(command.spawn().with_context(|| program.to_owned())?))
    }

    /// A caller with a new key, of that project, with these scopes.
    pub fn caller(&self, project: &str, scopes: &[Scope]) -> anyhow::Result<Api> {
        let key = self.runtime()?.block_on(async {
            let mut connection = self.database.pool().acquire().await?;
            access::create_key(&mut connection, project, "test", scopes).await
        })?;
        Ok(Api::new(&self.url, &key))
    }

    /// A caller who may do everything in that project.
    pub fn project(&self, project: &str) -> anyhow::Result<Api> {
        self.caller(project, &Scope::ALL)
    }

    /// A caller without a key.
    pub fn stranger(&self) -> Api {
        Api::new(&self.url, "")
    }

    /// Changes how long a worker may go without a sign of life.
    pub fn set_staleness(&self, staleness: Duration) -> anyhow::Result<()> {
        self.runtime()?.block_on(async {
            let mut connection = self.database.pool().acquire().await?;
            Ok(queue::set_staleness(&mut connection, staleness).await?)
        })
    }

    /// Number of objects in the store, however unfinished.
    pub fn num_objects(&self) -> usize {
        fn count(folder: &std::path::Path) -> usize {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            entries.map(|e| if e.path().is_dir() { count(&e.path()) } else { 1 }).sum()
        }
        count(self.store.path())
    }

    /// Crashes the database's server and starts it again.
    pub fn restart_database(&self) -> anyhow::Result<()> {
        Ok(self.runtime()?.block_on(self.database.restart_immediate())?)
    }

    fn runtime(&self) -> anyhow::Result<&Runtime> {
        self.runtime.as_ref().context("the system was stopped")
    }
}

impl Drop for System {
    fn drop(&mut self) {
        self.shutdown.cancel();
        let Some(runtime) = self.runtime.take() else { return };
        let (gateway, services) = (self.gateway.take(), std::mem::take(&mut self.services));
        // A test that failed has other things to tell than how its system ended.
        let ended = async {
            if let Some(gateway) = gateway {
                gateway.stopped().await?;
            }
            for service in services {
                service.stopped().await?;
            }
            anyhow::Ok(())
        };
        let _ = runtime.block_on(async { tokio::time::timeout(Duration::from_secs(20), ended).await });
        runtime.shutdown_background();
    }
}

/// A process that does not outlive the test.
pub struct Process(Child);

impl Process {
    /// `kill -9`.
    pub fn kill(&mut self) -> anyhow::Result<()> {
        self.0.kill()?;
        self.0.wait()?;
        Ok(())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.kill();
    }
}

/// A system with one motion-index and one reconstruction of two jobs at once that all tests of a process may share.
pub fn shared() -> &'static System {
    static SHARED: OnceLock<System> = OnceLock::new();
    SHARED.get_or_init(|| System::with_services(2).expect("the services start"))
}

fn any_port() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 0))
}
