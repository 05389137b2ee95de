//! Pose and shape of a person from the calibrated silhouettes of several cameras (docs/papers.md#morphable-model),
//! without any start given.
//!
//! [`fit`] cleans the silhouettes, carves a coarse visual hull that tells where the person is and whether the views
//! fit together, tries many start poses at low resolution, and minimises the distance between the rim of the
//! projected model and the contours of the images, both ways, over pose and shape together. [`fit_frames`] does so
//! for several frames of one person, who has one shape and a pose a frame; [`fit_pose`] finds the pose of a person
//! whose shape is known. The method and what it was measured to do are in `docs/shape.md`.
//!
//! Metres, radians, y up. The person should stand about upright.

mod cleaning;
mod confidence;
mod contour_term;
mod error;
mod fit;
mod match_outlines;
mod observation;
mod options;
mod overlay;
mod place;
mod prior_term;
mod solver;
mod start_poses;
mod starts;

pub use cleaning::cleaned;
pub use contour_term::{PosedBody, Quadratic, Scratch, Term, Weighting};
pub use error::Error;
pub use fit::{Fit, ViewFit, fit, fit_frames, fit_pose};
pub use observation::{Level, Observation, Outline};
pub use options::Options;
pub use overlay::draw_outline;
pub use prior_term::{add_limits, add_pose};
pub use start_poses::{ARMS, LEGS, WHOLE, limb_dofs, set_limb};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
