//! From markers on the skin to control points on the skeleton.
//!
//! A [`MarkerMap`] says which markers make which control point: the weighted mean of several, at a fixed offset from
//! the joint, and how sure that is. Maps are files that people write ([`MarkerMap::parse`]), or [`presets`] for common
//! marker sets, of which [`detect`] finds the one that a file's names belong to. [`MarkerMap::apply`] makes the control
//! points' trajectories. `docs/markers.md` describes files, presets and rules.
//!
//! ```
//! use markers::MarkerMap;
//! let map = MarkerMap::parse("[points]\nleft_wrist = [\"LWRA\", \"LWRB\"]\nhead = \"LFHD\"\n").unwrap();
//! let names: Vec<_> = map.points().map(|p| p.name.as_str()).collect();
//! assert_eq!(names, ["head", "left_wrist"]);
//! ```

mod apply;
mod combine;
mod detect;
mod error;
mod map;
mod names;
mod parse;
mod presets;
mod standard;
mod template;

pub use apply::{Mapped, MappedPoint, upside_down};
pub use detect::{Fit, PointFit, detect, fits};
pub use error::Error;
pub use map::{Group, MarkerMap, Point};
pub use names::find_name;
pub use presets::{preset, presets};
pub use standard::{STANDARD, standard_names};
pub use template::template;

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
