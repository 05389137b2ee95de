//! How far a reconstruction is from the truth, and the protocols under which that is asked (docs/papers.md).
//!
//! - [`compare`], [`compare_in_detail`]: all metrics of one trial, always together; by frame and by joint.
//! - [`foot_slide`], [`Calibration`]: whether standing feet stand, and whether errors are as large as stated.
//! - [`evaluate_sparse`]: trials reconstructed from their own control points, by [`Protocol`], in every case of a [`Sweep`]:
//!   methods, windows, sizes of the database, noise, gaps.
//! - [`shape_errors`]: how far a body found in silhouettes is from the true one, by distances of [`surface`]s; [`Distribution`]
//!   over many.
//! - [`Recording`]: recorded motion on the morphable body.
//! - [`limbs`]: where inverse kinematics finds elbows and knees; [`recovery`]: how often a particle search finds a disturbed
//!   pose again, with the [`training_poses`] of its prior.
//! - [`Proportion`], [`PairedDifference`]: how often something succeeds, and whether one way does so oftener than another.
//! - [`Picture`]: measured points, the motion found and the true one, to look at.
//! - [`summarise`] into [`Row`]s, [`tables`] of them beside the papers' own, and HTML reports ([`report`]).

mod calibration;
mod case;
mod disturbance;
mod error;
mod feet;
mod gap;
pub mod limbs;
mod metrics;
mod models;
mod performer;
mod picture;
mod proportion;
mod protocol;
mod recording;
pub mod recovery;
pub mod report;
mod shape;
mod sparse_evaluation;
mod sparse_protocol;
mod subset;
mod summary;
pub mod surface;
pub mod tables;
pub mod training_poses;
mod truth;

pub use calibration::{Calibration, Count, DofGroup, WITHIN_ONE, WITHIN_TWO};
pub use case::{Case, Sweep, Variant};
pub use disturbance::{Gap, Hidden, Occlusion, disturbed};
pub use error::Error;
pub use feet::{ContactThresholds, FootPaths, FootSlide, foot_slide};
pub use gap::{GapErrors, gap_errors};
pub use metrics::{Comparison, Errors, JointErrors, compare, compare_in_detail};
pub use performer::{
    FeetResult, FootNumbers, SkeletonResult, SkeletonSource, SkeletonTrial, evaluate_feet, evaluate_skeletons,
};
pub use picture::{Picture, bones};
pub use proportion::{PairedDifference, Proportion, Verdict};
pub use protocol::{ControlSet, Protocol};
pub use recording::Recording;
pub use shape::{Body, Distribution, ShapeErrors, shape_errors};
pub use sparse_evaluation::SparseEvaluation;
pub use sparse_protocol::{TrialResult, evaluate_sparse};
pub use subset::{first_clips, poses_at_60, shuffle_by_name};
pub use summary::{ALL, GapSummary, Row, summarise};
pub use truth::{at_60_hz, at_database_rate, control_trajectories};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
