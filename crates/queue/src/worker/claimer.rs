//! The main task of a worker: takes jobs while there are free slots.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

use super::attempt::attempt;
use super::context::Stop;
use super::keeper::keep;
use super::link::{Link, Reconnect};
use super::listener::listen;
use super::shared::Shared;
use crate::{ClaimedJob, Error, claim, is_any_available, reap};

/// Between two claims of a busy worker, so that one claim fills several slots.
const GATHER: Duration = Duration::from_millis(2);

/// A claim that takes longer is tried again over a new connection.
const CLAIM_LIMIT: Duration = Duration::from_secs(10);

/// Works until the shutdown, then ends or hands back what it holds.
pub(super) async fn work(shared: Arc<Shared>) {
    // All tasks hang on this one: when it is dropped they are.
    let mut tasks = JoinSet::new();
    let done = CancellationToken::new();
    tasks.spawn(listen(shared.clone(), done.clone()));
    tasks.spawn(keep(shared.clone(), done.clone()));
    tasks.spawn(sweep(shared.clone(), done.clone()));
    let mut attempts = JoinSet::new();
    claim_until_shutdown(&shared, &mut attempts).await;
    finish(&shared, &mut attempts).await;
    done.cancel();
    tasks.join_all().await;
}

async fn claim_until_shutdown(shared: &Arc<Shared>, attempts: &mut JoinSet<()>) {
    let mut beating = shared.heartbeat_interval.subscribe();
    tokio::select! {
        () = shared.shutdown.cancelled() => return,
        // A lease that nobody keeps is not worth taking.
        known = beating.wait_for(Option::is_some) => if known.is_err() { return },
    }
    let slots = Arc::new(Semaphore::new(shared.concurrency));
    let mut link = Link::new((*shared.pool.connect_options()).clone());
    let mut reconnect = Reconnect::new();
    loop {
        let permit = tokio::select! {
            biased;
            () = shared.shutdown.cancelled() => return,
            permit = slots.clone().acquire_owned() => permit,
        };
        let Ok(first) = permit else { return };
        let mut permits = vec![first];
        permits.extend(std::iter::from_fn(|| slots.clone().try_acquire_owned().ok()));
        while attempts.try_join_next().is_some() {}
        let wait = match take(shared, &mut link, permits.len()).await {
            Ok(Taken::Jobs(jobs)) => {
                reconnect.succeeded();
                shared.is_connected.store(true, Ordering::Relaxed);
                start(shared, attempts, jobs, permits);
                // Notifications coalesce: after a claim that found something, look again.
                tokio::time::sleep(GATHER).await;
                continue;
            }
            Ok(Taken::Contended) => Duration::from_millis(2),
            Ok(Taken::Nothing) => {
                reconnect.succeeded();
                shared.is_connected.store(true, Ordering::Relaxed);
                shared.poll_interval
            }
            Err(error) => {
                shared.is_connected.store(false, Ordering::Relaxed);
                tracing::warn!(%error, "claiming failed");
                reconnect.next()
            }
        };
        drop(permits);
        tokio::select! {
            () = shared.shutdown.cancelled() => return,
            () = shared.wake.available.notified() => {}
            () = tokio::time::sleep(wait) => {}
        }
    }
}

enum Taken {
    Jobs(Vec<ClaimedJob>),
    /// There are some, but others were taking the first of them.
    Contended,
    Nothing,
}

async fn take(shared: &Shared, link: &mut Link, limit: usize) -> Result<Taken, Error> {
    let kinds: Vec<&str> = shared.handlers.keys().copied().collect();
    link.run(CLAIM_LIMIT, async |connection| {
        let jobs = claim(connection, &shared.name, &kinds, limit).await?;
        if !jobs.is_empty() {
            return Ok(Taken::Jobs(jobs));
        }
        let more = is_any_available(connection, &kinds).await?;
        Ok(if more { Taken::Contended } else { Taken::Nothing })
    })
    .await
}

fn start(
    shared: &Arc<Shared>,
    attempts: &mut JoinSet<()>,
    jobs: Vec<ClaimedJob>,
    permits: Vec<OwnedSemaphorePermit>,
) {
    for (job, permit) in jobs.into_iter().zip(permits) {
        let shared = shared.clone();
        attempts.spawn(async move {
            attempt(shared, job).await;
            drop(permit);
        });
    }
}

/// After the shutdown began: waits for the jobs for the grace, then has them handed back.
async fn finish(shared: &Shared, attempts: &mut JoinSet<()>) {
    let all_ended = async { while attempts.join_next().await.is_some() {} };
    tokio::pin!(all_ended);
    if tokio::time::timeout(shared.grace, &mut all_ended).await.is_ok() {
        return;
    }
    for held in shared.held.all() {
        held.stop(Stop::Shutdown);
    }
    all_ended.await;
}

/// Takes jobs away from lost workers, twice in a staleness.
async fn sweep(shared: Arc<Shared>, done: CancellationToken) {
    loop {
        let interval = shared.heartbeat_interval.borrow().unwrap_or(Duration::from_secs(1)) * 5 / 2;
        tokio::select! {
            () = done.cancelled() => return,
            () = tokio::time::sleep(interval) => {}
        }
        let swept = async {
            let mut connection = shared.pool.acquire().await?;
            reap(&mut connection, &shared.retry).await
        };
        tokio::select! {
            () = done.cancelled() => return,
            swept = swept => if let Err(error) = swept {
                tracing::warn!(%error, "sweep for lost workers failed");
            },
        }
    }
}
