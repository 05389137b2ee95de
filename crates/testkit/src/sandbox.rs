//! What a service stands on in one test: a throw-away database, a folder as object store, and a project.
//!
//! ```no_run
//! # async fn example(start: impl AsyncFnOnce(service::Config, tokio_util::sync::CancellationToken)
//! #     -> Result<service::Running, service::Error>) {
//! use testkit::sandbox::Sandbox;
//!
//! let sandbox = Sandbox::new().await;
//! let service = sandbox.serve(start, |config| config.worker.concurrency = 2).await;
//! let channel = service.channel().await;
//! service.stop().await;
//! # }
//! ```
//!
//! Everything here panics where a test could only fail.

use std::{net::SocketAddr, time::Duration};

use motion_db::{Clip, MotionDatabase};
use queue::{ChildJob, Job, NewRun, ProjectId, RunId, RunStatus};
use service::{Config, Running};
use sqlx::{PgPool, postgres::PgListener};
use store::{Key, Location, Store, Stored, key};
use tokio_util::sync::CancellationToken;
use tonic::transport::Channel;
use uuid::Uuid;

use crate::{postgres::TestDatabase, walker};

/// A run that takes longer has hung.
const LONGEST_RUN: Duration = Duration::from_secs(180);

/// A database, a store and a project of one test.
pub struct Sandbox {
    /// the database
    pub pool: PgPool,
    /// the store
    pub store: Store,
    /// the project that everything belongs to
    pub project: Uuid,
    database: TestDatabase,
    location: Location,
    _folder: tempfile::TempDir,
}

/// A motion database that is ready.
#[derive(Debug, Clone)]
pub struct AddedDatabase {
    /// its id
    pub id: Uuid,
    /// its name, in version 1
    pub name: String,
    /// where its index is in the store
    pub store_key: String,
    /// BLAKE3 of the index, hex
    pub blake3: String,
}

impl Sandbox {
    /// Empty but for the project.
    pub async fn new() -> Self {
        let database = TestDatabase::new().await.unwrap();
        let folder = tempfile::tempdir().unwrap();
        let location = Location::folder(folder.path());
        let store = Store::open(&location).unwrap();
        let pool = database.pool();
        let project = Uuid::now_v7();
        let sql = "INSERT INTO projects (id, name) VALUES ($1, 'lab')";
        sqlx::query(sql).bind(project).execute(&pool).await.unwrap();
        Self { pool, store, project, database, location, _folder: folder }
    }

    /// Starts a service here, on a free port; `change` makes its configuration another than the default.
    pub async fn serve(
        &self,
        start: impl AsyncFnOnce(Config, CancellationToken) -> Result<Running, service::Error>,
        change: impl FnOnce(&mut Config),
    ) -> Service {
        let any_port = SocketAddr::from(([127, 0, 0, 1], 0));
        let mut config = Config::new(self.database.url(), self.location.clone(), any_port);
        change(&mut config);
        let shutdown = CancellationToken::new();
        let running = start(config, shutdown.clone()).await.unwrap();
        Service { running, shutdown }
    }

    /// A capture session of that name.
    pub async fn add_session(&self, name: &str) -> Uuid {
        let id = Uuid::now_v7();
        let sql = "INSERT INTO sessions (id, project_id, name) VALUES ($1, $2, $3)";
        sqlx::query(sql).bind(id).bind(self.project).bind(name).execute(&self.pool).await.unwrap();
        id
    }

    /// A motion database `walks` of [`walker`]'s trials 1 to 4, four seconds each, that is ready.
    pub async fn add_walks(&self) -> AddedDatabase {
        let clip = |number: usize| Clip {
            name: format!("7_{number:02}"),
            subject: "7".to_owned(),
            action: "walk".to_owned(),
            motion: walker::motion(number, 480),
        };
        let built = MotionDatabase::build(&(1..=4).map(clip).collect::<Vec<_>>()).unwrap();
        let id = Uuid::now_v7();
        let key = key::motion_database(id, 1, 1, "index.mdb").unwrap();
        let stored = self.put(&key, built.to_bytes()).await;
        let sql = "INSERT INTO motion_databases
                       (id, project_id, name, version, store_key, bytes, blake3, num_poses, num_clips, ready_at)
                   VALUES ($1, $2, 'walks', 1, $3, $4, $5, $6, $7, now())";
        sqlx::query(sql)
            .bind(id)
            .bind(self.project)
            .bind(stored.key.as_str())
            .bind(stored.bytes as i64)
            .bind(&stored.blake3)
            .bind(built.num_poses() as i64)
            .bind(built.clips().len() as i64)
            .execute(&self.pool)
            .await
            .unwrap();
        AddedDatabase { id, name: "walks".to_owned(), store_key: stored.key.into(), blake3: stored.blake3 }
    }

    /// Puts an object into the store.
    pub async fn put(&self, key: &Key, content: impl Into<Vec<u8>>) -> Stored {
        self.store.put(key, content.into().into()).await.unwrap()
    }

    /// A run with its first job, as the gateway starts it.
    pub async fn enqueue<J: Job>(&self, run_kind: &str, session: Option<Uuid>, job: &J) -> RunId {
        let mut transaction = self.pool.begin().await.unwrap();
        let run = NewRun {
            project_id: ProjectId(self.project),
            kind: run_kind,
            session_id: session,
            parameters: serde_json::to_value(job).unwrap(),
        };
        let run = queue::enqueue_run(&mut transaction, &run).await.unwrap();
        queue::enqueue_many(&mut transaction, run, &[ChildJob::new(job).unwrap()]).await.unwrap();
        transaction.commit().await.unwrap();
        run
    }

    /// The run once it has ended.
    pub async fn finished(&self, run: RunId) -> RunStatus {
        let wait = async {
            let mut changes = PgListener::connect_with(&self.pool).await.unwrap();
            changes.listen(queue::channels::RUNS).await.unwrap();
            loop {
                let mut connection = self.pool.acquire().await.unwrap();
                let status = queue::run_status(&mut connection, run).await.unwrap().unwrap();
                if status.state.is_finished() {
                    return status;
                }
                drop(connection);
                changes.recv().await.unwrap();
            }
        };
        tokio::time::timeout(LONGEST_RUN, wait).await.expect("the run did not end")
    }
}

/// A service that was started.
pub struct Service {
    running: Running,
    shutdown: CancellationToken,
}

impl Service {
    /// Where its gRPC server listens, such as `http://127.0.0.1:40123`.
    pub fn address(&self) -> String {
        format!("http://{}", self.running.address)
    }

    /// A connection to its gRPC server.
    pub async fn channel(&self) -> Channel {
        Channel::from_shared(self.address()).unwrap().connect().await.unwrap()
    }

    /// Asks it to stop.
    pub fn shut_down(&self) {
        self.shutdown.cancel();
    }

    /// Asks it to stop and waits until it has.
    pub async fn stop(self) {
        self.shut_down();
        let stopped = tokio::time::timeout(Duration::from_secs(30), self.running.stopped()).await;
        stopped.expect("the service did not stop").unwrap();
    }
}
