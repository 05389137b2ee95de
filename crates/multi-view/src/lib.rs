//! Sessions of several cameras, between the files that people upload and the silhouettes that bodies are fitted to.
//!
//! - [`assign`]: which file, or folder of an archive, belongs to which camera, told from names.
//! - [`CameraRecord`]: a camera as jobs hand it on, to the bit.
//! - [`SilhouetteClip`], [`ClipWriter`]: a stretch of silhouettes in a few kilobytes a second.
//! - [`MatchClip`], [`MatchClipWriter`]: points of a camera that were found again from frame to frame.
//! - [`Parameters`]: all that decides the result.
//!
//! ```
//! use model::Silhouette;
//! use multi_view::{ClipWriter, SilhouetteClip};
//! let mut person = Silhouette::empty(200, 100);
//! person.set(70, 20, true);
//! let mut writer = ClipWriter::new(200, 100, 30);
//! writer.push(&person)?;
//! let clip = SilhouetteClip::from_bytes(&writer.finish())?;
//! assert_eq!(clip.frames(), 30..31);
//! assert_eq!(clip.get(30)?, person);
//! # Ok::<(), multi_view::Error>(())
//! ```

mod assign;
mod camera;
mod clip;
mod error;
mod matches;
mod packed;
mod parameters;

pub use assign::{Assigned, assign, find_camera};
pub use camera::CameraRecord;
pub use clip::{ClipWriter, SilhouetteClip};
pub use error::Error;
pub use matches::{MatchClip, MatchClipWriter};
pub use parameters::Parameters;

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
