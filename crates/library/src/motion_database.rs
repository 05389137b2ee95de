//! Motion databases in the object store: one index file, or a list of several that are the shards of one database.

use bytes::Bytes;
use motion_db::{IndexFile, MotionDatabase, WindowIndex};
use queue::JobError;
use serde::{Deserialize, Serialize};
use service::compute;
use std::{str::FromStr, sync::Arc};
use store::{Key, Store};

/// Name of an index file that is a whole database.
pub const INDEX: &str = "index.mdb";
/// Name of the list of the shards of a database.
pub const SHARDS: &str = "shards.json";

/// First bytes of a list of shards, which tell it from an index file.
const LIST: u8 = b'{';

/// The list of the shards of a database. Whole clips lie in one shard each, in the order in which they have it here.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardList {
    /// The index files.
    pub shards: Vec<Shard>,
    /// All clips, in the order of the database.
    pub clips: Vec<ShardedClip>,
}

/// An index file that holds some clips of a database.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Where it is in the object store.
    pub store_key: String,
    /// Size, bytes.
    pub bytes: u64,
    /// BLAKE3 of its content, hex.
    pub blake3: String,
}

/// A clip and where it is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShardedClip {
    /// Name, once in a database.
    pub name: String,
    /// Who moved.
    pub subject: String,
    /// What they did; empty if unknown.
    pub action: String,
    /// Number of poses at 60 a second.
    pub num_poses: usize,
    /// Position of its shard in the list.
    pub shard: usize,
}

/// A database that was read, with the windows that its index file holds, if it is one file that holds any.
#[derive(Debug, Clone)]
pub struct Opened {
    /// The database.
    pub database: Arc<MotionDatabase>,
    /// Its windows, of the length that they were written with.
    pub windows: Option<Arc<WindowIndex>>,
    /// What it takes, bytes: of a file that is used where it lies, its size.
    pub bytes: u64,
}

/// What the row of a database names.
#[derive(Debug, Clone)]
pub enum Index {
    /// The index file itself: it is a shard that is alone.
    Whole(Shard),
    /// The list of its shards.
    Sharded(ShardList),
}

/// Why a database can't be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The object store failed, or does not hold what is recorded.
    #[error(transparent)]
    Store(#[from] store::Error),
    /// A file is not an index file, or shards do not belong together.
    #[error(transparent)]
    Database(#[from] motion_db::Error),
    /// An index file in a folder can't be mapped.
    #[error("{key} can't be mapped into memory: {source}")]
    Map {
        /// The file's key.
        key: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The list of shards is none.
    #[error("the list of shards {0}, expected one that agrees with its shards")]
    List(String),
}

impl Error {
    /// The error of a job that was told to read motion database `name`: only trouble with the store, or content that is
    /// not what was written, may pass by itself.
    pub fn into_job_error(self, name: &str) -> JobError {
        match &self {
            Self::Map { .. } => JobError::retry(self),
            Self::Store(e) if e.is_transient() || matches!(e, store::Error::Corrupt { .. }) => {
                JobError::retry(self)
            }
            _ => JobError::give_up(
                format!("motion database {name} can't be used: {self}"),
                format!("{self:?}"),
            ),
        }
    }
}

/// Reads which index file or files a database has.
///
/// # Errors
/// [`Error::Store`], also for a list of more than `max_bytes`; [`Error::List`].
pub async fn read(store: &Store, store_key: &str, blake3: &str, max_bytes: u64) -> Result<Index, Error> {
    let key = Key::from_str(store_key)?;
    let bytes = store.size(&key).await?;
    if store.get_range(&key, 0..1).await?.first() != Some(&LIST) {
        let (store_key, blake3) = (store_key.to_owned(), blake3.to_owned());
        return Ok(Index::Whole(Shard { store_key, bytes, blake3 }));
    }
    let list = store.get_checked(&key, blake3, max_bytes).await?;
    let list: ShardList =
        serde_json::from_slice(&list).map_err(|e| Error::List(format!("does not parse ({e})")))?;
    match list.clips.iter().find(|clip| clip.shard >= list.shards.len()) {
        Some(clip) => Err(Error::List(format!("has clip {:?} in a shard that is not there", clip.name))),
        None => Ok(Index::Sharded(list)),
    }
}

impl Shard {
    /// Opens the index file: mapped, where the store is a folder, else read. Every section is checked.
    ///
    /// # Errors
    /// [`Error::Store`], also for one of more than `max_bytes`; [`Error::Database`]; [`Error::Map`].
    pub async fn open(&self, store: &Store, max_bytes: u64) -> Result<Opened, Error> {
        let key = Key::from_str(&self.store_key)?;
        let found = store.size(&key).await?;
        if found > max_bytes {
            return Err(store::Error::TooLarge { key, limit_bytes: max_bytes }.into());
        }
        let bytes = match store.path(&key) {
            Some(path) => {
                let mapped = compute::run(move || mapped_file::map(&path)).await;
                mapped.map_err(|source| Error::Map { key: self.store_key.clone(), source })?
            }
            None => store.get_checked(&key, &self.blake3, max_bytes).await?,
        };
        compute::run(move || opened(bytes)).await
    }
}

fn opened(bytes: Bytes) -> Result<Opened, Error> {
    let file = IndexFile::open(bytes)?;
    file.verify()?;
    let bytes = file.num_bytes() as u64;
    let (database, windows) = file.into_parts();
    Ok(Opened { database: database.into(), windows: windows.map(Arc::new), bytes })
}

/// Opens a whole database, its shards put together: the same, bit for bit, as if it had been built undivided.
///
/// # Errors
/// As [`read`] and [`Shard::open`]. No file, nor all together, may have more than `max_bytes`.
pub async fn open(store: &Store, store_key: &str, blake3: &str, max_bytes: u64) -> Result<Opened, Error> {
    let list = match read(store, store_key, blake3, max_bytes).await? {
        Index::Whole(file) => return file.open(store, max_bytes).await,
        Index::Sharded(list) => list,
    };
    let total: u64 = list.shards.iter().map(|shard| shard.bytes).sum();
    if total > max_bytes {
        let key = Key::from_str(store_key)?;
        return Err(store::Error::TooLarge { key, limit_bytes: max_bytes }.into());
    }
    let mut shards = Vec::with_capacity(list.shards.len());
    for shard in &list.shards {
        shards.push(shard.open(store, max_bytes).await?.database);
    }
    let database = compute::run(move || put_together(&list, &shards)).await?;
    let bytes = (database.num_poses() * database.num_dofs() * size_of::<f32>()) as u64;
    Ok(Opened { database: database.into(), windows: None, bytes })
}

/// The database of which `shards` are the parts.
fn put_together(list: &ShardList, shards: &[Arc<MotionDatabase>]) -> Result<MotionDatabase, Error> {
    let first = shards.first().ok_or_else(|| Error::List("is empty".to_owned()))?;
    let mut whole = first.emptied();
    let mut taken = vec![0; shards.len()];
    for clip in &list.clips {
        let index = taken[clip.shard];
        taken[clip.shard] += 1;
        match shards[clip.shard].clips().get(index) {
            Some(found) if found.name == clip.name => {
                whole.append_from(&shards[clip.shard], index, &clip.name)?;
            }
            _ => return Err(Error::List(format!("has clip {:?} that its shard has not", clip.name))),
        }
    }
    // As when it is built undivided.
    whole.learn_zero_poses();
    Ok(whole)
}
