use bytes::Bytes;
use futures::future::BoxFuture;
use jobs::{
    InputFile, JobReport,
    run_json::{Code, Origin},
};
use queue::{Artefact, Handler, JobContext, JobError};
use serde::de::DeserializeOwned;
use sqlx::PgPool;
use store::{Store, key};

use crate::{
    Config, Error,
    config::{MemoryConfig, WorkerConfig},
    database,
    making_versions::{CleanStart, MakesVersion},
    objects::{self, Input},
};

/// What all handlers of one process work with.
#[derive(Debug, Clone)]
pub struct Resources {
    /// Where objects are.
    pub store: Store,
    /// The database.
    pub pool: PgPool,
    /// Bounds on memory.
    pub memory: MemoryConfig,
    /// How this process shows in `run.json`.
    pub worker_name: String,
    code: Code,
}

impl Resources {
    /// Those of a service of that name.
    ///
    /// # Errors
    /// If the store or the database's URL can't be used. A database that does not answer yet is waited for.
    pub fn open(config: &Config, service: &str) -> Result<Self, Error> {
        Ok(Self {
            pool: database::pool(&config.database)?,
            store: Store::open(&config.store)?,
            memory: config.memory.clone(),
            worker_name: config.worker.name(service),
            code: config.code,
        })
    }

    /// A worker loop that is set up as configured; `None` if it is to claim nothing. Before every attempt at a job it removes
    /// what earlier ones left of artefacts and results; what they left of a version, [`Self::making_versions`] does.
    pub fn worker(&self, config: &WorkerConfig) -> Option<queue::WorkerBuilder> {
        let store = self.store.clone();
        let clean_up = move |context: JobContext| -> BoxFuture<'static, ()> {
            let store = store.clone();
            Box::pin(async move {
                let own = key::job_prefix(context.run_id().0, context.id().0);
                objects::clean_up_earlier_attempts(&store, &context, &own).await;
            })
        };
        (config.concurrency > 0).then(|| {
            queue::Worker::builder(self.pool.clone())
                .name(self.worker_name.clone())
                .concurrency(config.concurrency)
                .grace(config.shutdown_grace)
                .before_attempt(clean_up)
        })
    }

    /// A handler that also writes the files of a version, as a worker is to run it: before every attempt it removes what earlier
    /// ones left of these.
    pub fn making_versions<H: MakesVersion>(&self, handler: H) -> impl Handler<Job = H::Job> {
        CleanStart { store: self.store.clone(), handler }
    }

    /// What a `run.json` that this job writes comes from.
    pub fn origin(&self, context: &JobContext) -> Origin {
        Origin { run_id: context.run_id().0, code: self.code }
    }

    /// What a job has taken so far.
    pub fn job_report(&self, context: &JobContext, frames: usize) -> JobReport {
        JobReport {
            worker: self.worker_name.clone(),
            attempt: context.attempt(),
            seconds: context.elapsed().as_secs_f64(),
            frames,
        }
    }

    /// What the jobs that this one waited for have left, in the order in which those were enqueued.
    ///
    /// # Errors
    /// To be tried again if the database does not answer.
    pub async fn artefacts_before(&self, job: &JobContext) -> Result<Vec<Artefact>, JobError> {
        let mut connection = self.pool.acquire().await?;
        let found = queue::dependency_artefacts(&mut connection, job.id()).await?;
        Ok(found.into_iter().map(|input| input.artefact).collect())
    }

    /// Reads an uploaded file whole.
    ///
    /// # Errors
    /// As [`objects::read`].
    pub async fn read_file(&self, file: &InputFile, max_bytes: u64) -> Result<Bytes, JobError> {
        let input = Input { name: &file.name, store_key: &file.store_key, blake3: &file.blake3 };
        objects::read(&self.store, input, max_bytes).await
    }

    /// Reads an artefact whole.
    ///
    /// # Errors
    /// As [`objects::read`].
    pub async fn read_artefact(&self, artefact: &Artefact, max_bytes: u64) -> Result<Bytes, JobError> {
        objects::read(&self.store, Input::from(artefact), max_bytes).await
    }

    /// Reads an artefact that was written with [`objects::write_json`].
    ///
    /// # Errors
    /// As [`objects::read_json`].
    pub async fn read_json<T: DeserializeOwned>(
        &self,
        artefact: &Artefact,
        max_bytes: u64,
    ) -> Result<T, JobError> {
        objects::read_json(&self.store, Input::from(artefact), max_bytes).await
    }
}
