//! Removing what lost attempts left behind.

use crate::{Error, Key, Store};
use futures::TryStreamExt;
use std::collections::HashSet;

impl Store {
    /// Removes every object under `prefix` whose key is not in `keep`; returns how many.
    ///
    /// To be called when no one writes under `prefix` any more, that is, after a run has ended.
    /// A worker that lost its lease may still write there later; what it writes is named by no row.
    ///
    /// # Errors
    /// [`Error::Backend`]; objects removed until then stay removed.
    pub async fn remove_orphans(&self, prefix: &Key, keep: &HashSet<Key>) -> Result<usize, Error> {
        let found: Vec<Key> = self.list(prefix).map_ok(|(key, _)| key).try_collect().await?;
        let mut removed = 0;
        for key in found.iter().filter(|key| !keep.contains(key)) {
            self.delete(key).await?;
            removed += 1;
        }
        Ok(removed)
    }

    /// Removes every object under `prefix`; returns how many.
    ///
    /// # Errors
    /// [`Error::Backend`]; objects removed until then stay removed.
    pub async fn remove_all(&self, prefix: &Key) -> Result<usize, Error> {
        self.remove_orphans(prefix, &HashSet::new()).await
    }
}

impl Store {
    /// Removes what earlier attempts at a job left: everything under `prefix` (a job's, of [`crate::key`]) that it wrote
    /// under lease numbers below `lease`.
    ///
    /// Safe whenever the job was claimed under `lease`: an attempt under a lower number can't complete any more.
    ///
    /// # Errors
    /// [`Error::Backend`]; objects removed until then stay removed.
    pub async fn remove_earlier_leases(&self, prefix: &Key, lease: i64) -> Result<usize, Error> {
        let mut removed = 0;
        let found: Vec<Key> = self.list(prefix).map_ok(|(key, _)| key).try_collect().await?;
        for key in found {
            let rest = key.as_str().strip_prefix(prefix.as_str()).and_then(|rest| rest.strip_prefix('/'));
            let written =
                rest.and_then(|rest| rest.split('/').next()).and_then(|name| name.parse::<i64>().ok());
            if written.is_some_and(|written| written < lease) {
                self.delete(&key).await?;
                removed += 1;
            }
        }
        Ok(removed)
    }
}
