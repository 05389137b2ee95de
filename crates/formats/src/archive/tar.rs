use std::io::Read;

use super::{Unpacking, budget::Budget};
use crate::{Error, Result};

/// Bytes of a header.
pub(super) const HEADER_BYTES: u64 = 512;

const FORMAT: &str = "tar";

/// Whether these bytes start with a tar header: its checksum is right.
pub(super) fn is_header(bytes: &[u8]) -> bool {
    let Some(header) = bytes.get(..HEADER_BYTES as usize) else { return false };
    let digits = header[148..156].split(|b| !matches!(b, b'0'..=b'7')).find(|d| !d.is_empty());
    let stated =
        digits.and_then(|d| std::str::from_utf8(d).ok()).and_then(|d| u32::from_str_radix(d, 8).ok());
    // the checksum itself counts as blanks
    let sum =
        header.iter().enumerate().map(|(at, b)| if (148..156).contains(&at) { 32 } else { u32::from(*b) });
    stated == Some(sum.sum()) && header[0] != 0
}

/// Regular files only: folders, links and devices are skipped. `reader` is charged to `stream`.
pub(super) fn read(reader: impl Read, stream: &Budget, unpacking: &mut Unpacking<'_>) -> Result<()> {
    let mut archive = ::tar::Archive::new(reader);
    for entry in archive.entries().map_err(|e| stream.error(FORMAT, &e))? {
        let entry = entry.map_err(|e| stream.error(FORMAT, &e))?;
        if !entry.header().entry_type().is_file() {
            continue;
        }
        let name = entry.path_bytes().into_owned();
        if !unpacking.takes_next(&name)? {
            continue;
        }
        let size = entry.size();
        let read = unpacking.read(FORMAT, &name, entry);
        let bytes = read.map_err(|e| stream.exceeded().unwrap_or(e))?;
        if (bytes.len() as u64) < size {
            let message = format!("the archive ends after {} of {size} bytes", bytes.len());
            return Err(Error::Damaged { format: FORMAT, message }.in_file(super::name::shown(&name)));
        }
        unpacking.push_member(&name, bytes)?;
    }
    Ok(())
}
