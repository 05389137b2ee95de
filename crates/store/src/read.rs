//! Reading: whole objects up to a limit, ranges, streams, listings.

use crate::{Error, Key, Store, write::digest};
use bytes::{Bytes, BytesMut};
use futures::{Stream, StreamExt, TryStreamExt};
use object_store::{ObjectStore, ObjectStoreExt};
use std::ops::Range;

impl Store {
    /// Reads an object whole, if it has at most `max_bytes`.
    ///
    /// # Errors
    /// [`Error::NotFound`], [`Error::TooLarge`], [`Error::Backend`].
    pub async fn get(&self, key: &Key, max_bytes: u64) -> Result<Bytes, Error> {
        let found = self.backend.get(&key.path()).await.map_err(Error::at(key))?;
        let too_large = || Error::TooLarge { key: key.clone(), limit_bytes: max_bytes };
        let size = found.meta.size;
        if size > max_bytes {
            return Err(too_large());
        }
        let mut content = BytesMut::with_capacity(usize::try_from(size).map_err(|_| too_large())?);
        let mut chunks = found.into_stream();
        while let Some(chunk) = chunks.try_next().await.map_err(Error::at(key))? {
            // The file may have grown since it was measured.
            if content.len() as u64 + chunk.len() as u64 > max_bytes {
                return Err(too_large());
            }
            content.extend_from_slice(&chunk);
        }
        Ok(content.freeze())
    }

    /// Reads an object whole and checks it against the BLAKE3 recorded when it was written.
    ///
    /// # Errors
    /// As [`Store::get`], and [`Error::Corrupt`].
    pub async fn get_checked(&self, key: &Key, blake3: &str, max_bytes: u64) -> Result<Bytes, Error> {
        let content = self.get(key, max_bytes).await?;
        let found = digest(&content).await;
        if found.eq_ignore_ascii_case(blake3) {
            Ok(content)
        } else {
            Err(Error::Corrupt { key: key.clone(), expected: blake3.to_owned(), found })
        }
    }

    /// Reads bytes `range` of an object; the end is cut at the object's end.
    ///
    /// # Errors
    /// [`Error::NotFound`], [`Error::Backend`] (also for a range that starts behind the end).
    pub async fn get_range(&self, key: &Key, range: Range<u64>) -> Result<Bytes, Error> {
        self.backend.get_range(&key.path(), range).await.map_err(Error::at(key))
    }

    /// Streams an object: its size in bytes, and its content in pieces of bounded size.
    ///
    /// # Errors
    /// [`Error::NotFound`], [`Error::Backend`]; the stream yields [`Error::Backend`].
    pub async fn stream(
        &self,
        key: &Key,
    ) -> Result<(u64, impl Stream<Item = Result<Bytes, Error>> + Send + 'static), Error> {
        let found = self.backend.get(&key.path()).await.map_err(Error::at(key))?;
        let size = found.meta.size;
        Ok((size, found.into_stream().map_err(Error::at(key))))
    }

    /// Size of an object, bytes.
    ///
    /// # Errors
    /// [`Error::NotFound`], [`Error::Backend`].
    pub async fn size(&self, key: &Key) -> Result<u64, Error> {
        Ok(self.backend.head(&key.path()).await.map_err(Error::at(key))?.size)
    }

    /// Keys and sizes (bytes) of all objects under `prefix`, in no particular order.
    ///
    /// # Errors
    /// The stream yields [`Error::Backend`], or [`Error::BadKey`] for a file that no part of Marey wrote.
    pub fn list(&self, prefix: &Key) -> impl Stream<Item = Result<(Key, u64), Error>> + Send + 'static {
        let at = Error::at(prefix);
        self.backend.list(Some(&prefix.path())).map(move |entry| {
            let meta = entry.map_err(&at)?;
            Ok((meta.location.as_ref().parse()?, meta.size))
        })
    }
}
