//! Frames of one camera in a file, whatever they are: the part of the formats that silhouettes and matches have in common.
//!
//! ```text
//! MAGIC  then, deflated:  width height first_frame num_frames   for every frame: bytes, then what the frame is   (all LEB128)
//! ```

use std::{
    io::{Read as _, Write as _},
    ops::Range,
};

use flate2::{Compression, read::DeflateDecoder, write::DeflateEncoder};

use crate::{Error, Result};

/// Longest file once it is inflated, bytes: ten seconds of silhouettes take about one million.
const MAX_BYTES: u64 = 256 << 20;
/// Largest side of a picture, pixels.
pub const MAX_SIDE: u64 = 1 << 15;

/// Frames that are packed one after the other.
#[derive(Debug, Clone)]
pub struct Packer {
    pub width: usize,
    pub height: usize,
    first_frame: usize,
    num_frames: usize,
    frames: Vec<u8>,
}

impl Packer {
    pub fn new(width: usize, height: usize, first_frame: usize) -> Self {
        Self { width, height, first_frame, num_frames: 0, frames: Vec::new() }
    }

    pub fn push(&mut self, frame: &[u8]) {
        put(&mut self.frames, frame.len());
        self.frames.extend_from_slice(frame);
        self.num_frames += 1;
    }

    pub fn num_frames(&self) -> usize {
        self.num_frames
    }

    pub fn finish(self, magic: &[u8]) -> Vec<u8> {
        let mut head = Vec::new();
        for number in [self.width, self.height, self.first_frame, self.num_frames] {
            put(&mut head, number);
        }
        let mut encoder = DeflateEncoder::new(magic.to_vec(), Compression::default());
        // writing to memory can't fail
        let written = encoder.write_all(&head).and_then(|()| encoder.write_all(&self.frames));
        written.and_then(|()| encoder.finish()).unwrap_or_default()
    }
}

/// Frames that were read, each still packed.
#[derive(Debug, Clone, PartialEq)]
pub struct Packed {
    pub width: usize,
    pub height: usize,
    first_frame: usize,
    packed: Vec<u8>,
    /// where each frame is in `packed`
    places: Vec<Range<usize>>,
}

impl Packed {
    /// Reads what [`Packer::finish`] gave; what is wrong with other bytes.
    pub fn from_bytes(magic: &[u8], bytes: &[u8]) -> std::result::Result<Self, String> {
        let early = || "it ends early, or a number is too large".to_owned();
        let deflated = bytes.strip_prefix(magic).ok_or("other first bytes")?;
        let mut packed = Vec::new();
        let read = DeflateDecoder::new(deflated).take(MAX_BYTES).read_to_end(&mut packed);
        read.map_err(|e| e.to_string())?;
        let mut at = 0;
        let mut next = |limit: u64| {
            let number = take(&packed, &mut at).filter(|&number| number <= limit);
            number.map(|number| (number as usize, at)).ok_or_else(early)
        };
        let (width, _) = next(MAX_SIDE)?;
        let (height, _) = next(MAX_SIDE)?;
        let (first_frame, _) = next(1 << 40)?;
        let (num_frames, mut begin) = next(MAX_BYTES)?;
        let mut places = Vec::new();
        for _ in 0..num_frames {
            let mut here = begin;
            let length = take(&packed, &mut here).ok_or_else(early)?;
            let end = (here as u64).saturating_add(length);
            if end > packed.len() as u64 {
                return Err(early());
            }
            places.push(here..end as usize);
            begin = end as usize;
        }
        Ok(Self { width, height, first_frame, packed, places })
    }

    /// The frames of its camera that are in it.
    pub fn frames(&self) -> Range<usize> {
        self.first_frame..self.first_frame + self.places.len()
    }

    /// The bytes of a frame, counted as its camera does.
    pub fn get(&self, frame: usize) -> Result<&[u8]> {
        let range = self.frames();
        let place = frame.checked_sub(range.start).and_then(|index| self.places.get(index));
        let place = place.ok_or(Error::Frame { found: frame, start: range.start, end: range.end })?;
        Ok(&self.packed[place.clone()])
    }
}

/// Appends a number, seven bits a byte, low bits first.
pub fn put(to: &mut Vec<u8>, number: usize) {
    let mut left = number;
    while left >= 0x80 {
        to.push((left & 0x7f) as u8 | 0x80);
        left >>= 7;
    }
    to.push(left as u8);
}

/// Reads what [`put`] wrote; `None` at the end or beyond 63 bits.
pub fn take(from: &[u8], at: &mut usize) -> Option<u64> {
    let mut number = 0u64;
    for shift in (0..63).step_by(7) {
        let byte = *from.get(*at)?;
        *at += 1;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}
