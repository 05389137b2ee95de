//! What the tasks of one worker share.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use sqlx::PgPool;
use tokio::sync::{Notify, watch};
use tokio_util::sync::CancellationToken;

use super::context::HeldJobs;
use super::handler::{BeforeAttempt, DynHandler};
use crate::RetryPolicy;

/// What the tasks of one worker share.
pub(super) struct Shared {
    pub(super) pool: PgPool,
    pub(super) name: String,
    pub(super) handlers: HashMap<&'static str, Arc<dyn DynHandler>>,
    pub(super) before_attempt: Option<Arc<BeforeAttempt>>,
    pub(super) concurrency: usize,
    pub(super) poll_interval: Duration,
    pub(super) grace: Duration,
    pub(super) patience: Duration,
    pub(super) retry: RetryPolicy,
    pub(super) shutdown: CancellationToken,
    pub(super) held: HeldJobs,
    pub(super) wake: Wake,
    /// Unknown until the database has been reached.
    pub(super) heartbeat_interval: watch::Sender<Option<Duration>>,
    pub(super) is_connected: AtomicBool,
}

/// Who is woken by what.
pub(super) struct Wake {
    /// Something may be available.
    pub(super) available: Notify,
    /// Something may be cancelled.
    pub(super) cancelled: Notify,
}
