//! Points that were found again from frame to frame, in a file.
//!
//! ```text
//! "MVPTM\x01"  then, deflated:  width height first_frame num_frames   for every frame: bytes, then
//!     matches, then for every match:  frames back, before u, before v, now u, now v less those    (all LEB128)
//! ```
//!
//! Pixels are counted in 32nds from the corner of the picture; differences have their sign in the lowest bit.

use std::ops::Range;

use model::PointMatch;
use nalgebra::Vector2;

use crate::{
    Error, Result,
    packed::{Packed, Packer, put, take},
};

const MAGIC: &[u8] = b"MVPTM\x01";
/// Steps that a pixel is divided into: finer than any feature is found.
const STEPS: f64 = 32.0;
/// Most matches of a frame.
pub const MAX_MATCHES: usize = 1 << 14;
/// Farthest frame that a match may lead back to.
const MAX_BACK: u64 = 1 << 10;

/// Packs the matches of frame after frame.
#[derive(Debug, Clone)]
pub struct MatchClipWriter {
    packer: Packer,
    frame: Vec<u8>,
}

impl MatchClipWriter {
    /// Matches in pictures of `width` × `height` pixels; the first that are pushed are those of frame `first_frame` of the
    /// camera.
    pub fn new(width: usize, height: usize, first_frame: usize) -> Self {
        Self { packer: Packer::new(width, height, first_frame), frame: Vec::new() }
    }

    /// Adds the matches of the next frame with frames before it; none will do. Pixels are rounded to 32nds.
    ///
    /// # Errors
    /// [`Error::Matches`] if one lies outside the picture, leads nowhere back, or there are more than 16,384.
    pub fn push(&mut self, matches: &[PointMatch]) -> Result<()> {
        if matches.len() > MAX_MATCHES {
            let what = format!("{} matches in a frame, expected at most {MAX_MATCHES}", matches.len());
            return Err(Error::Matches(what));
        }
        self.frame.clear();
        put(&mut self.frame, matches.len());
        for found in matches {
            let PointMatch { frames_back, before, now } = *found;
            let places = self.steps(before).zip(self.steps(now));
            let is_back = (1..=MAX_BACK).contains(&u64::from(frames_back));
            let Some((before, now)) = places.filter(|_| is_back) else {
                let Packer { width, height, .. } = self.packer;
                let what = format!(
                    "match {found:?}, expected pixels of a picture of {width} x {height} and 1 to {MAX_BACK} frames back"
                );
                return Err(Error::Matches(what));
            };
            put(&mut self.frame, frames_back as usize);
            before.into_iter().for_each(|steps| put(&mut self.frame, steps as usize));
            for (now, before) in now.into_iter().zip(before) {
                let difference = now - before;
                put(&mut self.frame, (difference << 1 ^ difference >> 63) as usize);
            }
        }
        self.packer.push(&self.frame);
        Ok(())
    }

    /// A place in steps from the corner of the picture; `None` outside.
    fn steps(&self, pixel: Vector2<f64>) -> Option<[i64; 2]> {
        let size = [self.packer.width, self.packer.height].map(|side| side as f64);
        let is_inside = |axis: usize| pixel[axis] >= -0.5 && pixel[axis] <= size[axis] - 0.5;
        (is_inside(0) && is_inside(1)).then(|| [pixel.x, pixel.y].map(|x| ((x + 0.5) * STEPS).round() as i64))
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

/// Matches of consecutive frames of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchClip(Packed);

impl MatchClip {
    /// Reads what [`MatchClipWriter::finish`] gave.
    ///
    /// # Errors
    /// [`Error::Matches`] if the bytes are anything else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        Packed::from_bytes(MAGIC, bytes).map(Self).map_err(Error::Matches)
    }

    /// The frames of its camera that are in it.
    pub fn frames(&self) -> Range<usize> {
        self.0.frames()
    }

    /// Width and height of the pictures, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.0.width, self.0.height]
    }

    /// The matches of a frame, counted as its camera does, with frames before it; all lie in the picture.
    ///
    /// # Errors
    /// [`Error::Frame`] if it isn't in the clip, [`Error::Matches`] if it is damaged.
    pub fn get(&self, frame: usize) -> Result<Vec<PointMatch>> {
        let matches = unpack(self.0.get(frame)?, [self.0.width, self.0.height]);
        matches.ok_or_else(|| Error::Matches(format!("frame {frame} has matches outside the picture")))
    }
}

