//! Live streams: WebSockets on this side, gRPC on the other.

mod bridge;
mod chosen;
mod messages;
mod replicas;
mod shared;

pub(crate) use bridge::serve;
pub(crate) use chosen::Chosen;
pub use replicas::Replicas;
pub(crate) use shared::Live;
