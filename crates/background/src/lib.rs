//! Silhouettes from the frames of a camera that stands still: background models, cleaning, and how far to trust the result.
//!
//! - [`BackgroundModel`]: a plate or the clip's own colours, compared by brightness and colour (Horprasert, Harwood and
//!   Davis 1999), or a mixture of Gaussians (Stauffer and Grimson 1999, Zivkovic 2004;
//!   docs/papers.md#other-sources).
//! - [`Cleaner`]: morphology on packed bits, holes, and which region is the person.
//! - [`FrameQuality`], [`CameraQuality`], [`Advice`]: what can be judged without ground truth, and what to do about it.
//! - [`Segmenter`]: all of it, frame after frame.
//!
//! ```
//! use background::{Parameters, Segmenter};
//! use model::Image;
//! let frame = |left: usize| {
//!     let mut frame = Image::black(128, 96);
//!     frame.rgb_mut().fill(90);
//!     (20..80).flat_map(|y| (left..left + 20).map(move |x| (x, y))).for_each(|(x, y)| frame.set(x, y, [200, 60, 40]));
//!     frame
//! };
//! let clip: Vec<_> = (0..10).map(|time| frame(10 * time)).collect();
//! let mut segmenter = Segmenter::learn(&Parameters::default(), None, &clip)?;
//! let (person, _) = segmenter.segment(&clip[4])?;
//! assert_eq!(person.bounds(), Some([40, 20, 60, 80]));
//! assert!(segmenter.quality().advice.is_empty());
//! # Ok::<(), background::Error>(())
//! ```

mod classes;
mod cleaning;
mod components;
mod distortion;
mod error;
mod gain;
mod ghosts;
mod grey;
mod mixture;
mod morphology;
mod parameters;
mod plate;
mod quality;
mod sample;
mod segmenter;

pub use classes::Classes;
pub use cleaning::{Cleaned, Cleaner};
pub use components::{Components, Neighbours, Region};
pub use distortion::Distortion;
pub use error::Error;
pub use mixture::Mixture;
pub use morphology::Morphology;
pub use parameters::{CleaningParameters, MixtureParameters, ModelKind, Parameters};
pub use plate::Alignment;
pub use quality::{Advice, CameraQuality, FrameQuality};
pub use segmenter::{BackgroundModel, Segmenter};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
