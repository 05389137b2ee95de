//! Silhouettes of consecutive frames in a file: runs of pixels row by row, deflated.
//!
//! ```text
//! "MVSIL\x01"  then, deflated:  width height first_frame num_frames   for every frame: bytes, then
//!     top height   for every row: runs, then for every run: pixels skipped, pixels of the person      (all LEB128)
//! ```

use std::ops::Range;

use model::Silhouette;

use crate::{
    Error, Result,
    packed::{Packed, Packer, put, take},
};

const MAGIC: &[u8] = b"MVSIL\x01";

/// Packs silhouettes one after the other.
#[derive(Debug, Clone)]
pub struct ClipWriter {
    packer: Packer,
    row: Vec<u8>,
    frame: Vec<u8>,
}

impl ClipWriter {
    /// A clip of pictures of `width` × `height` pixels that begins with frame `first_frame` of its camera.
    pub fn new(width: usize, height: usize, first_frame: usize) -> Self {
        Self { packer: Packer::new(width, height, first_frame), row: Vec::new(), frame: Vec::new() }
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`Error::Clip`] if it is of another size.
    pub fn push(&mut self, silhouette: &Silhouette) -> Result<()> {
        let Packer { width, height, .. } = self.packer;
        if (silhouette.width(), silhouette.height()) != (width, height) {
            return Err(Error::Clip(format!(
                "frame of {} x {} pixels, expected {width} x {height}",
                silhouette.width(),
                silhouette.height(),
            )));
        }
        self.frame.clear();
        let [_, top, _, bottom] = silhouette.bounds().unwrap_or_default();
        put(&mut self.frame, top);
        put(&mut self.frame, bottom - top);
        for y in top..bottom {
            self.row.clear();
            let (mut runs, mut end) = (0, 0);
            while let Some((start, next)) = next_run(silhouette.row(y), end, width) {
                put(&mut self.row, start - end);
                put(&mut self.row, next - start);
                runs += 1;
                end = next;
            }
            put(&mut self.frame, runs);
            self.frame.extend_from_slice(&self.row);
        }
        self.packer.push(&self.frame);
        Ok(())
    }

    /// Frames so far.
    pub fn num_frames(&self) -> usize {
        self.packer.num_frames()
    }

    /// The file.
    pub fn finish(self) -> Vec<u8> {
        self.packer.finish(MAGIC)
    }
}

/// Silhouettes of consecutive frames of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct SilhouetteClip(Packed);

impl SilhouetteClip {
    /// Reads what [`ClipWriter::finish`] gave.
    ///
    /// # Errors
    /// [`Error::Clip`] if the bytes are anything else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        Packed::from_bytes(MAGIC, bytes).map(Self).map_err(Error::Clip)
    }

    /// The frames of its camera that are in it.
    pub fn frames(&self) -> Range<usize> {
        self.0.frames()
    }

    /// Width and height of the frames, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.0.width, self.0.height]
    }

    /// The silhouette of a frame, counted as its camera does.
    ///
    /// # Errors
    /// [`Error::Frame`] if it isn't in the clip, [`Error::Clip`] if it is damaged.
    pub fn get(&self, frame: usize) -> Result<Silhouette> {
        let runs = self.0.get(frame)?;
        let mut silhouette = Silhouette::empty(self.0.width, self.0.height);
        unpack(runs, &mut silhouette)
            .ok_or_else(|| Error::Clip(format!("frame {frame} has runs outside the picture")))?;
        Ok(silhouette)
    }
}

/// Draws the runs of a frame; `None` if they leave the picture.
fn unpack(runs: &[u8], silhouette: &mut Silhouette) -> Option<()> {
    let (width, height) = (silhouette.width() as u64, silhouette.height() as u64);
    let mut at = 0;
    let top = take(runs, &mut at)?;
    let rows = take(runs, &mut at)?;
    if top.checked_add(rows)? > height {
        return None;
    }
    for y in top..top + rows {
        let mut x = 0u64;
        for _ in 0..take(runs, &mut at)? {
            let start = x.checked_add(take(runs, &mut at)?)?;
            x = start.checked_add(take(runs, &mut at)?)?;
            if x > width {
                return None;
            }
            fill(silhouette.row_mut(y as usize), start as usize, x as usize);
        }
    }
    Some(())
}

