//! Keeps the leases: beats for all held jobs, sends their progress, hears of lost leases and cancels.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::context::{Held, Stop};
use super::link::{Link, Reconnect};
use super::shared::Shared;
use crate::{Beat, BeatAnswer, Error, heartbeat, heartbeat_interval, staleness};

/// Progress is sent this often at most.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(250);

/// Keeps the leases until `done`.
pub(super) async fn keep(shared: Arc<Shared>, done: CancellationToken) {
    let mut link = Link::new((*shared.pool.connect_options()).clone());
    let mut reconnect = Reconnect::new();
    let mut interval = Duration::from_secs(1);
    loop {
        let began = Instant::now();
        let held = shared.held.all();
        let next_beat = match beat(&mut link, &shared, &held, interval).await {
            Ok(found) => {
                reconnect.succeeded();
                interval = found;
                shared.heartbeat_interval.send_replace(Some(interval));
                began + interval
            }
            Err(error) => {
                tracing::warn!(%error, jobs = held.len(), "heartbeat failed");
                shared.is_connected.store(false, Ordering::Relaxed);
                Instant::now() + reconnect.next().min(interval)
            }
        };
        // Between two beats only what has moved is sent.
        let mut may_send_progress = began + PROGRESS_INTERVAL;
        loop {
            tokio::select! {
                () = done.cancelled() => return,
                () = tokio::time::sleep_until(next_beat) => break,
                () = shared.wake.cancelled.notified() => break,
                () = progressed(&shared, may_send_progress) => {
                    let moved: Vec<_> =
                        shared.held.all().into_iter().filter(|held| held.has_progress()).collect();
                    if let Err(error) = send(&mut link, &moved, interval).await {
                        tracing::debug!(%error, "progress not sent, coming with the next beat");
                    }
                    may_send_progress = Instant::now() + PROGRESS_INTERVAL;
                }
            }
        }
    }
}

async fn progressed(shared: &Shared, not_before: Instant) {
    shared.held.progressed.notified().await;
    tokio::time::sleep_until(not_before).await;
}

/// Beats for all; returns the interval to the next.
async fn beat(
    link: &mut Link,
    shared: &Shared,
    held: &[Arc<Held>],
    interval: Duration,
) -> Result<Duration, Error> {
    send(link, held, interval).await?;
    let staleness = link.run(limit(interval), async |connection| staleness(connection).await).await?;
    shared.is_connected.store(true, Ordering::Relaxed);
    Ok(heartbeat_interval(staleness))
}

/// A beat that takes longer than two intervals is tried again over a new connection.
fn limit(interval: Duration) -> Duration {
    (interval * 2).max(Duration::from_secs(1))
}

async fn send(link: &mut Link, held: &[Arc<Held>], interval: Duration) -> Result<(), Error> {
    if held.is_empty() {
        return Ok(());
    }
    let beats: Vec<Beat> = held
        .iter()
        .map(|held| Beat {
            job_id: held.lease.job_id,
            lease_number: held.lease.lease_number,
            progress: held.take_progress(),
        })
        .collect();
    let answers = link.run(limit(interval), async |connection| heartbeat(connection, &beats).await).await;
    let answers = match answers {
        Ok(answers) => answers,
        Err(error) => {
            for (held, beat) in held.iter().zip(beats) {
                held.put_back_progress(beat.progress);
            }
            return Err(error);
        }
    };
    for ((held, beat), answer) in held.iter().zip(beats).zip(answers) {
        match answer {
            BeatAnswer::Held => {}
            BeatAnswer::Busy => held.put_back_progress(beat.progress),
            BeatAnswer::Cancelled => held.stop(Stop::Cancelled),
            BeatAnswer::Lost => held.stop(Stop::LeaseLost),
        }
    }
    Ok(())
}
