use std::{io, path::PathBuf};

use model::counted;

/// Why frames could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The program isn't installed.
    #[error("the program {program} was not found; Debian's package ffmpeg has it (apt-get install ffmpeg)")]
    ProgramMissing {
        /// its name
        program: String,
    },
    /// The program couldn't be started or talked to.
    #[error("{program}: {source}")]
    Program {
        /// its name
        program: String,
        /// what the system says
        source: io::Error,
    },
    /// The program answered something unexpected.
    #[error("{program} gave an unexpected answer: {what}")]
    Answer {
        /// its name
        program: String,
        /// what is wrong with the answer
        what: String,
    },
    /// A file can't be opened.
    #[error("{path}: {source}")]
    File {
        /// the file
        path: PathBuf,
        /// what the system says
        source: io::Error,
    },
    /// No picture can be read from the file.
    #[error("{path} is not a video that can be read: {message}")]
    NotAVideo {
        /// the file
        path: PathBuf,
        /// what ffmpeg says
        message: String,
    },
    /// The file ends too early.
    #[error(
        "{path} is damaged or cut off: {} of {expected} could be read; ffmpeg says: {message}",
        counted(found, "frame")
    )]
    CutOff {
        /// the file
        path: PathBuf,
        /// whole frames that came
        found: u64,
        /// what was expected
        expected: String,
        /// what ffmpeg says
        message: String,
    },
    /// Frames have more pixels than the limit.
    #[error("{path} has frames of {width} x {height} pixels, expected at most {limit} pixels")]
    TooLarge {
        /// the file
        path: PathBuf,
        /// pixels in a row
        width: u32,
        /// rows
        height: u32,
        /// largest number of pixels of a frame
        limit: u64,
    },
    /// There are more frames than the limit.
    #[error("{path} has {}, expected at most {limit}", counted(found, "frame"))]
    TooLong {
        /// the file
        path: PathBuf,
        /// frames found or announced
        found: u64,
        /// largest number of frames
        limit: u64,
    },
    /// An invalid option.
    #[error("{what}")]
    Option {
        /// what was found and what was expected
        what: String,
    },
    /// A frame of another size than the others.
    #[error("frame is {found_width} x {found_height} pixels, expected {width} x {height}")]
    FrameSize {
        /// pixels in a row
        found_width: usize,
        /// rows
        found_height: usize,
        /// pixels in a row of all frames
        width: usize,
        /// rows of all frames
        height: usize,
    },
    /// The flag of the options was set.
    #[error("cancelled after {}", counted(frames, "frame"))]
    Cancelled {
        /// frames read before
        frames: u64,
    },
    /// The encoder failed.
    #[error("{path} could not be written after {}; ffmpeg says: {message}", counted(frames, "frame"))]
    Encoder {
        /// the file
        path: PathBuf,
        /// frames given before
        frames: u64,
        /// what ffmpeg says
        message: String,
    },
}
