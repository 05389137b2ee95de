use model::{counted, shown};

/// Why no silhouette can be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter out of its range.
    #[error("{name} is {}, expected {low} to {high}", shown(*found))]
    Parameter {
        /// its name
        name: &'static str,
        /// the value found
        found: f64,
        /// smallest value allowed
        low: f64,
        /// largest value allowed
        high: f64,
    },
    /// Frames are of different sizes.
    #[error(
        "frame {frame} is {found_width} x {found_height} pixels, expected {width} x {height} as the others"
    )]
    FrameSize {
        /// number of the frame, from 0, among those given
        frame: usize,
        /// pixels in a row
        found_width: usize,
        /// rows
        found_height: usize,
        /// pixels in a row of the others
        width: usize,
        /// rows of the others
        height: usize,
    },
    /// A frame that is too small or too large.
    #[error("frames are {width} x {height} pixels, expected sides of 32 to 16384")]
    Size {
        /// pixels in a row
        width: usize,
        /// rows
        height: usize,
    },
    /// Too few frames to learn from.
    #[error("found {} to learn the background from, expected at least {expected}", counted(found, "frame"))]
    Sample {
        /// frames found
        found: usize,
        /// smallest number
        expected: usize,
    },
    /// The plate model was asked for without a plate.
    #[error("the model `plate` needs a picture of the scene without the person, and none was given")]
    NoPlate,
    /// The plate shows something else.
    #[error(
        "the plate ({width} x {height} pixels) does not fit the clip: after alignment {:.0} % of the picture differs, \
         expected less than 60 %; is it of this camera, unmoved?", differing * 100.0
    )]
    PlateDiffers {
        /// pixels in a row of the plate
        width: usize,
        /// rows of the plate
        height: usize,
        /// share of pixels that differ
        differing: f64,
    },
    /// The plate has quite another shape than the frames.
    #[error(
        "the plate is {found_width} x {found_height} pixels, expected about {width} x {height} as the frames"
    )]
    PlateSize {
        /// pixels in a row of the plate
        found_width: usize,
        /// rows of the plate
        found_height: usize,
        /// pixels in a row of the frames
        width: usize,
        /// rows of the frames
        height: usize,
    },
}