fn unpack(packed: &[u8], size: [usize; 2]) -> Option<Vec<PointMatch>> {
    let mut at = 0;
    let count = take(packed, &mut at).filter(|&count| count <= MAX_MATCHES as u64)?;
    let mut matches = Vec::new();
    for _ in 0..count {
        let frames_back = take(packed, &mut at).filter(|back| (1..=MAX_BACK).contains(back))?;
        let before = [take(packed, &mut at)?, take(packed, &mut at)?];
        let mut now = before;
        for now in &mut now {
            let packed = take(packed, &mut at)?;
            *now = now.checked_add_signed((packed >> 1) as i64 ^ -((packed & 1) as i64))?;
        }
        let is_inside =
            |place: [u64; 2]| place.iter().zip(size).all(|(&x, side)| x <= side as u64 * STEPS as u64);
        if !is_inside(before) || !is_inside(now) {
            return None;
        }
        let pixel = |place: [u64; 2]| Vector2::from(place.map(|x| x as f64 / STEPS - 0.5));
        matches.push(PointMatch { frames_back: frames_back as u32, before: pixel(before), now: pixel(now) });
    }
    Some(matches)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matches(count: usize, seed: f64) -> Vec<PointMatch> {
        let at = |i: usize, k: f64, side: f64| {
            let x = (i as f64 * k + seed).sin() * 0.5 + 0.5;
            // what the file keeps exactly
            (x * (side - 1.0) * 32.0).round() / 32.0
        };
        (0..count)
            .map(|i| PointMatch {
                frames_back: 1 + (i % 4) as u32,
                before: Vector2::new(at(i, 1.3, 300.0), at(i, 2.1, 200.0)),
                now: Vector2::new(at(i, 0.7, 300.0), at(i, 3.3, 200.0)),
            })
            .collect()
    }

    #[test]
    fn matches_come_back_and_others_are_rounded_to_a_64th() {
        let mut writer = MatchClipWriter::new(300, 200, 11);
        let frames = [matches(40, 0.1), Vec::new(), matches(3, 0.7)];
        frames.iter().for_each(|frame| writer.push(frame).unwrap());
        let odd =
            PointMatch { frames_back: 1, before: Vector2::new(-0.5, 199.5), now: Vector2::new(7.013, 0.0) };
        writer.push(&[odd]).unwrap();
        assert_eq!(writer.num_frames(), 4);
        let clip = MatchClip::from_bytes(&writer.finish()).unwrap();
        assert_eq!((clip.frames(), clip.size()), (11..15, [300, 200]));
        for (index, frame) in frames.iter().enumerate() {
            assert_eq!(&clip.get(11 + index).unwrap(), frame);
        }
        let found = clip.get(14).unwrap()[0];
        assert!((found.before - odd.before).norm() == 0.0 && (found.now - odd.now).amax() <= 1.0 / 64.0);
        assert!(clip.get(10).is_err() && clip.get(15).is_err());
    }

    #[test]
    fn matches_that_can_not_be_are_refused() {
        let mut writer = MatchClipWriter::new(300, 200, 0);
        let good = matches(1, 0.0)[0];
        for bad in [
            PointMatch { frames_back: 0, ..good },
            PointMatch { frames_back: u32::MAX, ..good },
            PointMatch { before: Vector2::new(300.0, 5.0), ..good },
            PointMatch { now: Vector2::new(f64::NAN, 5.0), ..good },
            PointMatch { now: Vector2::new(5.0, -0.6), ..good },
        ] {
            assert!(matches!(writer.push(&[bad]), Err(Error::Matches(_))), "{bad:?}");
        }
        assert!(writer.push(&vec![good; MAX_MATCHES + 1]).is_err());
        assert_eq!(writer.num_frames(), 0);
    }

    #[test]
    fn damaged_bytes_are_an_error_and_no_panic() {
        let mut writer = MatchClipWriter::new(300, 200, 0);
        (0..3).for_each(|seed| writer.push(&matches(25, f64::from(seed))).unwrap());
        let bytes = writer.finish();
        for end in 0..bytes.len() {
            assert!(MatchClip::from_bytes(&bytes[..end]).is_err(), "cut after {end} bytes");
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x55;
            let Ok(clip) = MatchClip::from_bytes(&changed) else { continue };
            for frame in clip.frames().take(10) {
                let inside = |p: Vector2<f64>| {
                    let [width, height] = clip.size().map(|side| side as f64);
                    p.x >= -0.5 && p.y >= -0.5 && p.x <= width && p.y <= height
                };
                let found = clip.get(frame).unwrap_or_default();
                assert!(found.iter().all(|found| inside(found.before) && inside(found.now)));
            }
        }
        // silhouettes are not matches
        assert!(MatchClip::from_bytes(&crate::ClipWriter::new(3, 3, 0).finish()).is_err());
    }
}
