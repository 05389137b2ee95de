//! Writing: whole objects, streams with a limit, conditional creation.

use crate::{Error, Key, Store};
use bytes::Bytes;
use futures::{Stream, StreamExt};
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload, WriteMultipart};

/// What was written: recorded in PostgreSQL beside the key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// The object's name.
    pub key: Key,
    /// Its size, bytes.
    pub bytes: u64,
    /// BLAKE3 of its content, 64 hexadecimal digits.
    pub blake3: String,
}

/// What an upload may be.
#[derive(Debug, Clone, Default)]
pub struct UploadLimits {
    /// Most bytes to take; a longer stream is refused and nothing is stored.
    pub max_bytes: u64,
    /// BLAKE3 announced by the sender, hex; another content is refused and nothing is stored.
    pub expected_blake3: Option<String>,
}

/// Parts of a streamed upload, bytes: the least S3 takes.
const PART_BYTES: usize = 5 * 1024 * 1024;
/// Parts under way at once; with [`PART_BYTES`] this bounds the memory of one upload.
const PARTS_IN_FLIGHT: usize = 2;
/// Content above this is hashed off the async threads, bytes (about 0.1 ms of work).
const HASH_INLINE_BYTES: usize = 128 * 1024;

impl Store {
    /// Writes an object whole, replacing an older one of the same name.
    ///
    /// # Errors
    /// [`Error::Backend`].
    pub async fn put(&self, key: &Key, content: Bytes) -> Result<Stored, Error> {
        self.put_as(key, content, PutMode::Overwrite).await
    }

    /// Writes an object only if there is none of that name; of several writers exactly one succeeds.
    ///
    /// # Errors
    /// [`Error::AlreadyExists`], [`Error::Backend`].
    pub async fn create(&self, key: &Key, content: Bytes) -> Result<Stored, Error> {
        self.put_as(key, content, PutMode::Create).await
    }

    async fn put_as(&self, key: &Key, content: Bytes, mode: PutMode) -> Result<Stored, Error> {
        let blake3 = digest(&content).await;
        let stored = Stored { key: key.clone(), bytes: content.len() as u64, blake3 };
        self.backend
            .put_opts(&key.path(), PutPayload::from(content), PutOptions::from(mode))
            .await
            .map_err(Error::at(key))?;
        Ok(stored)
    }

    /// Writes an object from a stream, holding at most a few parts of 5 MiB in memory.
    ///
    /// The object appears when the stream has ended well, and not at all otherwise.
    ///
    /// # Errors
    /// [`Error::TooLarge`], [`Error::ChecksumMismatch`], [`Error::Interrupted`], [`Error::Backend`].
    pub async fn put_stream<E: std::fmt::Display>(
        &self,
        key: &Key,
        stream: impl Stream<Item = Result<Bytes, E>>,
        limits: &UploadLimits,
    ) -> Result<Stored, Error> {
        let upload = self.backend.put_multipart(&key.path()).await.map_err(Error::at(key))?;
        let mut upload = WriteMultipart::new_with_chunk_size(upload, PART_BYTES);
        match receive(key, stream, limits, &mut upload).await {
            Ok(stored) => {
                upload.finish().await.map_err(Error::at(key))?;
                Ok(stored)
            }
            Err(error) => {
                // The parts are only garbage now; failing to remove them changes nothing for the caller.
                let _ = upload.abort().await;
                Err(error)
            }
        }
    }

    /// Removes an object; one that is not there is as good as removed.
    ///
    /// # Errors
    /// [`Error::Backend`].
    pub async fn delete(&self, key: &Key) -> Result<(), Error> {
        match self.backend.delete(&key.path()).await.map_err(Error::at(key)) {
            Err(Error::NotFound { .. }) => Ok(()),
            other => other,
        }
    }
}

async fn receive<E: std::fmt::Display>(
    key: &Key,
    stream: impl Stream<Item = Result<Bytes, E>>,
    limits: &UploadLimits,
    upload: &mut WriteMultipart,
) -> Result<Stored, Error> {
    let mut hasher = blake3::Hasher::new();
    let mut bytes = 0u64;
    let mut stream = std::pin::pin!(stream);
    while let Some(chunk) = stream.next().await {
        let chunk =
            chunk.map_err(|e| Error::Interrupted { key: key.clone(), bytes, reason: e.to_string() })?;
        bytes = bytes.saturating_add(chunk.len() as u64);
        if bytes > limits.max_bytes {
            return Err(Error::TooLarge { key: key.clone(), limit_bytes: limits.max_bytes });
        }
        hasher.update(&chunk);
        upload.wait_for_capacity(PARTS_IN_FLIGHT).await.map_err(Error::at(key))?;
        upload.put(chunk);
    }
    let blake3 = hasher.finalize().to_hex().to_string();
    match &limits.expected_blake3 {
        Some(expected) if !expected.eq_ignore_ascii_case(&blake3) => {
            Err(Error::ChecksumMismatch { key: key.clone(), expected: expected.clone(), found: blake3 })
        }
        _ => Ok(Stored { key: key.clone(), bytes, blake3 }),
    }
}

/// BLAKE3 of `content`, hex.
pub(crate) async fn digest(content: &Bytes) -> String {
    if content.len() <= HASH_INLINE_BYTES {
        return blake3::hash(content).to_hex().to_string();
    }
    let copy = content.clone();
    match tokio::task::spawn_blocking(move || blake3::hash(&copy)).await {
        Ok(hash) => hash.to_hex().to_string(),
        // The runtime is shutting down and takes no blocking work: do it here.
        Err(_) => blake3::hash(content).to_hex().to_string(),
    }
}