/// The next stretch of set bits from bit `from` on, as start and end.
fn next_run(words: &[u64], from: usize, width: usize) -> Option<(usize, usize)> {
    let start = next_bit(words, from, width, 0)?;
    Some((start, next_bit(words, start, width, u64::MAX).unwrap_or(width)))
}

/// The first bit from `from` on that differs from those of `flip`: set for 0, clear for all ones.
fn next_bit(words: &[u64], from: usize, width: usize, flip: u64) -> Option<usize> {
    let mut mask = u64::MAX << (from % 64);
    for (index, word) in words.iter().enumerate().skip(from / 64) {
        let found = (word ^ flip) & mask;
        if found != 0 {
            let bit = 64 * index + found.trailing_zeros() as usize;
            return (bit < width).then_some(bit);
        }
        mask = u64::MAX;
    }
    None
}

/// Sets bits `start` to `end` of a row.
fn fill(words: &mut [u64], start: usize, end: usize) {
    let mut at = start;
    while at < end {
        let last = end.min(64 * (at / 64 + 1));
        let ones = u64::MAX >> (64 - (last - at));
        words[at / 64] |= ones << (at % 64);
        at = last;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drawn by a rule that gives long runs, short ones, full and empty rows.
    fn frame(width: usize, height: usize, seed: usize) -> Silhouette {
        let mut silhouette = Silhouette::empty(width, height);
        for y in 0..height {
            for x in 0..width {
                let is_person = match (y + seed) % 4 {
                    0 => true,
                    1 => (x / (3 + seed)).is_multiple_of(2),
                    2 => x % 64 == 63 || x % 64 == 0,
                    _ => false,
                };
                silhouette.set(x, y, is_person);
            }
        }
        silhouette
    }

    #[test]
    fn silhouettes_come_back_whatever_they_are() {
        for (width, height) in [(1, 1), (64, 5), (130, 40), (1004, 9)] {
            let mut writer = ClipWriter::new(width, height, 7);
            let frames: Vec<_> = (0..5).map(|seed| frame(width, height, seed)).collect();
            frames.iter().for_each(|frame| writer.push(frame).unwrap());
            writer.push(&Silhouette::empty(width, height)).unwrap();
            let clip = SilhouetteClip::from_bytes(&writer.finish()).unwrap();
            assert_eq!(clip.frames(), 7..13);
            for (index, frame) in frames.iter().enumerate() {
                assert_eq!(&clip.get(7 + index).unwrap(), frame, "{width} x {height}");
            }
            assert_eq!(clip.get(12).unwrap().area(), 0);
            assert!(clip.get(6).is_err() && clip.get(13).is_err());
        }
    }

    #[test]
    fn damaged_bytes_are_an_error_and_no_panic() {
        let mut writer = ClipWriter::new(100, 100, 0);
        (0..3).for_each(|seed| writer.push(&frame(100, 100, seed)).unwrap());
        let bytes = writer.finish();
        for end in 0..bytes.len() {
            assert!(SilhouetteClip::from_bytes(&bytes[..end]).is_err(), "cut after {end} bytes");
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x55;
            if let Ok(clip) = SilhouetteClip::from_bytes(&changed) {
                // it may be another clip, but reading it must end
                clip.frames().take(10).for_each(|frame| drop(clip.get(frame)));
            }
        }
    }

    #[test]
    fn a_frame_of_another_size_is_refused() {
        let mut writer = ClipWriter::new(100, 100, 0);
        assert!(writer.push(&Silhouette::empty(100, 99)).is_err());
    }
}
