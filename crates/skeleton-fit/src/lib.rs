//! The skeleton of a performer of whom only the paths of a few points are known.
//!
//! Sparse reconstruction needs bone lengths. Where no file gives them, [`fit_skeleton`] finds them: the mean skeleton of
//! a motion database, with the bones of arms, legs and trunk scaled so that the points move as points of the database's
//! motion would on such a body. How sizes vary between people ([`Population`]) is the prior, so that a limb on which no
//! point sits follows the others. `docs/skeleton.md` has the method and what was measured.

mod error;
mod evidence;
mod fit;
mod limbs;
mod population;
mod settings;
mod shapes;
mod sizes;

pub use error::Error;
pub use fit::{FittedSkeleton, LimbScale, fit_skeleton};
pub use limbs::{LIMBS, Limb, Limbs};
pub use population::Population;
pub use settings::FitSettings;
pub use sizes::Sizes;

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
