//! A cache bounded by bytes: what was not asked for longest goes first.

use std::{
    collections::HashMap,
    hash::Hash,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use tokio::sync::OnceCell;

/// Shared, immutable values that are expensive to load.
///
/// A value is loaded once however many ask for it at the same time. Evicting only forgets: whoever holds a
/// value keeps it, so the memory in use is the cache's bound and what running calls hold beyond it.
#[derive(Debug)]
pub struct Cache<K, V> {
    capacity_bytes: u64,
    entries: Mutex<Entries<K, V>>,
}

#[derive(Debug)]
struct Entries<K, V> {
    clock: u64,
    by_key: HashMap<K, Entry<V>>,
}

#[derive(Debug)]
struct Entry<V> {
    cell: Arc<OnceCell<Arc<V>>>,
    /// 0 until loaded
    bytes: u64,
    last_used: u64,
}

impl<K: Hash + Eq + Clone, V> Cache<K, V> {
    /// A cache that keeps at most `capacity_bytes` (as counted by those who load).
    pub fn new(capacity_bytes: u64) -> Self {
        Self { capacity_bytes, entries: Mutex::new(Entries { clock: 0, by_key: HashMap::new() }) }
    }

    /// The bound, bytes.
    pub fn capacity_bytes(&self) -> u64 {
        self.capacity_bytes
    }

    /// The value of `key`, loaded by `load` if it is not there: the value and its size in bytes.
    ///
    /// A value larger than the whole cache is given back and not kept.
    ///
    /// # Errors
    /// Whatever `load` returns; the next caller tries again.
    pub async fn get_or_load<E>(
        &self,
        key: K,
        load: impl Future<Output = Result<(V, u64), E>>,
    ) -> Result<Arc<V>, E> {
        let cell = self.cell(&key);
        let mut loaded_bytes = None;
        let loading = async {
            let (value, bytes) = load.await?;
            loaded_bytes = Some(bytes);
            Ok(Arc::new(value))
        };
        let result = cell.get_or_try_init(|| loading).await.cloned();
        match (&result, loaded_bytes) {
            (Ok(_), Some(bytes)) => self.account(&key, &cell, bytes),
            (Err(_), _) => self.forget_empty(&key),
            _ => {}
        }
        result
    }

    fn entries(&self) -> MutexGuard<'_, Entries<K, V>> {
        // The lock is held for map operations only; a panic in one leaves nothing half-done that matters.
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn cell(&self, key: &K) -> Arc<OnceCell<Arc<V>>> {
        let mut entries = self.entries();
        entries.clock += 1;
        let now = entries.clock;
        let fresh = || Entry { cell: Arc::default(), bytes: 0, last_used: now };
        let entry = entries.by_key.entry(key.clone()).or_insert_with(fresh);
        entry.last_used = now;
        entry.cell.clone()
    }

    fn account(&self, key: &K, cell: &Arc<OnceCell<Arc<V>>>, bytes: u64) {
        let mut entries = self.entries();
        if bytes > self.capacity_bytes {
            entries.by_key.remove(key);
            return;
        }
        match entries.by_key.get_mut(key) {
            Some(entry) if Arc::ptr_eq(&entry.cell, cell) => entry.bytes = bytes,
            // Somebody else's failed load made the cache forget this key meanwhile.
            _ => return,
        }
        while entries.by_key.values().map(|e| e.bytes).sum::<u64>() > self.capacity_bytes {
            let oldest = entries.by_key.iter().filter(|(k, e)| e.bytes > 0 && *k != key);
            let Some(oldest) = oldest.min_by_key(|(_, e)| e.last_used).map(|(k, _)| k.clone()) else { break };
            entries.by_key.remove(&oldest);
        }
    }

    fn forget_empty(&self, key: &K) {
        let mut entries = self.entries();
        // Others who wait for this cell hold it too and load it themselves; then it is theirs to account for.
        if entries.by_key.get(key).is_some_and(|e| !e.cell.initialized() && Arc::strong_count(&e.cell) <= 2) {
            entries.by_key.remove(key);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    async fn get(cache: &Cache<u32, u32>, key: u32, bytes: u64, loads: &AtomicUsize) -> u32 {
        let load = async {
            loads.fetch_add(1, Ordering::SeqCst);
            tokio::task::yield_now().await;
            Ok::<_, ()>((key * 10, bytes))
        };
        *cache.get_or_load(key, load).await.unwrap()
    }

    #[tokio::test]
    async fn many_who_ask_at_once_load_once() {
        let (cache, loads) = (Cache::new(100), AtomicUsize::new(0));
        let (a, b, c) =
            tokio::join!(get(&cache, 1, 10, &loads), get(&cache, 1, 10, &loads), get(&cache, 1, 10, &loads));
        assert_eq!((a, b, c, loads.load(Ordering::SeqCst)), (10, 10, 10, 1));
    }

    #[tokio::test]
    async fn what_was_not_used_longest_goes_first() {
        let (cache, loads) = (Cache::new(100), AtomicUsize::new(0));
        for key in [1, 2, 1, 3, 1] {
            get(&cache, key, 40, &loads).await;
        }
        assert_eq!(loads.load(Ordering::SeqCst), 3, "3 pushed 2 out, not 1");
        get(&cache, 2, 40, &loads).await;
        assert_eq!(loads.load(Ordering::SeqCst), 4);
    }

    #[tokio::test]
    async fn a_value_larger_than_the_cache_is_given_but_not_kept() {
        let (cache, loads) = (Cache::new(100), AtomicUsize::new(0));
        get(&cache, 1, 50, &loads).await;
        get(&cache, 2, 101, &loads).await;
        get(&cache, 2, 101, &loads).await;
        get(&cache, 1, 50, &loads).await;
        assert_eq!(loads.load(Ordering::SeqCst), 3);
    }

    #[tokio::test]
    async fn after_a_failure_the_next_caller_tries_again() {
        let (cache, loads) = (Cache::new(100), AtomicUsize::new(0));
        assert_eq!(cache.get_or_load(1, async { Err("disk") }).await, Err("disk"));
        assert_eq!(get(&cache, 1, 10, &loads).await, 10);
        assert_eq!(get(&cache, 1, 10, &loads).await, 10);
        assert_eq!(loads.load(Ordering::SeqCst), 1);
    }
}
