//! What the services that work on calibrated cameras share.
//!
//! - [`Models`]: body models out of the store and the catalogue, kept in memory up to a bound.
//! - [`Silhouettes`]: those of all cameras in a run of frames, out of the clips that jobs left.
//! - [`TrackingSession`] and the payloads of the jobs that follow a person.
//! - [`Described`]: a body by coefficients or by simple measurements.
//! - [`views`]: calibration and masks of a gRPC request.

mod models;
mod shapes;
mod silhouettes;
mod tracking_session;
mod views;

pub use models::{ModelError, Models};
pub use shapes::{Described, ShapeError};
pub use silhouettes::{CameraClips, Silhouettes, StoredClip, View, named, reports};
pub use tracking_session::{
    DRAW_OVERLAY, DrawOverlay, MERGE_TRACKS, MergeTracks, TRACK_CHUNK, TRACKED, TrackChunk, TrackingSession,
};
pub use views::{Views, views};
