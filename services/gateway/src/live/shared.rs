use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::replicas::Replicas;

/// What live streams share.
#[derive(Debug, Clone)]
pub(crate) struct Live {
    pub replicas: Replicas,
    /// streams under way: a shutdown waits for their last states
    pub tasks: TaskTracker,
    /// streams end when this is cancelled
    pub shutdown: CancellationToken,
}
