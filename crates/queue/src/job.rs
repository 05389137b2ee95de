//! Jobs to be enqueued, jobs that were claimed, and what jobs leave behind.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{Error, JobId, LeaseNumber, ProjectId, RunId};

/// Attempts that a job gets unless it says otherwise.
pub const DEFAULT_MAX_ATTEMPTS: i32 = 3;

/// What a job is given: the payload of one kind of job, and how such jobs are enqueued and read.
///
/// A payload whose meaning changes gets the next [`VERSION`](Self::VERSION): a job that was enqueued before and is run
/// after the change is then brought up to date by [`upgrade`](Self::upgrade), or refused, and never misread.
pub trait Job: Serialize + DeserializeOwned + Send + 'static {
    /// Which handler runs it.
    const KIND: &'static str;
    /// Version of the payload, from 1. It holds for all that the payload is made of: where one payload holds another, such as a
    /// merge the plan's, or names artefacts to be read, both go up together.
    const VERSION: i32 = 1;
    /// After so many failed attempts the job has failed for good; 1 to 1000.
    const MAX_ATTEMPTS: i32 = DEFAULT_MAX_ATTEMPTS;

    /// The payload of another version as one of [`VERSION`](Self::VERSION); `None` if that can't be said.
    fn upgrade(version: i32, payload: Value) -> Option<Value> {
        let _ = (version, payload);
        None
    }
}

/// A job to be added to a run in a batch: the jobs that another asks for when it completes, or those of a new run.
#[derive(Debug, Clone, PartialEq)]
pub struct ChildJob {
    /// Which handler runs it.
    pub kind: &'static str,
    /// What the handler is given.
    pub payload: Value,
    /// Version of the payload.
    pub payload_version: i32,
    /// Higher goes first within a project; 0 is usual.
    pub priority: i16,
    /// After so many failed attempts the job has failed for good; 1 to 1000.
    pub max_attempts: i32,
    /// Positions in the batch of jobs that must have succeeded before; each before this one's own.
    pub depends_on: Vec<usize>,
    /// Share in the run's progress, above 0; 1 is usual.
    pub weight: f64,
}

impl ChildJob {
    /// A job with the usual priority and weight that depends on nothing.
    ///
    /// # Errors
    /// [`Error::Payload`].
    pub fn new<J: Job>(job: &J) -> Result<Self, Error> {
        Ok(Self {
            kind: J::KIND,
            payload: serde_json::to_value(job).map_err(|source| Error::Payload { kind: J::KIND, source })?,
            payload_version: J::VERSION,
            priority: 0,
            max_attempts: J::MAX_ATTEMPTS,
            depends_on: Vec::new(),
            weight: 1.0,
        })
    }

    /// The same job, waiting for these positions of the batch.
    #[must_use]
    pub fn depends_on(mut self, positions: impl IntoIterator<Item = usize>) -> Self {
        self.depends_on = positions.into_iter().collect();
        self
    }

    /// The same job with another share in the run's progress.
    #[must_use]
    pub fn weight(mut self, weight: f64) -> Self {
        self.weight = weight;
        self
    }
}

/// A job as its claimer got it. Holding it is holding a lease, as long as heartbeats are answered.
#[derive(Debug, Clone, PartialEq, sqlx::FromRow)]
pub struct ClaimedJob {
    /// The job.
    pub id: JobId,
    /// The run that it belongs to.
    pub run_id: RunId,
    /// The project that it belongs to.
    pub project_id: ProjectId,
    /// Which handler runs it.
    pub kind: String,
    /// What the handler is given.
    pub payload: Value,
    /// Version of the payload.
    pub payload_version: i32,
    /// Which attempt this is, from 1.
    pub attempt: i32,
    /// How many attempts there are.
    pub max_attempts: i32,
    /// The number of this claim.
    pub lease_number: LeaseNumber,
}

/// A file that a job left in the object store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, sqlx::FromRow)]
pub struct Artefact {
    /// Name within the job, and for a result within the run.
    pub name: String,
    /// Key in the object store. It contains the lease number, so that two attempts never write one key.
    pub store_key: String,
    /// Length, bytes.
    pub bytes: i64,
    /// BLAKE3 of the content, 64 lower-case hexadecimal digits.
    pub blake3: String,
    /// Such as `application/json`.
    pub media_type: String,
    /// Whether the user gets it.
    pub is_result: bool,
}
