//! Body models, read when first asked for and kept.

use std::sync::Arc;

use body::{BodyModel, shipped};
use jobs::body_model::{BodyModelFile, SHIPPED};
use proto::{CallError, ErrorCode};
use queue::JobError;
use service::{Resources, compute, objects};
use uuid::Uuid;

use crate::{Cache, versions::body_models};

/// What models take together in memory, bytes; one takes about six times its file.
const CACHE_BYTES: u64 = 256 << 20;

/// Body models of one process.
#[derive(Debug)]
pub struct Models {
    resources: Resources,
    /// by the BLAKE3 of their files
    loaded: Cache<String, BodyModel>,
}

impl Models {
    /// None yet.
    pub fn new(resources: Resources) -> Self {
        Self { resources, loaded: Cache::new(CACHE_BYTES) }
    }

    /// The model of a file.
    ///
    /// # Errors
    /// Gives up on a file that is gone or none of ours, and on a shipped model other than this program's.
    pub async fn get(&self, file: &BodyModelFile) -> Result<Arc<BodyModel>, JobError> {
        let Some(store_key) = &file.store_key else {
            let own = compute::run(shipped).await;
            if own.blake3 == file.blake3 {
                return Ok(own.model.clone());
            }
            // The gateway is of another version: one of the two is being replaced.
            return Err(JobError::retry(format!(
                "the shipped body model has blake3 {}, expected {}",
                own.blake3, file.blake3
            )));
        };
        let load = async {
            let name = format!("body model {}@{}", file.name, file.version);
            let input = objects::Input { name: &name, store_key, blake3: &file.blake3 };
            let bytes = objects::read(&self.resources.store, input, body::MAX_BYTES as u64).await?;
            let model = compute::run(move || BodyModel::from_bytes(&bytes)).await;
            let model = model.map_err(|e| JobError::give_up(format!("{name}: {e}"), format!("{e:?}")))?;
            let bytes =
                (model.num_vertices() * (48 + 6 * model.num_components()) + 12 * model.faces().len()) as u64;
            Ok::<_, JobError>((model, bytes))
        };
        self.loaded.get_or_load(file.blake3.clone(), load).await
    }

    /// The model of a request, by its id or `shipped`, and its file.
    ///
    /// # Errors
    /// If there is none, or it can't be read.
    pub async fn for_request(&self, which: &str) -> Result<(BodyModelFile, Arc<BodyModel>), ModelError> {
        let file = self.find(which).await?;
        let model = self.get(&file).await.map_err(ModelError::Load)?;
        Ok((file, model))
    }

    async fn find(&self, which: &str) -> Result<BodyModelFile, ModelError> {
        if which == SHIPPED {
            return Ok(shipped_file());
        }
        let id: Uuid = proto::id("body_model_id", which)?;
        let found = body_models::find(&self.resources.pool, id).await?;
        found.ok_or_else(|| ModelError::NoSuchModel(which.to_owned()))
    }
}

fn shipped_file() -> BodyModelFile {
    let (id, name) = (Uuid::nil(), SHIPPED.to_owned());
    BodyModelFile { id, name, version: 1, store_key: None, blake3: shipped().blake3.clone() }
}

/// Why a request gets no body model.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// Not an id.
    #[error(transparent)]
    Request(#[from] proto::Error),
    /// None of that id.
    #[error("body model {0} does not exist or is not ready")]
    NoSuchModel(String),
    /// Its file.
    #[error("the body model can't be loaded")]
    Load(#[source] JobError),
    /// PostgreSQL failed.
    #[error("database: {0}")]
    Catalogue(#[from] sqlx::Error),
}

impl CallError for ModelError {
    fn code(&self) -> ErrorCode {
        match self {
            Self::Request(_) => ErrorCode::InvalidInput,
            Self::NoSuchModel(_) => ErrorCode::NotFound,
            Self::Load(JobError::GiveUp { .. }) => ErrorCode::NotReady,
            Self::Load(_) | Self::Catalogue(_) => ErrorCode::Unavailable,
        }
    }
}
