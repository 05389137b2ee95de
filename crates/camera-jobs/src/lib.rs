//! What the services that work on calibrated cameras share.
//!
//! - [`Silhouettes`]: those of all cameras in a run of frames, out of the clips that jobs left.
//! - [`tracking_session`]: what the jobs that follow a person are given.
//! - [`shape`]: a body by coefficients or by simple measurements.
//! - [`views`]: calibration and masks of a gRPC request.

mod session;
mod shapes;
mod silhouettes;
mod views;

pub use session::tracking_session;
pub use shapes::{ShapeError, sex, shape};
pub use silhouettes::{Silhouettes, View, reports};
pub use views::{Views, views};
