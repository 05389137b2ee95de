//! The PostgreSQL job queue.
//!
//! A [run](NewRun) is a small graph of jobs in one database, enqueued in the same transaction as the rows
//! that it is about. Workers claim jobs under a lease, work without holding a transaction, beat while they
//! work, and complete in one fenced transaction. `docs/queue.md` draws the state machine and names the
//! invariants.
//!
//! ```no_run
//! # async fn example(pool: sqlx::PgPool, project_id: queue::ProjectId) -> Result<(), Box<dyn std::error::Error>> {
//! use queue::{ChildJob, Handler, Job, JobContext, JobError, NewRun, Outcome, Worker};
//! use serde::{Deserialize, Serialize};
//! use tokio_util::sync::CancellationToken;
//!
//! #[derive(Serialize, Deserialize)]
//! struct Greet {
//!     name: String,
//! }
//!
//! impl Job for Greet {
//!     const KIND: &'static str = "greet";
//! }
//!
//! struct Greeter;
//!
//! impl Handler for Greeter {
//!     type Job = Greet;
//!
//!     async fn run(&self, context: JobContext, job: Greet) -> Result<Outcome, JobError> {
//!         context.progress(0.5, format!("greeting {}", job.name));
//!         Ok(Outcome::default())
//!     }
//! }
//!
//! queue::MIGRATOR.run(&pool).await?;
//! let mut transaction = pool.begin().await?;
//! let run = NewRun { project_id, kind: "greeting", session_id: None, parameters: serde_json::json!({}) };
//! let run_id = queue::enqueue_run(&mut transaction, &run).await?;
//! let greet = |name: &str| ChildJob::new(&Greet { name: name.to_owned() });
//! let jobs = [greet("Ada")?, greet("Grace")?, greet("everyone")?.depends_on([0, 1])];
//! queue::enqueue_many(&mut transaction, run_id, &jobs).await?;
//! transaction.commit().await?;
//!
//! let shutdown = CancellationToken::new();
//! let worker = Worker::builder(pool).handler(Greeter).concurrency(2).start(shutdown.clone());
//! shutdown.cancel();
//! worker.stopped().await;
//! # Ok(())
//! # }
//! ```

mod backoff;
pub mod channels;
mod claim;
mod enqueue;
mod error;
mod finish;
mod ids;
mod job;
mod lease;
mod on_complete;
mod read;
mod reap;
mod run;
mod settings;
mod state;
mod worker;

pub use backoff::RetryPolicy;
pub use claim::{claim, is_any_available};
pub use enqueue::enqueue_many;
pub use error::{Error, JobError};
pub use finish::{Completion, Failure, Lease, Settled, acknowledge_cancel, complete, fail, hand_back};
pub use ids::{JobId, LeaseNumber, ProjectId, RunId};
pub use job::{Artefact, ChildJob, ClaimedJob, DEFAULT_MAX_ATTEMPTS, Job};
pub use lease::{Beat, BeatAnswer, heartbeat};
pub use on_complete::OnComplete;
pub use read::{Depth, InputArtefact, dependency_artefacts, depth, run_results};
pub use reap::{Reaped, reap};
pub use run::{NewRun, RunStatus, cancel_run, enqueue_run, run_status};
pub use settings::{heartbeat_interval, set_staleness, staleness};
pub use state::{JobState, RunState, UnknownState};
pub use worker::{Handler, JobContext, Outcome, Worker, WorkerBuilder, WorkerHandle};

/// The schema of the whole system, `migrations/` in the repository.
pub static MIGRATOR: sqlx::migrate::Migrator = sqlx::migrate!("../../migrations");
