//! A small statistical model of human motion, and motion drawn from it.
//!
//! Recorded motion is not ours to ship, so the repository carries what was *learned* from it: mean movements and
//! principal components of shape, timing and style for walking, running, jumping and boxing (at most 500 KB), and
//! mean bone lengths with their variation. Any number of different trials on any number of different skeletons is
//! drawn from it by seed. What comes out is synthetic: say so wherever it is shown ([`NOTICE`], [`CREDIT`]).
//! The method and the file are described in `docs/sample-motion.md`.
//!
//! ```
//! use sample_motion::{Action, DrawOptions, Model};
//! let model = Model::bundled();
//! let walk = model.draw(Action::Walk, 7, &DrawOptions { frames: 120, subject: 3 })?;
//! assert_eq!((walk.num_frames(), walk.skeleton().num_dofs()), (120, 62));
//! # Ok::<(), sample_motion::Error>(())
//! ```

mod action;
mod action_from_str;
mod basis;
mod body;
mod components;
mod draw;
mod error;
mod features;
mod file;
mod frame_rate;
mod gait;
mod ground;
mod jumps;
mod learn;
mod movement;
mod punches;
mod random;
mod segment;
mod signal;

pub use action::Action;
pub use draw::DrawOptions;
pub use error::Error;
pub use file::{CREDIT, MAX_BYTES, NOTICE};
pub use frame_rate::FRAME_RATE;
pub use learn::LabelledMotion;
pub use movement::{Model, MovementSummary};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
