//! Foot contacts: where the feet of a motion stand, how far they slide there, and how they are kept from it.
//!
//! - [`Feet`]: ankle and ball of both feet of a skeleton; [`FootTracks`]: their paths in a motion.
//! - [`detect`]: the frames in which each of them stands, by height and speed with hysteresis. The one detector of the
//!   project: what is held by [`hold_feet`] and what is measured by [`FootTracks::slide_cm_s`] is found by it.
//! - [`hold_feet`]: inverse kinematics that keeps standing feet where they are and everything else as it was.
//!
//! `docs/foot-contacts.md` has the method, its thresholds and what was measured.

mod contact;
mod detect;
mod error;
mod feet;
mod hold;
mod targets;

pub use contact::{Contact, Contacts};
pub use detect::{DetectSettings, detect};
pub use error::Error;
pub use feet::{Feet, FootTracks, POINTS};
pub use hold::{Held, HoldSettings, hold_feet};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
