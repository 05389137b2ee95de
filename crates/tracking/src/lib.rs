//! A person's pose tracked through the calibrated silhouettes of several cameras (docs/papers.md#tracking), the
//! shape being known, and through points of the skin that cameras find again ([`ObservedFrame::with_matches`]).
//!
//! [`Tracker`] takes frame after frame: the pose is predicted, fitted to the contours ([`Tracker::optimise`]), judged limb by
//! limb ([`Misalignment`]), and searched for by particles where limbs are misaligned ([`Tracker::search`]), then fitted again.
//! [`track_footage`] does so for a run of frames in which the person has to be found first, [`merge`] puts such runs together.
//! The method, its thresholds, and what it was measured to do are in `docs/tracking.md`.
//!
//! Metres, radians, y up. Results depend on the seed and on what was seen, not on the number of threads.

mod chunk;
mod chunk_file;
mod error;
mod footage;
mod joint_limit_term;
mod lift;
mod local;
mod misalignment;
mod observed_frame;
mod options;
mod particles;
mod parzen_term;
mod predict;
mod prediction_term;
mod random;
mod silhouette_term;
mod stage;
mod texture_term;
mod tracker;
mod training_poses;

pub use chunk::{Chunk, ChunkPlan, Merged, Seam, merge, plan_chunks};
pub use error::Error;
pub use footage::{Footage, Seen, hold_unseen, track_footage};
pub use joint_limit_term::joint_limit_energy;
pub use misalignment::{LimbError, Misalignment};
pub use observed_frame::ObservedFrame;
pub use options::{Annealing, Options, Part, ParticleOptions};
pub use particles::Search;
pub use parzen_term::Parzen;
pub use predict::{blended, predicted};
pub use prediction_term::PoseSpace;
pub use random::RandomStream;
pub use silhouette_term::SilhouetteTerm;
pub use stage::Stage;
pub use tracker::{Tracked, Tracker};
pub use training_poses::built_in_poses;

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
