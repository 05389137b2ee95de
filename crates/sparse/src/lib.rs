//! Sparse reconstruction: full-body motion from the trajectories of a few control points (docs/papers.md#local-regression).
//!
//! Frame by frame: the K database windows nearest to the last poses and the measured points
//! ([`motion_db::WindowIndex`]), a regression from window to next pose ([`regression`]), and the most probable pose
//! between that prediction and the measurement ([`posterior::MapSolver`]).
//!
//! - [`Session`]: skeleton, control points and their trajectories at 60 frames a second.
//! - [`Parameters`]: everything a run can choose, each with a default.
//! - [`Reconstructor`]: the frame loop over a range of frames, with start and re-entry.
//! - [`Live`]: the same for frames that come one by one, now.
//! - [`train_gplvm`]: the model that method `gplvm` needs.
//! - [`plan_chunks`], [`merge`]: long sessions cut for many workers and put together again.

mod bytes;
mod chunks;
mod error;
mod examples;
mod frame_part;
mod frame_query;
mod frame_solver;
mod live;
mod methods;
mod parameters;
mod problem;
mod reconstruct;
mod reconstruction;
mod session;
mod start;
mod track;
mod training;
mod uncertainty;
mod zero_pose;
mod zero_pose_information;

pub use chunks::{Chunk, Merged, merge, plan_chunks};
pub use error::Error;
pub use frame_part::FramePart;
pub use kinematics::{ControlPoint, control_points};
pub use live::{Live, LivePose, MAX_LIVE_STATE_BYTES};
pub use parameters::{Covariance, Method, Parameters, Search};
pub use problem::control_table;
pub use reconstruct::Reconstructor;
pub use reconstruction::{FrameQuality, Reconstruction};
pub use session::{FarSamples, Session};
pub use training::train_gplvm;

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
