//! Files in zip, tar, tar.gz and tar.zst archives, and single files compressed with gzip or zstd.

mod budget;
mod decompress;
mod name;
mod tar;
mod zip;

use std::io::{self, Read as _};

use crate::{Error, Result};
use budget::Budget;
use decompress::Compression;

pub use name::without_compression;

/// How much an archive may unpack to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// bytes of all files together
    pub total_bytes: u64,
    /// number of files
    pub entries: usize,
    /// bytes of a file's name with its folders
    pub name_bytes: usize,
    /// unpacked bytes per packed byte, over the whole archive; 16 MiB are always allowed
    pub ratio: u64,
}

impl Default for Limits {
    /// 4 GiB in 100,000 files, names of 1,024 bytes; text of motion is packed 4 to 20 times, so 200 times is too much.
    fn default() -> Self {
        Self { total_bytes: 4 << 30, entries: 100_000, name_bytes: 1024, ratio: 200 }
    }
}

/// A file of an archive, unpacked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// name with its folders, separated by `/`, without `..`, drive letters and the endings `.zst` and `.gz`
    pub name: String,
    /// content
    pub bytes: Vec<u8>,
}

/// The files of an archive in its order; the kind of archive is told by its content. What is not an archive is one entry
/// with `name`, unpacked if it is compressed. Members compressed singly are unpacked; archives inside are not opened.
///
/// # Errors
/// If the archive or a member is damaged, or exceeds the limits, or if only the name is that of an archive.
pub fn entries(name: &str, bytes: &[u8], limits: &Limits) -> Result<Vec<Entry>> {
    entries_where(name, bytes, limits, |_| true)
}

/// What is in a file whose name says that it is compressed; `None` of one that is as it is.
///
/// # Errors
/// If it can't be unpacked, to at most `max_bytes`, or is an archive of several files.
pub fn unpacked(name: &str, bytes: &[u8], max_bytes: u64) -> Result<Option<Vec<u8>>> {
    let lower = name.to_ascii_lowercase();
    if !lower.ends_with(".zst") && !lower.ends_with(".gz") {
        return Ok(None);
    }
    let limits = Limits { total_bytes: max_bytes, entries: 1, ..Limits::default() };
    Ok(Some(entries(name, bytes, &limits)?.pop().map(|entry| entry.bytes).unwrap_or_default()))
}

/// The files of an archive whose names `is_wanted` says yes to, as [`entries`] gives them; it is asked once for each, in
/// their order, so that it can also list what there is. Others are passed over and take no memory.
///
/// # Errors
/// As [`entries`]; members that aren't wanted are counted and not looked into.
pub fn entries_where(
    name: &str,
    bytes: &[u8],
    limits: &Limits,
    mut is_wanted: impl FnMut(&str) -> bool,
) -> Result<Vec<Entry>> {
    let mut unpacking = Unpacking::new(limits, bytes.len(), &mut is_wanted);
    match Kind::detect(bytes) {
        Kind::Zip => zip::read(bytes, &mut unpacking)?,
        Kind::Tar => {
            let stream = unpacking.stream();
            tar::read(stream.limit(bytes), &stream, &mut unpacking)?;
        }
        Kind::Compressed(compression) => {
            let stream = unpacking.stream();
            let mut unpacked = stream.limit(compression.reader(bytes));
            let mut head = Vec::new();
            let read = unpacked.by_ref().take(tar::HEADER_BYTES).read_to_end(&mut head);
            read.map_err(|e| stream.error(compression.name(), &e))?;
            if tar::is_header(&head) {
                tar::read(head.as_slice().chain(unpacked.by_ref()), &stream, &mut unpacking)?;
                // checksums stand at the end, behind what tar reads
                io::copy(&mut unpacked, &mut io::sink()).map_err(|e| stream.error(compression.name(), &e))?;
                return Ok(unpacking.entries);
            }
            refuse_name_of_archive(name)?;
            if unpacking.takes_next(without_compression(name).as_bytes())? {
                unpacked.read_to_end(&mut head).map_err(|e| stream.error(compression.name(), &e))?;
                unpacking.push(without_compression(name).as_bytes(), head);
            }
        }
        Kind::Plain => {
            refuse_name_of_archive(name)?;
            if unpacking.takes_next(name.as_bytes())? {
                unpacking.push(name.as_bytes(), bytes.to_vec());
            }
        }
    }
    Ok(unpacking.entries)
}

/// Refuses what is no archive and is called one: nobody looks for what is in it by that name.
fn refuse_name_of_archive(name: &str) -> Result<()> {
    if name::is_of_archive(name) {
        return Err(Error::whole_file(
            "a file that is no archive with files in it",
            "a .zip, .tar, .tar.gz or .tar.zst archive, as its name says",
        ));
    }
    Ok(())
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Zip,
    Tar,
    Compressed(Compression),
    Plain,
}

impl Kind {
    fn detect(bytes: &[u8]) -> Self {
        if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
            return Self::Zip;
        }
        match Compression::detect(bytes) {
            Some(compression) => Self::Compressed(compression),
            None if tar::is_header(bytes) => Self::Tar,
            None => Self::Plain,
        }
    }
}

/// The entries so far, and how much more may come.
struct Unpacking<'a> {
    limits: Limits,
    budget: Budget,
    is_wanted: &'a mut dyn FnMut(&str) -> bool,
    /// members that came, wanted or not
    members: usize,
    entries: Vec<Entry>,
}

impl<'a> Unpacking<'a> {
    fn new(limits: &Limits, packed_bytes: usize, is_wanted: &'a mut dyn FnMut(&str) -> bool) -> Self {
        const FREE: u64 = 16 << 20;
        let by_ratio = (packed_bytes as u64).saturating_mul(limits.ratio).saturating_add(FREE);
        let budget = Budget::new(limits.total_bytes.min(by_ratio));
        Self { limits: *limits, budget, is_wanted, members: 0, entries: Vec::new() }
    }

    /// A budget of its own for the archive's stream, from which the members are then taken.
    fn stream(&self) -> Budget {
        Budget::new(self.budget.limit_bytes())
    }

    /// The bytes of a member.
    fn read(&self, format: &'static str, member: &[u8], reader: impl std::io::Read) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = self.budget.limit(reader).read_to_end(&mut bytes);
        read.map_err(|e| self.budget.error(format, &e).in_file(name::shown(member)))?;
        Ok(bytes)
    }

    /// Takes a member, unpacked if it is compressed singly.
    fn push_member(&mut self, member: &[u8], bytes: Vec<u8>) -> Result<()> {
        match Compression::detect(&bytes).filter(|c| c.is_named(member)) {
            None => self.push(member, bytes),
            Some(compression) => {
                let unpacked = self.read(compression.name(), member, compression.reader(&bytes))?;
                self.push(without_compression(&String::from_utf8_lossy(member)).as_bytes(), unpacked);
            }
        }
        Ok(())
    }

    fn push(&mut self, name: &[u8], bytes: Vec<u8>) {
        self.entries.push(Entry { name: name::clean(name), bytes });
    }

    /// Whether the next member is to be read. Refuses one whose name is too long, and one more than there may be.
    fn takes_next(&mut self, name: &[u8]) -> Result<bool> {
        if self.members >= self.limits.entries {
            return Err(Error::Limit { what: "files", limit: self.limits.entries as u64 });
        }
        self.members += 1;
        if name.len() > self.limits.name_bytes {
            let limit = Error::Limit { what: "bytes in a name", limit: self.limits.name_bytes as u64 };
            return Err(limit.in_file(name::shown(name)));
        }
        Ok((self.is_wanted)(&name::clean(name)))
    }
}
