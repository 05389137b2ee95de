//! The motion database: recorded motion at 60 frames a second, in coordinates that know neither where on the floor
//! the person stands nor which way they face, and search in it (docs/papers.md#heading-frame,
//! docs/papers.md#neighbour-search).
//!
//! - [`MotionDatabase`]: clips and their coordinates; [`Augment`] makes more of them.
//! - [`WindowIndex`]: every window `Q_{t,m}` of a database, rotated to principal axes, with its nearest neighbours: all of
//!   them ([`WindowIndex::nearest`]) or nearly all, much sooner ([`WindowIndex::nearest_fast`]).
//! - [`IndexFile`]: both in a file that is used where it lies; [`write_index`].
//! - [`ControlTable`]: where a session's control points would be in every pose of the database.
//! - [`start_poses`]: the poses whose control points fit the first frames of a session best.

mod augment;
mod blocks;
mod build;
mod candidate;
mod column;
mod controls;
mod database;
mod error;
mod fast;
mod file;
mod frame;
mod graph;
mod lead;
mod lists;
mod mirror;
mod parts;
mod performers;
mod query;
mod scratch;
mod search;
mod segments;
mod start;
mod start_scan;
mod threads;
mod window;

pub use augment::{Augment, trial_name, warp};
pub use build::{Clip, SkeletonSize, resample};
pub use controls::ControlTable;
pub use database::{ClipInfo, FRAME_RATE, MotionDatabase};
pub use error::Error;
pub use fast::SearchMode;
pub use file::{FORMAT_VERSION, IndexFile, write_index};
pub use frame::HeadingFrame;
pub use mirror::mirror;
pub use performers::ZeroPosePrior;
pub use query::{Neighbour, Query};
pub use scratch::Scratch;
pub use start::{StartPose, start_poses};
pub use start_scan::StartScan;
pub use threads::{OneThread, Threads};
pub use window::{FeatureScale, WindowIndex};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
