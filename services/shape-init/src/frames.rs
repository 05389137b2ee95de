//! The frames of one camera, one after the other, from a video or from pictures.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
};

use formats::{archive::Entry, image_files};
use model::Image;
use service::FileError;
use video::{FrameReader, ReadOptions};

use crate::InputError;

/// Where frames come from.
pub(crate) enum Frames {
    /// a file, and what the user calls it
    Video { path: PathBuf, name: String, largest_side: u32 },
    /// one file a frame, and what the user calls where they are from
    Pictures { entries: Vec<Entry>, name: String },
}

/// Size and number of frames, as far as a file tells before it is read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Announced {
    /// width and height as frames will come, pixels
    pub size: [u32; 2],
    /// how many
    pub count: Option<usize>,
    /// frames a second
    pub rate: Option<f64>,
}

/// Frames being read.
pub(crate) enum Stream<'a> {
    Video { reader: Box<FrameReader>, name: &'a str, folder: Option<&'a Path> },
    Pictures { entries: std::slice::Iter<'a, Entry>, name: &'a str },
}

impl Frames {
    /// What the file says of itself.
    ///
    /// # Errors
    /// If nothing can be read of it.
    pub fn announced(&self) -> Result<Announced, InputError> {
        match self {
            Self::Video { path, largest_side, .. } => {
                let options = ReadOptions::default();
                let probe = video::probe(path, &options.programs, &options.limits)
                    .map_err(|e| self.video_error(&e))?;
                let count = probe.num_frames.and_then(|count| usize::try_from(count).ok());
                Ok(Announced { size: scaled(probe.size, *largest_side), count, rate: Some(probe.rate) })
            }
            Self::Pictures { entries, name } => {
                let first =
                    entries.first().ok_or_else(|| FileError::unexpected(name, "no pictures", "some"))?;
                let size = image_files::size(&first.bytes, &image_files::Limits::default());
                let size = size.map_err(FileError::in_file(&format!("{name}: {}", first.name)))?;
                Ok(Announced { size, count: Some(entries.len()), rate: None })
            }
        }
    }

    /// Begins to read, every so-manieth frame, in the size announced.
    ///
    /// # Errors
    /// If nothing can be read.
    pub fn open(&self, every: usize, cancelled: &Arc<AtomicBool>) -> Result<Stream<'_>, InputError> {
        match self {
            Self::Video { path, name, .. } => {
                let options = ReadOptions {
                    size: Some(self.announced()?.size),
                    every: u32::try_from(every).unwrap_or(u32::MAX),
                    cancelled: Some(cancelled.clone()),
                    ..ReadOptions::default()
                };
                let source = video::Source::video(path);
                let reader = FrameReader::open(&source, &options).map_err(|e| self.video_error(&e))?;
                Ok(Stream::Video { reader: Box::new(reader), name, folder: path.parent() })
            }
            Self::Pictures { entries, name } => Ok(Stream::Pictures { entries: entries.iter(), name }),
        }
    }

    fn video_error(&self, error: &video::Error) -> InputError {
        match self {
            Self::Video { path, name, .. } => video_error(name, path.parent(), error),
            Self::Pictures { name, .. } => video_error(name, None, error),
        }
    }
}

impl Stream<'_> {
    /// The next frame, in `frame`; false at the end.
    ///
    /// # Errors
    /// If it can't be read.
    pub fn next(&mut self, frame: &mut Image) -> Result<bool, InputError> {
        match self {
            Self::Video { reader, name, folder } => {
                let [width, height] = reader.size().map(|side| side as usize);
                if (frame.width(), frame.height()) != (width, height) {
                    *frame = reader.frame();
                }
                reader.read(frame).map_err(|e| video_error(name, *folder, &e))
            }
            Self::Pictures { entries, name } => {
                let Some(entry) = entries.next() else { return Ok(false) };
                let read = image_files::read_image(&entry.bytes, &image_files::Limits::default());
                *frame = read.map_err(FileError::in_file(&format!("{name}: {}", entry.name)))?;
                Ok(true)
            }
        }
    }

    /// Passes over frames.
    ///
    /// # Errors
    /// As [`next`](Self::next).
    pub fn skip(&mut self, count: usize) -> Result<(), InputError> {
        match self {
            Self::Video { .. } => {
                let mut frame = Image::black(0, 0);
                for _ in 0..count {
                    if !self.next(&mut frame)? {
                        break;
                    }
                }
                Ok(())
            }
            Self::Pictures { entries, .. } => {
                entries.by_ref().take(count).for_each(drop);
                Ok(())
            }
        }
    }
}

/// A message for the user, who knows nothing of our folders.
fn video_error(name: &str, folder: Option<&Path>, error: &video::Error) -> InputError {
    let mut message = error.to_string();
    if let Some(folder) = folder {
        message = message.replace(&format!("{}/", folder.display()), "");
    }
    if !message.contains(name) {
        message = format!("{name}: {message}");
    }
    InputError::Video { message }
}

/// The size, made smaller if a side has more pixels than `largest`.
fn scaled(size: [u32; 2], largest: u32) -> [u32; 2] {
    let side = size[0].max(size[1]);
    if side <= largest {
        return size;
    }
    // sides are at least 1
    size.map(|s| ((f64::from(s) * f64::from(largest) / f64::from(side)).round() as u32).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_are_too_large_keep_their_shape() {
        assert_eq!(scaled([1920, 1080], 2048), [1920, 1080]);
        assert_eq!(scaled([3840, 2160], 2048), [2048, 1152]);
    }
}
