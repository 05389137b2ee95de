//! Frames of videos and image sequences, streamed from and to the `ffmpeg` program (Debian package `ffmpeg`).
//!
//! One frame is in memory at a time, besides what the pipes hold. Programs are started directly, never by a shell; they
//! may open files and pipes only, no network, and only containers that hold no references to other files. A program ends
//! with the value that started it. Everything blocks: call it off the asynchronous threads.
//!
//! - [`probe`]: size, rate, number of frames and rotation of a video.
//! - [`FrameReader`]: its frames, upright, at a chosen size and rate.
//! - [`FrameWriter`]: frames into an MP4 that browsers play.
//!
//! ```no_run
//! use video::{FrameReader, ReadOptions, Source};
//! let mut reader = FrameReader::open(&Source::video("walk.mp4"), &ReadOptions::default())?;
//! let mut frame = reader.frame();
//! while reader.read(&mut frame)? {
//!     println!("{:?}", frame.pixel(0, 0));
//! }
//! # Ok::<(), video::Error>(())
//! ```

mod error;
mod probe;
mod process;
mod reader;
mod source;
mod writer;

pub use error::Error;
pub use probe::{Limits, Probe, probe};
pub use process::Programs;
pub use reader::{FrameReader, ReadOptions};
pub use source::Source;
pub use writer::{FrameWriter, WriteOptions};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
