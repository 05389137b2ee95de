//! From uploaded files to clips.

use bytes::Bytes;
use formats::{
    archive::{self, Entry},
    motion_files,
};
use motion_db::Clip;
use queue::JobError;

/// How much may be unpacked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Bytes of all files together.
    pub unpacked_bytes: u64,
}

/// What was read.
#[derive(Debug)]
pub(crate) struct Clips {
    /// The motions, in the order of their paths.
    pub clips: Vec<Clip>,
    /// What was sloppy, each with the file's name.
    pub warnings: Vec<String>,
}

/// Unpacks and reads files: archives, ASF with AMC, BVH. `is_cancelled` is asked between files.
///
/// # Errors
/// Gives up on what can't be read, with the file and the place in it.
pub(crate) fn clips(
    files: Vec<(String, Bytes)>,
    limits: Limits,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<Clips, JobError> {
    let mut entries = Vec::new();
    let mut left = limits.unpacked_bytes;
    for (name, bytes) in files {
        if is_cancelled() {
            return Err(JobError::Stopped);
        }
        let allowed = archive::Limits { total_bytes: left, ..archive::Limits::default() };
        let unpacked =
            archive::entries(&name, &bytes, &allowed).map_err(|e| give_up(&format!("{name}: {e}"), &e))?;
        left = left.saturating_sub(unpacked.iter().map(|e| e.bytes.len() as u64).sum());
        entries.extend(placed(&name, unpacked));
    }
    let options = motion_files::Options::default();
    let read = motion_files::clips(&entries, &options).map_err(|e| give_up(&e.to_string(), &e))?;
    let clip = |file: motion_files::MotionFile| Clip {
        name: file.name,
        subject: file.subject,
        action: file.action,
        motion: file.motion,
    };
    Ok(Clips {
        clips: read.value.into_iter().map(clip).collect(),
        warnings: read.warnings.into_iter().map(|w| w.message).collect(),
    })
}

/// Members of an archive lie in a folder with its name, so that those of two archives don't mix.
fn placed(file: &str, entries: Vec<Entry>) -> impl Iterator<Item = Entry> {
    let is_single = entries.len() == 1 && entries.iter().all(|e| file.starts_with(&e.name));
    let folder = if is_single { String::new() } else { format!("{file}/") };
    entries.into_iter().map(move |e| Entry { name: format!("{folder}{}", e.name), bytes: e.bytes })
}

fn give_up(message: &str, error: &formats::Error) -> JobError {
    JobError::give_up(message, format!("{error:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_lie_in_a_folder_with_the_name_of_their_archive() {
        let entry = |name: &str| Entry { name: name.to_owned(), bytes: Vec::new() };
        let names = |file, names: &[&str]| {
            let entries = names.iter().map(|n| entry(n)).collect();
            placed(file, entries).map(|e| e.name).collect::<Vec<_>>()
        };
        assert_eq!(names("a.zip", &["16/16.asf", "x.bvh"]), ["a.zip/16/16.asf", "a.zip/x.bvh"]);
        assert_eq!(names("16.asf", &["16.asf"]), ["16.asf"]);
        assert_eq!(names("16_15.amc.zst", &["16_15.amc"]), ["16_15.amc"]);
    }

    #[test]
    fn a_file_that_cannot_be_read_is_named_with_the_line() {
        let limits = Limits { unpacked_bytes: 1 << 20 };
        let files =
            vec![("walk.bvh".to_owned(), Bytes::from_static(b"HIERARCHY\nROOT hips\n{\n nonsense\n"))];
        let error = clips(files, limits, &|| false).unwrap_err().to_string();
        assert!(error.contains("walk.bvh") && error.contains("line"), "{error}");
    }

    #[test]
    fn more_than_may_be_unpacked_is_refused() {
        let limits = Limits { unpacked_bytes: 10 };
        let packed = [
            ("a.bvh".to_owned(), Bytes::from_static(b"HIERARCHY")),
            ("b.bvh.gz".to_owned(), gzip(&[b' '; 100])),
        ];
        let error = clips(packed.to_vec(), limits, &|| false).unwrap_err().to_string();
        assert!(error.contains("b.bvh"), "{error}");
    }

    fn gzip(bytes: &[u8]) -> Bytes {
        use std::io::Write;
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap().into()
    }
}
