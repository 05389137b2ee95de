use std::{sync::Arc, time::Duration};

use sqlx::PgPool;
use store::Store;
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use crate::{Config, changes::Changes, live::Live, observe::HttpCounts};

/// What every handler shares.
#[derive(Debug, Clone)]
pub struct App {
    /// PostgreSQL
    pub db: PgPool,
    /// the object store
    pub store: Store,
    /// limits of a request
    pub limits: Limits,
    pub(crate) http_counts: Arc<HttpCounts>,
    pub(crate) changes: Changes,
    pub(crate) live: Live,
    /// streams that would go on end when this is cancelled
    pub(crate) shutdown: CancellationToken,
}

/// Limits of a request.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// largest upload, bytes
    pub max_upload_bytes: u64,
    /// longest wait for the next bytes of an upload
    pub upload_stall: Duration,
    /// longest time for a request that is no upload, download or event stream
    pub request_timeout: Duration,
}

impl App {
    /// Puts together what handlers share.
    pub fn new(db: PgPool, store: Store, config: &Config, shutdown: CancellationToken) -> Self {
        Self {
            db,
            store,
            limits: Limits {
                max_upload_bytes: config.max_upload_bytes,
                upload_stall: config.upload_stall,
                request_timeout: config.request_timeout,
            },
            http_counts: Arc::default(),
            changes: Changes::default(),
            live: Live {
                replicas: config.reconstruction.clone(),
                tasks: TaskTracker::new(),
                shutdown: shutdown.clone(),
            },
            shutdown,
        }
    }
}
