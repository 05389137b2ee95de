//! From uploaded files to motion files, and from these to clips.

use bytes::Bytes;
use formats::{
    archive::{self, Entry},
    motion_files,
};
use motion_db::Clip;
use queue::JobError;

/// Unpacks a file. Members of an archive lie in a folder with its name, so that those of two archives don't mix.
///
/// # Errors
/// Gives up on what can't be unpacked into `max_bytes`, and names it.
pub(crate) fn unpack(name: &str, bytes: &Bytes, max_bytes: u64) -> Result<Vec<Entry>, JobError> {
    let limits = archive::Limits { total_bytes: max_bytes, ..archive::Limits::default() };
    let entries = archive::entries(name, bytes, &limits).map_err(|e| give_up(&format!("{name}: {e}"), &e))?;
    Ok(placed(name, entries))
}

fn placed(file: &str, mut entries: Vec<Entry>) -> Vec<Entry> {
    let is_single = entries.len() == 1 && entries.iter().all(|e| file.starts_with(&e.name));
    if !is_single {
        entries.iter_mut().for_each(|entry| entry.name.insert_str(0, &format!("{file}/")));
    }
    entries
}

/// The files of an earlier job, as one archive.
///
/// # Errors
/// Gives up on names that no archive holds.
pub(crate) fn pack(entries: &[Entry]) -> Result<Vec<u8>, JobError> {
    if entries.is_empty() {
        // An archive of nothing can't be told from zeros.
        return Ok(Vec::new());
    }
    let mut builder = tar::Builder::new(Vec::new());
    for entry in entries {
        let mut header = tar::Header::new_gnu();
        header.set_size(entry.bytes.len() as u64);
        header.set_mode(0o644);
        builder
            .append_data(&mut header, &entry.name, entry.bytes.as_slice())
            .map_err(|e| JobError::give_up(format!("{}: a file can't have this name", entry.name), e))?;
    }
    builder.into_inner().map_err(JobError::retry)
}

/// What [`pack`] packed.
///
/// # Errors
/// Tries again, as the archive was made by us.
pub(crate) fn unpack_packed(bytes: &[u8]) -> Result<Vec<Entry>, JobError> {
    if bytes.is_empty() {
        return Ok(Vec::new());
    }
    let limits =
        archive::Limits { total_bytes: u64::MAX, entries: usize::MAX, name_bytes: usize::MAX, ratio: 1 };
    archive::entries("parts.tar", bytes, &limits).map_err(JobError::retry)
}

/// Reads motion files one at a time, among the skeletons and indices that they may need.
pub(crate) struct Reader {
    entries: Vec<Entry>,
    options: motion_files::Options,
}

impl Reader {
    /// `support`: skeletons and indices.
    pub fn new(support: Vec<Entry>, bvh_metres_per_unit: f64) -> Self {
        let bvh = formats::BvhOptions { metres_per_unit: bvh_metres_per_unit };
        Self { entries: support, options: motion_files::Options { bvh, ..motion_files::Options::default() } }
    }

    /// The clip of a motion file, and what was doubtful about it.
    ///
    /// # Errors
    /// Gives up on what can't be read, with the file and the place in it.
    pub fn clip(&mut self, motion: Entry) -> Result<(Option<Clip>, Vec<String>), JobError> {
        self.entries.push(motion);
        let read = motion_files::clips(&self.entries, &self.options);
        self.entries.pop();
        let read = read.map_err(|e| give_up(&e.to_string(), &e))?;
        let clip = read.value.into_iter().next().map(|file| Clip {
            // What is made of a clip is named after it with a `~` between.
            name: file.name.replace('~', "-"),
            subject: file.subject,
            action: file.action,
            motion: file.motion,
        });
        Ok((clip, read.warnings.into_iter().map(|w| w.message).collect()))
    }
}

fn give_up(message: &str, error: &formats::Error) -> JobError {
    JobError::give_up(message, format!("{error:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, bytes: &[u8]) -> Entry {
        Entry { name: name.to_owned(), bytes: bytes.to_vec() }
    }

    #[test]
    fn members_lie_in_a_folder_with_the_name_of_their_archive() {
        let names = |file, names: &[&str]| {
            let entries = names.iter().map(|n| entry(n, b"")).collect();
            placed(file, entries).into_iter().map(|e| e.name).collect::<Vec<_>>()
        };
        assert_eq!(names("a.zip", &["16/16.asf", "x.bvh"]), ["a.zip/16/16.asf", "a.zip/x.bvh"]);
        assert_eq!(names("16.asf", &["16.asf"]), ["16.asf"]);
        assert_eq!(names("16_15.amc.zst", &["16_15.amc"]), ["16_15.amc"]);
    }

    #[test]
    fn packed_files_come_back() {
        let long = format!("{}16.asf", "long/".repeat(60));
        let files = vec![entry("a.zip/16/16.asf", b"x"), entry(&long, b""), entry("ä b.amc", b"yz")];
        assert_eq!(unpack_packed(&pack(&files).unwrap()).unwrap(), files);
        assert!(unpack_packed(&pack(&[]).unwrap()).unwrap().is_empty());
    }

    #[test]
    fn a_file_that_cannot_be_read_is_named_with_the_line() {
        let broken = entry("walk.bvh", b"HIERARCHY\nROOT hips\n{\n nonsense\n");
        let error = Reader::new(Vec::new(), 0.01).clip(broken).unwrap_err().to_string();
        assert!(error.contains("walk.bvh") && error.contains("line"), "{error}");
    }

    #[test]
    fn more_than_may_be_unpacked_is_refused() {
        let error = unpack("b.bvh.gz", &gzip(&[b' '; 100]), 10).unwrap_err().to_string();
        assert!(error.contains("b.bvh"), "{error}");
    }

    fn gzip(bytes: &[u8]) -> Bytes {
        use std::io::Write;
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap().into()
    }
}
