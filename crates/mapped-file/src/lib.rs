//! Files mapped into memory, as shared bytes: open at once whatever their size, and in memory once for all processes
//! that map them.
//!
//! The only crate with `unsafe` code, and one call of it: the system cannot promise that nobody changes a mapped file,
//! and bytes that change under a shared reference are undefined behaviour. Whoever calls [`map`] promises it instead,
//! as files are written here: under another name, then renamed, and never changed after.

use std::{fs::File, io, path::Path};

use bytes::Bytes;
use memmap2::Mmap;

/// Maps a whole file, to be read. The mapping lives as long as the bytes, or any part of them, are kept; the file may be
/// deleted meanwhile, but it must not be changed or cut short by anybody.
///
/// # Errors
/// Whatever opening or mapping the file gives.
pub fn map(path: &Path) -> io::Result<Bytes> {
    let file = File::open(path)?;
    if file.metadata()?.len() == 0 {
        // The system refuses to map nothing.
        return Ok(Bytes::new());
    }
    #[expect(
        unsafe_code,
        reason = "mapping is unsafe whatever is done; the promise is the caller's, see above"
    )]
    // SAFETY: the mapping is private and read-only, and the file is not changed while it lasts, as `map` demands.
    let mapped = unsafe { Mmap::map(&file)? };
    Ok(Bytes::from_owner(mapped))
}
