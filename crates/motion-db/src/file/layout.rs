use std::ops::Range;

use model::SkeletonRecord;
use serde::{Deserialize, Serialize};

use crate::Error;

pub const MAGIC: &[u8; 8] = b"MAREYMDB";
pub const END: &[u8; 8] = b"MAREYEND";
/// bytes of the head; every section begins at a multiple
pub const HEAD: usize = 64;
/// bytes of the tail: offset, length, BLAKE3, the letters MAREYEND
pub const TAIL: usize = 8 + 8 + 32 + 8;

/// The JSON directory of the file.
#[derive(Serialize, Deserialize)]
pub struct Directory {
    pub skeleton: SkeletonRecord,
    pub reference_rotations: Vec<[[f64; 3]; 3]>,
    pub reference_angles: Vec<f64>,
    pub leg_length_m: f64,
    pub clips: Vec<ClipRecord>,
    pub windows: Option<WindowsRecord>,
    pub sections: Vec<Section>,
}

#[derive(Serialize, Deserialize)]
pub struct ClipRecord {
    pub name: String,
    pub subject: String,
    pub action: String,
    pub num_poses: usize,
}

#[derive(Serialize, Deserialize)]
pub struct WindowsRecord {
    /// length of the windows, frames
    pub frames: usize,
    pub segments: Option<SegmentsRecord>,
}

#[derive(Serialize, Deserialize)]
pub struct SegmentsRecord {
    pub count: usize,
    pub lists: usize,
    /// steps of the quantisation per degree or centimetre
    pub scale: f32,
    /// mean energy of the tails
    pub mean_energy: f32,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Section {
    pub name: String,
    pub offset: usize,
    pub bytes: usize,
    /// BLAKE3, hexadecimal
    pub blake3: String,
}

impl Section {
    pub fn range(&self) -> Range<usize> {
        self.offset..self.offset.saturating_add(self.bytes)
    }
}

/// What the tail's checksum is of.
pub fn checksum(head: &[u8], directory: &[u8], place: &[u8]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(head).update(directory).update(place);
    hasher.finalize()
}

pub fn wrong(found: impl Into<String>, offset: usize, expected: impl Into<String>) -> Error {
    Error::File { found: found.into(), offset, expected: expected.into() }
}
