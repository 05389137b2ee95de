//! Databases and what is worked out from them, kept in memory up to a bound.

use crate::{Error, catalogue, catalogue::Row, search};
use motion_db::{MotionDatabase, WindowIndex};
use service::{Cache, compute, config::MemoryConfig};
use sqlx::PgPool;
use std::sync::Arc;
use store::Store;
use uuid::Uuid;

/// Share of the bound that goes to databases themselves; the rest is for indexes and point tables. An index of
/// windows of m frames is m times as large as its database, a table of points is smaller.
const DATABASE_SHARE: f64 = 0.25;

pub(crate) struct Databases {
    pool: PgPool,
    store: Store,
    databases: Cache<Uuid, MotionDatabase>,
    derived: Cache<DerivedKey, Derived>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum DerivedKey {
    Windows { database: Uuid, window: usize },
    Points { database: Uuid, names: Vec<String> },
}

#[derive(Debug)]
enum Derived {
    Windows(WindowIndex),
    Points(search::PointTable),
}

impl Databases {
    pub fn new(pool: PgPool, store: Store, memory: &MemoryConfig) -> Self {
        let databases = (memory.database_cache_bytes as f64 * DATABASE_SHARE) as u64;
        Self {
            pool,
            store,
            databases: Cache::new(databases),
            derived: Cache::new(memory.database_cache_bytes - databases),
        }
    }

    pub fn pool(&self) -> &PgPool {
        &self.pool
    }

    /// The row and the database itself.
    pub async fn get(&self, id: Uuid) -> Result<(Row, Arc<MotionDatabase>), Error> {
        let row = catalogue::find(&self.pool, id).await?;
        let limit = self.databases.capacity_bytes();
        let load = async {
            let bytes = self.store.get_checked(&row.key()?, &row.blake3, limit).await?;
            let database = compute::run(move || MotionDatabase::from_bytes(&bytes)).await?;
            let size = (database.num_poses() * database.num_dofs() * size_of::<f32>()) as u64;
            tracing::info!(database.id = %id, num_poses = database.num_poses(), "motion database loaded");
            Ok::<_, Error>((database, size))
        };
        let database = self.databases.get_or_load(id, load).await?;
        Ok((row, database))
    }

    /// The windows nearest to a question, by [`search::nearest_windows`].
    pub async fn nearest_windows(
        &self,
        id: Uuid,
        question: search::WindowQuestion,
    ) -> Result<Vec<search::Match>, Error> {
        let (_, database) = self.get(id).await?;
        let key = DerivedKey::Windows { database: id, window: question.num_frames() };
        let window = question.num_frames();
        let derived = self.derived(key, search::window_bytes(&database, window), "the index of windows", {
            let database = database.clone();
            move || Ok(Derived::Windows(WindowIndex::new(&database, window)?))
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
        id: Uuid,
        question: search::PointQuestion,
    ) -> Result<Vec<search::Match>, Error> {
        let (_, database) = self.get(id).await?;
        let names = question.names().to_vec();
        let key = DerivedKey::Points { database: id, names: names.clone() };
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
