//! What the services that work on calibrated cameras share.
//!
//! - [`Models`]: body models out of the store and the catalogue, kept in memory up to a bound.
//! - [`Silhouettes`]: those of all cameras in a run of frames, out of the clips that jobs left.
//! - [`tracking_session`]: what the jobs that follow a person are given.
//! - [`Described`]: a body by coefficients or by simple measurements.
//! - [`views`]: calibration and masks of a gRPC request.

mod models;
mod session;
mod shapes;
mod silhouettes;
mod views;

pub use models::{ModelError, Models};
pub use session::tracking_session;
pub use shapes::{Described, ShapeError};
pub use silhouettes::{Silhouettes, View, reports};
pub use views::{Views, views};
