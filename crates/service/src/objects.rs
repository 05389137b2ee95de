//! Objects as jobs see them: uploads read, artefacts written, the store's errors told apart.

use bytes::Bytes;
use formats::media_type;
use queue::{Artefact, JobContext, JobError};
use serde::{Serialize, de::DeserializeOwned};
use std::str::FromStr;
use store::{Error, Key, Store, Stored, key};

/// An object that a job is told to read.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// What the user calls it.
    pub name: &'a str,
    /// Where it is in the store.
    pub store_key: &'a str,
    /// BLAKE3 of its content, hex.
    pub blake3: &'a str,
}

impl<'a> From<&'a Artefact> for Input<'a> {
    fn from(artefact: &'a Artefact) -> Self {
        Self { name: &artefact.name, store_key: &artefact.store_key, blake3: &artefact.blake3 }
    }
}

/// Reads an object whole and checks it.
///
/// # Errors
/// Gives up if it is gone or larger than `max_bytes`; to be tried again if the store failed or the content is not
/// what was written.
pub async fn read(store: &Store, input: Input<'_>, max_bytes: u64) -> Result<Bytes, JobError> {
    let name = input.name;
    let key = Key::from_str(input.store_key)
        .map_err(|e| JobError::give_up(format!("{name} has no place in the store"), e))?;
    store.get_checked(&key, input.blake3, max_bytes).await.map_err(|error| match &error {
        Error::NotFound { .. } => JobError::give_up(format!("{name} is not in the store any more"), error),
        Error::TooLarge { limit_bytes, .. } => JobError::give_up(
            format!("{name} is larger than the {limit_bytes} bytes that a job reads"),
            error,
        ),
        _ => JobError::retry(error),
    })
}

/// Reads an object that an earlier job wrote with [`write_json`].
///
/// # Errors
/// As [`read`]; to be tried again if it is not what was expected.
pub async fn read_json<T: DeserializeOwned>(
    store: &Store,
    input: Input<'_>,
    max_bytes: u64,
) -> Result<T, JobError> {
    serde_json::from_slice(&read(store, input, max_bytes).await?).map_err(JobError::retry)
}

/// Where an artefact of the job goes: under its own lease.
///
/// # Errors
/// To be tried again if the name can't be part of a key.
pub fn key(job: &JobContext, name: &str) -> Result<Key, JobError> {
    key::artefact(job.run_id().0, job.id().0, job.lease_number().0, name).map_err(JobError::retry)
}

/// Writes an artefact of the job under its own lease.
///
/// # Errors
/// To be tried again if the store failed.
pub async fn write(
    store: &Store,
    job: &JobContext,
    name: &str,
    media_type: &str,
    content: impl Into<Bytes>,
) -> Result<Artefact, JobError> {
    let stored = store.put(&key(job, name)?, content.into()).await.map_err(JobError::retry)?;
    Ok(artefact(name, media_type, stored))
}

/// Writes what a later job reads as JSON, an artefact of this job under its own lease.
///
/// # Errors
/// To be tried again if it is no JSON, or the store failed.
pub async fn write_json(
    store: &Store,
    job: &JobContext,
    name: &str,
    value: &impl Serialize,
) -> Result<Artefact, JobError> {
    let content = serde_json::to_vec(value).map_err(JobError::retry)?;
    write(store, job, name, media_type::JSON, content).await
}

/// What a stored object is as an artefact.
pub fn artefact(name: &str, media_type: &str, stored: Stored) -> Artefact {
    Artefact {
        name: name.to_owned(),
        store_key: stored.key.into(),
        bytes: i64::try_from(stored.bytes).unwrap_or(i64::MAX),
        blake3: stored.blake3,
        media_type: media_type.to_owned(),
        is_result: false,
    }
}

/// Removes what earlier attempts at the job left under `prefix`, a job's of [`store::key`]. Failing to is no reason to fail the
/// job.
pub(crate) async fn clean_up_earlier_attempts(store: &Store, job: &JobContext, prefix: &Key) {
    if job.lease_number().0 <= 1 {
        return;
    }
    match store.remove_earlier_leases(prefix, job.lease_number().0).await {
        Ok(0) => {}
        Ok(removed) => tracing::info!(job.id = job.id().0, removed, "removed what lost attempts left"),
        Err(error) => tracing::warn!(job.id = job.id().0, %error, "could not remove what lost attempts left"),
    }
}
