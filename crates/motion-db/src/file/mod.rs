//! The index file, version 2. Little-endian; see docs/motion-database.md.
//!
//! ```text
//! head       64 bytes: "MAREYMDB", u32 version, zeros
//! sections   each begins at a multiple of 64, zeros between: poses, proportions, zero poses; and for the windows of one length
//!            features, mean, axes, prefix, and what the fast search goes by
//! directory  JSON: skeleton, references, leg length, clips, and name, place, length and BLAKE3 of every section
//! tail       u64 offset and u64 length of the directory, BLAKE3 of head, directory and these two, "MAREYEND"
//! ```
//!
//! Sections are written one after the other, so a writer needs no seeking and little memory, and are used where they
//! lie, so a mapped file is open at once. Opening checks head, directory and tail, and that every section is as long as
//! it must be; [`IndexFile::verify`] checks the sections.

mod layout;
mod read;
mod verify;
mod write;

use bytes::Bytes;

use crate::{MotionDatabase, OneThread, Result, WindowIndex};
use layout::Section;
pub use write::write_index;

/// Version of the index file. A change of layout or meaning raises it.
pub const FORMAT_VERSION: u32 = 2;

/// An index file that was opened.
#[derive(Debug, Clone)]
pub struct IndexFile {
    bytes: Bytes,
    sections: Vec<Section>,
    database: MotionDatabase,
    windows: Option<WindowIndex>,
}

impl IndexFile {
    /// Opens the bytes of an index file, mapped or read: they are used where they are. Takes milliseconds, whatever the
    /// size. What lies in the sections is not looked at: [`Self::verify`] once, when the file was fetched. Damaged
    /// sections that were not verified give wrong answers; they do not panic.
    ///
    /// # Errors
    /// If the bytes are not an index file, are of another version, or contradict themselves, or its directory was damaged.
    pub fn open(bytes: Bytes) -> Result<Self> {
        read::open(bytes)
    }

    /// Compares every section with its checksum and looks at all numbers: reads the whole file.
    ///
    /// # Errors
    /// If a section was damaged or holds what no builder writes.
    pub fn verify(&self) -> Result<()> {
        verify::verify(self)
    }

    /// The database.
    pub fn database(&self) -> &MotionDatabase {
        &self.database
    }

    /// Its windows, if they were written with it.
    pub fn windows(&self) -> Option<&WindowIndex> {
        self.windows.as_ref()
    }

    /// The database and its windows, if they were written with it. They share the file's bytes.
    pub fn into_parts(self) -> (MotionDatabase, Option<WindowIndex>) {
        (self.database, self.windows)
    }

    /// Size of the file, bytes.
    pub fn num_bytes(&self) -> usize {
        self.bytes.len()
    }
}

impl MotionDatabase {
    /// The index file of the database without windows, see [`write_index`]. Equal databases give equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        // Only a directory past all bounds or a sink that is full fails; a vector is none.
        if write_index(self, None, &OneThread, &mut bytes).is_err() {
            bytes.clear();
        }
        bytes
    }

    /// Reads an index file; the whole of it is checked before anything is used.
    ///
    /// # Errors
    /// If the bytes are not an index file, are of another version, were damaged, or contradict themselves.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let file = IndexFile::open(Bytes::copy_from_slice(bytes))?;
        file.verify()?;
        Ok(file.database)
    }
}
