//! Points on a person that are found again in other pictures of the same camera: Lowe's scale-invariant
//! features (Lowe 2004; docs/papers.md#other-sources), inside a silhouette.
//!
//! - [`detect`], [`Detector`]: extrema of differences of Gaussians with their descriptors. Only the region of the person is
//!   looked at, and only points well inside the silhouette are taken: at its outline the background is seen.
//! - [`match_features`]: who is whom in two pictures.
//! - [`FrameMatcher`]: the same for a stream of pictures.
//!
//! Pixels as everywhere: (0, 0) is the centre of the top-left one. The same pictures give the same bits on every machine. What
//! differs from Lowe's method, and what was measured, is in `docs/features.md`.
//!
//! ```
//! use features::{FrameMatcher, Options};
//! use model::{Image, Silhouette};
//! let picture = |shift: usize| {
//!     let grey = |i: usize| ((i % 200 + shift) / 7 * 31 + i / 200 / 6 * 57) % 160;
//!     let bytes = (0..200 * 150).flat_map(|i| [grey(i) as u8; 3]).collect();
//!     Image::from_rgb(200, 150, bytes).unwrap()
//! };
//! let all = Silhouette::from_pixels(200, 150, &[1; 200 * 150], |pixel| pixel == 1).unwrap();
//! let mut matcher = FrameMatcher::new(Options::default());
//! assert!(matcher.push(&picture(5), &all).is_empty());
//! let matches = matcher.push(&picture(0), &all);
//! assert!(!matches.is_empty());
//! ```

mod descriptor;
mod detect;
mod extrema;
mod frame_matcher;
mod grey;
mod matching;
mod options;
mod orientation;
mod scale_space;

pub use descriptor::Descriptor;
pub use detect::{Detector, Feature, Features, detect};
pub use frame_matcher::FrameMatcher;
pub use matching::match_features;
pub use options::Options;
