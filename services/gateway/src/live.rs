//! Live streams: WebSockets on this side, gRPC on the other.

mod bridge;
mod messages;
mod replicas;

pub(crate) use bridge::serve;
pub use replicas::Replicas;

use tokio_util::task::TaskTracker;

/// What live streams share.
#[derive(Debug, Clone)]
pub(crate) struct Live {
    pub replicas: Replicas,
    /// streams under way: a shutdown waits for their last states
    pub tasks: TaskTracker,
}
