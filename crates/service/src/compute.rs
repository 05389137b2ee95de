//! Computation away from the async threads.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use tokio::{sync::Semaphore, task::JoinError};

/// Runs `work` on a thread that may block, and waits for it. A panic in it goes on here, where the worker loop or
/// the gRPC server catches it.
pub async fn run<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let span = tracing::Span::current();
    match tokio::task::spawn_blocking(move || span.in_scope(work)).await.map_err(JoinError::try_into_panic) {
        Ok(value) => value,
        Err(Ok(panic)) => std::panic::resume_unwind(panic),
        // The runtime is being dropped, and this task with it: never continue.
        Err(Err(_)) => std::future::pending().await,
    }
}

/// Calls that compute at once: one a core, the rest wait.
#[derive(Debug)]
pub struct Slots(Semaphore);

impl Default for Slots {
    fn default() -> Self {
        Self(Semaphore::new(std::thread::available_parallelism().map_or(1, usize::from)))
    }
}

impl Slots {
    /// [`run`], when a slot is free.
    pub async fn run<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> T {
        // A failure to get a slot would mean that the semaphore was closed, which nobody does.
        let _slot = self.0.acquire().await;
        run(work).await
    }
}

/// A flag for a thread that computes, raised when this goes away: whatever ends a job or a call ends the work for it.
#[derive(Debug, Default)]
pub struct StopOnDrop(Arc<AtomicBool>);

impl StopOnDrop {
    /// For the thread.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.0.clone()
    }

    /// Raises the flag now.
    pub fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        self.stop();
    }
}
