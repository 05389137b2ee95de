//! Training poses of the morphable body out of recorded motion: what the Parzen prior of a particle search is made of
//! (docs/papers.md#particle-search, eq. 15: "about 100 samples from different motions").
//!
//! [`recorded_poses`] and [`database_poses`] bring recordings of the CMU skeleton to the body's rig; [`covering`] chooses a few
//! poses that stand for all. [`training_poses`] does both.
//!
//! Metres, radians, y up; poses have shape `[dofs]` of the body's rig.

mod covering;
mod recorded;

pub use covering::covering;
pub use recorded::{database_poses, recorded_poses, training_poses};
