//! Motion databases as priors, kept in memory up to a bound and shared by jobs and calls.

use jobs::{Object, motion_database::MotionDatabaseFile};
use library::{
    AllCores, Cache,
    motion_database::{self, Opened},
};
use motion_db::{MotionDatabase, WindowIndex};
use queue::JobError;
use regression::gplvm::Gplvm;
use service::{compute, config::MemoryConfig, objects};
use sparse::{Parameters, Reconstructor, Session};
use std::sync::Arc;
use store::Store;

/// Share of the bound that goes to databases, with the windows that their files hold; the rest is for windows of other
/// lengths.
const DATABASE_SHARE: f64 = 0.75;

/// A database and its index of windows.
#[derive(Debug, Clone)]
pub(crate) struct Prior {
    pub database: Arc<MotionDatabase>,
    pub index: Arc<WindowIndex>,
    /// For a run of method `gplvm`.
    pub gplvm: Option<Arc<Gplvm>>,
}

impl Prior {
    /// Reconstructs a session with this prior.
    ///
    /// # Errors
    /// If session, database, parameters and model don't fit each other.
    pub fn reconstructor<'a>(
        &'a self,
        session: &'a Session,
        parameters: &'a Parameters,
    ) -> sparse::Result<Reconstructor<'a>> {
        let reconstructor = Reconstructor::new(&self.database, &self.index, session, parameters)?;
        match &self.gplvm {
            Some(model) => reconstructor.with_model(model),
            None => Ok(reconstructor),
        }
    }
}

/// Largest trained model, bytes: the greatest active set of a skeleton of 1,000 degrees of freedom takes half of it.
const MAX_MODEL_BYTES: u64 = 64 << 20;

pub(crate) struct Priors {
    store: Store,
    /// by checksum: a database never changes
    databases: Cache<String, Opened>,
    /// by checksum and length of the windows, frames
    indexes: Cache<(String, usize), WindowIndex>,
    /// by checksum
    models: Cache<String, Gplvm>,
}

impl Priors {
    pub fn new(store: Store, memory: &MemoryConfig) -> Self {
        let databases = (memory.cache_bytes as f64 * DATABASE_SHARE) as u64;
        Self {
            store,
            databases: Cache::new(databases),
            indexes: Cache::new(memory.cache_bytes - databases),
            models: Cache::new(4 * MAX_MODEL_BYTES),
        }
    }

    /// The database itself.
    ///
    /// # Errors
    /// Gives up if the file is gone, not a database, or too large for this service.
    pub async fn database(&self, file: &MotionDatabaseFile) -> Result<Arc<MotionDatabase>, JobError> {
        Ok(self.open(file).await?.database.clone())
    }

    async fn open(&self, file: &MotionDatabaseFile) -> Result<Arc<Opened>, JobError> {
        let load = async {
            let limit = self.databases.capacity_bytes();
            let opened = motion_database::open(&self.store, &file.store_key, &file.blake3, limit).await;
            let opened =
                opened.map_err(|error| error.into_job_error(&format!("{}@{}", file.name, file.version)))?;
            let (bytes, num_poses) = (opened.bytes, opened.database.num_poses());
            tracing::info!(database.name = file.name, num_poses, "motion database loaded");
            Ok::<_, JobError>((opened, bytes))
        };
        self.databases.get_or_load(file.blake3.clone(), load).await
    }

    /// The database with its index of windows of `window` frames.
    ///
    /// # Errors
    /// As [`Self::database`], and if the window does not fit the database.
    pub async fn get(&self, file: &MotionDatabaseFile, window: usize) -> Result<Prior, JobError> {
        let opened = self.open(file).await?;
        let index = match opened.windows.as_ref().filter(|windows| windows.window() == window) {
            Some(windows) => windows.clone(),
            None => self.index(file, &opened.database, window).await?,
        };
        let gplvm = match &file.gplvm {
            Some(model) => Some(self.gplvm(model).await?),
            None => None,
        };
        Ok(Prior { database: opened.database.clone(), index, gplvm })
    }

    /// Windows that the index file does not hold.
    async fn index(
        &self,
        file: &MotionDatabaseFile,
        database: &Arc<MotionDatabase>,
        window: usize,
    ) -> Result<Arc<WindowIndex>, JobError> {
        let numbers = database.num_poses() * (window * database.num_dofs() + 17);
        let bytes = (numbers * size_of::<f32>()) as u64;
        let limit = self.indexes.capacity_bytes();
        if bytes > limit {
            let message = format!(
                "windows of {window} frames of motion database {} take {bytes} bytes, this service keeps at most {limit}",
                file.name
            );
            return Err(JobError::give_up(message, "raise MAREY_DATABASE_CACHE_BYTES"));
        }
        let make = {
            let database = database.clone();
            move || WindowIndex::with_threads(&database, window, &AllCores)
        };
        let load = async {
            let index = compute::run(make).await.map_err(JobError::bad_input)?;
            Ok::<_, JobError>((index, bytes))
        };
        self.indexes.get_or_load((file.blake3.clone(), window), load).await
    }

    async fn gplvm(&self, model: &Object) -> Result<Arc<Gplvm>, JobError> {
        let load = async {
            let input = objects::Input {
                name: "the trained gplvm",
                store_key: &model.store_key,
                blake3: &model.blake3,
            };
            let bytes = objects::read(&self.store, input, MAX_MODEL_BYTES).await?;
            let size = bytes.len() as u64;
            let model = compute::run(move || Gplvm::from_bytes(&bytes)).await;
            let model = model.map_err(|e| {
                JobError::give_up(format!("the trained gplvm can't be used: {e}"), format!("{e:?}"))
            })?;
            Ok::<_, JobError>((model, size))
        };
        self.models.get_or_load(model.blake3.clone(), load).await
    }
}
