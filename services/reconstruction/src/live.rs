//! `marey.v1.Live`: poses of what is being measured now.
//!
//! A stream has a thread of its own that computes, and two bounded queues: frames in, poses out. How many streams there
//! are is limited. Nothing is kept here: a stream goes on anywhere from the states that it gives out.

mod end;
mod queue;
mod start;
mod stream;

use crate::{Shared, config::LiveConfig, error::CallError};
use end::StreamEnd;
use library::Cache;
use motion_db::ControlTable;
use proto::v1::{self, live_request, live_server};
use std::{pin::Pin, sync::Arc, time::Duration};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_stream::Stream;
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status, Streaming};

/// A stream that was opened must say what it wants within this time.
const START_WAIT: Duration = Duration::from_secs(10);
/// Largest request, bytes: a start with its skeleton and state.
pub(crate) const MAX_REQUEST_BYTES: usize = 2 << 20;
/// Share of the memory for databases that goes to tables of control points.
const TABLE_SHARE: f64 = 0.125;

pub(crate) struct LiveRpc {
    shared: Arc<Shared>,
    config: LiveConfig,
    slots: Arc<Semaphore>,
    /// by database, window, skeleton and points
    tables: Cache<blake3::Hash, ControlTable>,
    shutdown: CancellationToken,
}

impl LiveRpc {
    pub fn new(shared: Arc<Shared>, config: LiveConfig, shutdown: CancellationToken) -> Self {
        let bytes = (shared.resources.memory.cache_bytes as f64 * TABLE_SHARE) as u64;
        Self {
            slots: Arc::new(Semaphore::new(config.max_streams)),
            tables: Cache::new(bytes),
            shared,
            config,
            shutdown,
        }
    }

    fn slot(&self) -> Result<OwnedSemaphorePermit, CallError> {
        if self.shutdown.is_cancelled() {
            return Err(CallError::ShuttingDown);
        }
        let slot = self.slots.clone().try_acquire_owned();
        slot.map_err(|_| CallError::TooManyStreams { limit: self.config.max_streams })
    }
}

#[tonic::async_trait]
impl live_server::Live for LiveRpc {
    type FollowStream = Pin<Box<dyn Stream<Item = Result<v1::LiveResponse, Status>> + Send>>;

    async fn follow(
        &self,
        request: Request<Streaming<v1::LiveRequest>>,
    ) -> Result<Response<Self::FollowStream>, Status> {
        let slot = self.slot()?;
        let mut requests = request.into_inner();
        let first = tokio::time::timeout(START_WAIT, requests.message()).await;
        let first = first.map_err(|_| StreamEnd::NoStart(START_WAIT))??;
        let Some(live_request::Message::Start(start)) = first.and_then(|first| first.message) else {
            return Err(StreamEnd::NotAStart.into());
        };
        let start = self.prepare(start).await?;
        let responses = stream::open(start, requests, slot, &self.config, self.shutdown.clone()).await?;
        Ok(Response::new(Box::pin(responses)))
    }
}
