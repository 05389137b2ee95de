//! Databases and what is worked out from them, kept in memory up to a bound.

use crate::{Error, search};
use library::{
    AllCores, Cache,
    motion_database::{self, Index, Opened, ShardList},
    versions::motion_databases::{self, ReadyDatabase},
};
use motion_db::{MotionDatabase, WindowIndex};
use service::{compute, config::MemoryConfig};
use sqlx::PgPool;
use std::sync::Arc;
use store::Store;
use uuid::Uuid;

/// Share of the bound that goes to databases, with the windows that their files hold; the rest is for windows of other
/// lengths and point tables.
const DATABASE_SHARE: f64 = 0.75;

pub(crate) struct Databases {
    pool: PgPool,
    store: Store,
    lists: Cache<Uuid, Option<ShardList>>,
    databases: Cache<Part, Opened>,
    derived: Cache<DerivedKey, Derived>,
}

/// A file that can be searched by itself: an undivided database, or a shard of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Part {
    pub database: Uuid,
    pub shard: Option<usize>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum DerivedKey {
    Windows { part: Part, window: usize },
    Points { part: Part, names: Vec<String> },
}

#[derive(Debug)]
enum Derived {
    Windows(Box<WindowIndex>),
    Points(search::PointTable),
}

impl Databases {
    pub fn new(pool: PgPool, store: Store, memory: &MemoryConfig) -> Self {
        let databases = (memory.cache_bytes as f64 * DATABASE_SHARE) as u64;
        Self {
            pool,
            store,
            // Lists are small beside what they list.
            lists: Cache::new(databases / 8),
            databases: Cache::new(databases),
            derived: Cache::new(memory.cache_bytes - databases),
        }
    }

    pub fn pool(&self) -> &PgPool {
        &self.pool
    }

    /// The row of a database, and the list of its shards if it has several.
    pub async fn find(&self, id: Uuid) -> Result<(ReadyDatabase, Arc<Option<ShardList>>), Error> {
        let row = self.row(id).await?;
        if row.num_shards.unwrap_or(1) == 1 {
            return Ok((row, Arc::new(None)));
        }
        let load = async {
            let limit = self.databases.capacity_bytes();
            let list = match motion_database::read(&self.store, &row.store_key, &row.blake3, limit).await? {
                Index::Whole(_) => None,
                Index::Sharded(list) => Some(list),
            };
            let clips = list.as_ref().map_or(0, |list| list.clips.len());
            Ok::<_, Error>((list, 256 * clips as u64))
        };
        let list = self.lists.get_or_load(id, load).await?;
        Ok((row, list))
    }

    async fn row(&self, id: Uuid) -> Result<ReadyDatabase, Error> {
        match motion_databases::find(&self.pool, id).await? {
            Some(row) => Ok(row),
            None if motion_databases::exists(&self.pool, id).await? => Err(Error::NotReady(id)),
            None => Err(Error::NoSuchDatabase(id)),
        }
    }

    /// An index file, opened. `row` and `list` are the database's.
    pub async fn open(
        &self,
        row: &ReadyDatabase,
        list: &Option<ShardList>,
        shard: Option<usize>,
    ) -> Result<Arc<Opened>, Error> {
        let limit = self.databases.capacity_bytes();
        let load = async {
            let opened = match (list, shard) {
                (None, _) => motion_database::open(&self.store, &row.store_key, &row.blake3, limit).await?,
                (Some(list), Some(shard)) if shard < list.shards.len() => {
                    list.shards[shard].open(&self.store, limit).await?
                }
                (Some(list), _) => {
                    let found = shard.map_or("none".to_owned(), |shard| shard.to_string());
                    return Err(Error::NoSuchShard { found, num_shards: list.shards.len() });
                }
            };
            let (bytes, num_poses) = (opened.bytes, opened.database.num_poses());
            tracing::info!(database.id = %row.id, shard, num_poses, "motion database loaded");
            Ok::<_, Error>((opened, bytes))
        };
        let part = Part { database: row.id, shard: shard.filter(|_| list.is_some()) };
        self.databases.get_or_load(part, load).await
    }

    /// The windows nearest to a question, by [`search::nearest_windows`].
    pub async fn nearest_windows(
        &self,
        part: Part,
        opened: &Opened,
        question: search::WindowQuestion,
    ) -> Result<Vec<search::Match>, Error> {
        let (database, window) = (opened.database.clone(), question.num_frames());
        if let Some(index) = opened.windows.clone().filter(|index| index.window() == window) {
            return compute::run(move || search::nearest_windows(&database, &index, &question)).await;
        }
        let key = DerivedKey::Windows { part, window };
        let derived = self.derived(key, search::window_bytes(&database, window), "the index of windows", {
            let database = database.clone();
            move || {
                let index = WindowIndex::with_threads(&database, window, &AllCores)?;
                Ok(Derived::Windows(Box::new(index)))
            }
        });
        let derived = derived.await?;
        compute::run(move || match &*derived {
            Derived::Windows(index) => search::nearest_windows(&database, index, &question),
            Derived::Points(_) => Ok(Vec::new()),
        })
        .await
    }

    /// The poses that fit control points best, by [`search::nearest_poses`].
    pub async fn nearest_poses(
        &self,
        part: Part,
        database: Arc<MotionDatabase>,
        question: search::PointQuestion,
    ) -> Result<Vec<search::Match>, Error> {
        let names = question.names().to_vec();
        let key = DerivedKey::Points { part, names: names.clone() };
        let derived =
            self.derived(key, search::table_bytes(&database, names.len()), "the table of points", {
                let database = database.clone();
                move || Ok(Derived::Points(search::PointTable::new(&database, &names)?))
            });
        let derived = derived.await?;
        Ok(compute::run(move || match &*derived {
            Derived::Points(table) => search::nearest_poses(&database, table, &question),
            Derived::Windows(_) => Vec::new(),
        })
        .await)
    }

    async fn derived(
        &self,
        key: DerivedKey,
        needed_bytes: u64,
        what: &'static str,
        make: impl FnOnce() -> Result<Derived, Error> + Send + 'static,
    ) -> Result<Arc<Derived>, Error> {
        let limit_bytes = self.derived.capacity_bytes();
        if needed_bytes > limit_bytes {
            return Err(Error::TooLarge { what, needed_bytes, limit_bytes });
        }
        self.derived.get_or_load(key, async { Ok((compute::run(make).await?, needed_bytes)) }).await
    }
}
