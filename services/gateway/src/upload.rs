//! Receiving a file: streamed to the object store, with a size limit and a checksum.

use std::sync::{Arc, Mutex};

use axum::{
    body::{Body, Bytes},
    http::{HeaderMap, header},
};
use base64::{Engine, prelude::BASE64_STANDARD};
use futures::{Stream, StreamExt};
use sha2::{Digest, Sha256};
use store::{Key, Stored, UploadLimits};

use crate::{
    App,
    error::{Error, Result},
};

/// After a refusal, so much of the rest of a body is still read (and dropped) that the sender gets to see the answer.
const MAX_DRAIN_BYTES: u64 = 32 << 20;

/// What the sender said of the body before it came.
#[derive(Debug)]
pub(crate) struct Announced {
    sha256: Option<[u8; 32]>,
    content_length: Option<u64>,
}

impl Announced {
    /// Reads `Content-Digest` (RFC 9530, `sha-256=:base64:`) and `Content-Length`.
    pub fn read(headers: &HeaderMap) -> Result<Self> {
        let content_length =
            headers.get(header::CONTENT_LENGTH).and_then(|v| v.to_str().ok()).and_then(|v| v.parse().ok());
        let sha256 = match headers.get("content-digest") {
            None => None,
            Some(value) => Some(value.to_str().ok().and_then(sha256_from_digest).ok_or_else(|| {
                Error::BadRequest(
                    "Content-Digest has no readable sha-256, expected sha-256=:<base64>:".into(),
                )
            })?),
        };
        Ok(Self { sha256, content_length })
    }
}

fn sha256_from_digest(header: &str) -> Option<[u8; 32]> {
    let value = header.split(',').find_map(|member| member.trim().strip_prefix("sha-256="))?;
    let base64 = value.trim().strip_prefix(':')?.strip_suffix(':')?;
    BASE64_STANDARD.decode(base64).ok()?.try_into().ok()
}

/// Streams `body` into the store under `key`. When anything is wrong with it, nothing is stored.
pub(crate) async fn receive(app: &App, key: &Key, announced: &Announced, body: Body) -> Result<Stored> {
    let mut chunks = body.into_data_stream();
    let limit_bytes = app.limits.max_upload_bytes;
    let result = if announced.content_length.is_some_and(|length| length > limit_bytes) {
        Err(Error::TooLarge { limit_bytes })
    } else {
        store_stream(app, key, announced, &mut chunks).await
    };
    match &result {
        Ok(stored) if stored.bytes == 0 => {
            app.store.delete(key).await?;
            return Err(Error::Unprocessable("the file is empty".into()));
        }
        Err(Error::TooLarge { .. } | Error::Unavailable(_)) => drain(app, chunks).await,
        _ => {}
    }
    result
}

async fn store_stream(
    app: &App,
    key: &Key,
    announced: &Announced,
    chunks: &mut (impl Stream<Item = Result<Bytes, axum::Error>> + Unpin + Send),
) -> Result<Stored> {
    let limits = UploadLimits { max_bytes: app.limits.max_upload_bytes, expected_blake3: None };
    // Why the stream ended itself, if it did: the store only sees that it broke off.
    let refusal = Arc::new(Mutex::new(None));
    let checked = check(app, announced.sha256, chunks, Arc::clone(&refusal));
    let stored = app.store.put_stream(key, checked, &limits).await;
    let refusal = refusal.lock().ok().and_then(|mut refusal| refusal.take());
    match (stored, refusal) {
        (Err(_), Some(refusal)) => Err(refusal),
        (stored, _) => Ok(stored?),
    }
}

/// Passes `chunks` on; ends with an error when the sender stalls or the whole has another SHA-256 than announced.
fn check(
    app: &App,
    expected: Option<[u8; 32]>,
    chunks: &mut (impl Stream<Item = Result<Bytes, axum::Error>> + Unpin + Send),
    refusal: Arc<Mutex<Option<Error>>>,
) -> impl Stream<Item = Result<Bytes, String>> {
    let stall = app.limits.upload_stall;
    async_stream::stream! {
        let refuse = |error: Error| {
            let text = error.to_string();
            if let Ok(mut refusal) = refusal.lock() {
                *refusal = Some(error);
            }
            Err(text)
        };
        let mut hasher = expected.map(|_| Sha256::new());
        loop {
            match tokio::time::timeout(stall, chunks.next()).await {
                Ok(Some(Ok(chunk))) => {
                    if let Some(hasher) = &mut hasher {
                        hasher.update(&chunk);
                    }
                    yield Ok(chunk);
                }
                Ok(Some(Err(error))) => {
                    yield refuse(Error::UploadBroken(error.to_string()));
                    return;
                }
                Ok(None) => break,
                Err(_) => {
                    yield refuse(Error::UploadBroken(format!("nothing arrived for {} seconds", stall.as_secs())));
                    return;
                }
            }
        }
        if let (Some(hasher), Some(expected)) = (hasher, expected) {
            let found: [u8; 32] = hasher.finalize().into();
            if found != expected {
                yield refuse(Error::ChecksumMismatch {
                    algorithm: "sha-256",
                    expected: BASE64_STANDARD.encode(expected),
                    found: BASE64_STANDARD.encode(found),
                });
            }
        }
    }
}

async fn drain(app: &App, mut chunks: impl Stream<Item = Result<Bytes, axum::Error>> + Unpin) {
    let mut left = MAX_DRAIN_BYTES;
    let all = async {
        while let Some(Ok(chunk)) = chunks.next().await {
            left = left.saturating_sub(chunk.len() as u64);
            if left == 0 {
                break;
            }
        }
    };
    // Whether it ended or was given up makes no difference to the answer.
    let _ = tokio::time::timeout(app.limits.upload_stall.min(std::time::Duration::from_secs(5)), all).await;
}

/// Runs to the end even when the sender goes away, so that nothing is left half done.
pub(crate) async fn uninterrupted<T: Send + 'static>(
    work: impl Future<Output = Result<T>> + Send + 'static,
) -> Result<T> {
    tokio::spawn(work).await.map_err(|error| Error::Internal(format!("task: {error}")))?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_content_digest_is_read_among_others() {
        let hash = BASE64_STANDARD.encode([7; 32]);
        assert_eq!(sha256_from_digest(&format!("sha-256=:{hash}:")), Some([7; 32]));
        assert_eq!(sha256_from_digest(&format!("md5=:AA==:, sha-256=:{hash}:")), Some([7; 32]));
        for bad in ["sha-256=abc", "sha-256=:abc:", "md5=:AA==:", "", "sha-256=:AA==:"] {
            assert_eq!(sha256_from_digest(bad), None, "{bad}");
        }
    }
}
