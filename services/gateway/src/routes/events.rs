//! A run's progress as server-sent events.

use std::{convert::Infallible, time::Duration};

use axum::response::sse::{Event, KeepAlive, Sse};
use futures::Stream;
use serde::Serialize;
use tokio::time::timeout;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::{
    access::{Access, Reader},
    error::Result,
    extract::Path,
    runs::{Run, run},
};

/// How often to look when no notification comes: they may be lost.
const POLL: Duration = Duration::from_secs(1);
/// Least time between two events, so that fast jobs don't flood a slow reader.
const PACE: Duration = Duration::from_millis(100);

/// How far a run is.
#[derive(Debug, PartialEq, Serialize, ToSchema)]
pub(crate) struct Progress {
    /// `queued`, `running`, `succeeded`, `failed` or `cancelled`
    #[schema(example = "running")]
    state: String,
    /// 0 to 1
    #[schema(example = 0.4)]
    progress: f64,
    /// what is being done, in words
    phrase: String,
    /// why it failed
    error: Option<String>,
}

impl Progress {
    fn is_end(&self) -> bool {
        matches!(self.state.as_str(), "succeeded" | "failed" | "cancelled")
    }
}

impl From<Run> for Progress {
    fn from(run: Run) -> Self {
        Self { state: run.state, progress: run.progress, phrase: run.phrase, error: run.error }
    }
}

/// Watch a run
///
/// Server-sent events: `progress` with how far it is, first as it stands and then whenever it changes, and `end` when
/// the run has ended; the stream ends then. To go on after a broken connection, just connect again.
#[utoipa::path(
    get, path = "/v1/runs/{run_id}/events", tag = "runs", params(("run_id" = Uuid, Path,)),
    responses((status = 200, body = Progress, content_type = "text/event-stream")),
)]
pub(super) async fn watch(
    Reader(Access { app, caller }): Reader,
    Path(run_id): Path<Uuid>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>> {
    // first subscribed, then looked: nothing in between is missed
    let mut changes = app.changes.subscribe();
    let mut db = app.db.acquire().await?;
    let mut now: Progress = run::find(&mut db, caller.project_id, run_id).await?.into();
    drop(db);
    let stream = async_stream::stream! {
        loop {
            let name = if now.is_end() { "end" } else { "progress" };
            match Event::default().event(name).json_data(&now) {
                Ok(event) => yield Ok(event),
                Err(_) => return,
            }
            if now.is_end() {
                return;
            }
            loop {
                tokio::time::sleep(PACE).await;
                tokio::select! {
                    _ = timeout(POLL, changes.wait_for(run_id)) => {}
                    () = app.shutdown.cancelled() => return,
                }
                let found = async {
                    let mut db = app.db.acquire().await?;
                    run::find(&mut db, caller.project_id, run_id).await
                };
                match found.await.map(Progress::from) {
                    Ok(next) if next != now => {
                        now = next;
                        break;
                    }
                    Ok(_) => {}
                    // deleted, or the database is away: the watcher connects again and hears it
                    Err(_) => return,
                }
            }
        }
    };
    Ok(Sse::new(stream).keep_alive(KeepAlive::default()))
}
