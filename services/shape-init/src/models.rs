//! Body models, read when first asked for and kept.

use std::sync::Arc;

use body::BodyModel;
use body_files::shipped;
use payloads::{BodyModelFile, SHIPPED};
use queue::JobError;
use service::{Cache, compute, objects};
use sqlx::PgPool;
use store::Store;
use uuid::Uuid;

use crate::error::CallError;

/// What models take together in memory, bytes; one takes about six times its file.
const CACHE_BYTES: u64 = 256 << 20;

pub(crate) struct Models {
    store: Store,
    pool: PgPool,
    /// by the BLAKE3 of their files
    loaded: Cache<String, BodyModel>,
}

impl Models {
    pub fn new(store: Store, pool: PgPool) -> Self {
        Self { store, pool, loaded: Cache::new(CACHE_BYTES) }
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
            let bytes = objects::read(&self.store, input, body::MAX_BYTES as u64).await?;
            let model = compute::run(move || BodyModel::from_bytes(&bytes)).await;
            let model = model.map_err(|e| JobError::give_up(format!("{name}: {e}"), format!("{e:?}")))?;
            let bytes =
                (model.num_vertices() * (48 + 6 * model.num_components()) + 12 * model.faces().len()) as u64;
            Ok::<_, JobError>((model, bytes))
        };
        self.loaded.get_or_load(file.blake3.clone(), load).await
    }

    /// The file of a model that is ready, by its id or `shipped`.
    pub async fn find(&self, which: &str) -> Result<BodyModelFile, CallError> {
        if which == SHIPPED {
            return Ok(shipped_file());
        }
        let id: Uuid = proto::id("body_model_id", which)?;
        let sql = "SELECT id, name, version, store_key, blake3 FROM body_models
                   WHERE id = $1 AND store_key IS NOT NULL";
        let row: Option<(Uuid, String, i32, String, String)> =
            sqlx::query_as(sql).bind(id).fetch_optional(&self.pool).await?;
        let (id, name, version, store_key, blake3) =
            row.ok_or_else(|| CallError::NoSuchModel(which.to_owned()))?;
        Ok(BodyModelFile { id, name, version, store_key: Some(store_key), blake3 })
    }
}

fn shipped_file() -> BodyModelFile {
    let (id, name) = (Uuid::nil(), SHIPPED.to_owned());
    BodyModelFile { id, name, version: 1, store_key: None, blake3: shipped().blake3.clone() }
}
