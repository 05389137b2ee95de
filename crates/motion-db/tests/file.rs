//! The index file: what was written is read, what was damaged is refused.

mod fixtures;

use bytes::Bytes;
use fixtures::{Numbers, drawn, drawn_clips};
use motion_db::{
    Error, FORMAT_VERSION, IndexFile, MotionDatabase, OneThread, Query, Scratch, Threads, WindowIndex,
    write_index,
};
use sample_motion::Action;

/// Bytes of the tail: offset and length of the directory, checksum, the letters.
const TAIL: usize = 56;

fn small() -> MotionDatabase {
    MotionDatabase::build(&[drawn(Action::Walk, 0, 1, 9), drawn(Action::Run, 1, 2, 8)]).unwrap()
}

/// A database large enough for the structure of the fast search.
fn large() -> MotionDatabase {
    MotionDatabase::build(&drawn_clips(400)).unwrap()
}

fn written(database: &MotionDatabase, threads: &impl Threads) -> Vec<u8> {
    let mut bytes = Vec::new();
    let count = write_index(database, Some(2), threads, &mut bytes).unwrap();
    assert_eq!(count, bytes.len() as u64);
    bytes
}

fn open(bytes: &[u8]) -> Result<IndexFile, Error> {
    IndexFile::open(Bytes::copy_from_slice(bytes))
}

fn word(bytes: &[u8], at: usize) -> usize {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

/// Start of the directory, and of the tail.
fn places(bytes: &[u8]) -> (usize, usize) {
    let tail = bytes.len() - TAIL;
    (word(bytes, tail), tail)
}

/// The file with another directory and a checksum that is right, so that what is behind it is looked at.
fn with_directory(bytes: &[u8], change: impl FnOnce(String) -> String) -> Vec<u8> {
    let (start, tail) = places(bytes);
    let directory = change(String::from_utf8(bytes[start..tail].to_vec()).unwrap());
    let mut out = bytes[..start].to_vec();
    out.extend_from_slice(directory.as_bytes());
    out.extend_from_slice(&(start as u64).to_le_bytes());
    out.extend_from_slice(&(directory.len() as u64).to_le_bytes());
    sealed(out)
}

/// Adds checksum and letters to a file that ends with the place of its directory.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let place = bytes.len() - 16;
    let start = word(&bytes, place).min(place);
    let mut hasher = blake3::Hasher::new();
    hasher.update(&bytes[..64]).update(&bytes[start..place]).update(&bytes[place..]);
    let checksum = hasher.finalize();
    bytes.extend_from_slice(checksum.as_bytes());
    bytes.extend_from_slice(b"MAREYEND");
    bytes
}

#[test]
fn a_database_comes_back_bit_for_bit() {
    for database in [small(), MotionDatabase::build(&drawn_clips(100)).unwrap()] {
        let bytes = database.to_bytes();
        let back = MotionDatabase::from_bytes(&bytes).unwrap();
        assert_eq!(back, database);
        assert_eq!(back.to_bytes(), bytes);
    }
}

/// Two threads that take pieces in turn, the second always first.
struct Backwards;

impl Threads for Backwards {
    fn for_each_piece<T: Send>(&self, data: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync) {
        let mut pieces: Vec<(usize, &mut [T])> = data.chunks_mut(size).enumerate().collect();
        let rest = pieces.split_off(pieces.len() / 2);
        std::thread::scope(|scope| {
            for half in [rest, pieces] {
                scope.spawn(|| half.into_iter().rev().for_each(|(i, piece)| work(i, piece)));
            }
        });
    }
}

#[test]
fn equal_clips_give_equal_bytes_by_any_threads() {
    assert_eq!(small().to_bytes(), small().to_bytes());
    assert_eq!(written(&large(), &OneThread), written(&large(), &Backwards));
}

#[test]
fn windows_of_a_file_find_what_those_in_memory_find() {
    let database = large();
    let index = WindowIndex::new(&database, 2).unwrap();
    let file = open(&written(&database, &OneThread)).unwrap();
    file.verify().unwrap();
    let (read, windows) = file.into_parts();
    let windows = windows.unwrap();
    assert_eq!((&read, windows.window()), (&database, 2));
    let (mut scratch, mut found, mut expected) = (Scratch::default(), Vec::new(), Vec::new());
    for row in (0..index.num_rows()).step_by(97) {
        assert_eq!(index.features(row), windows.features(row));
        let hints = [row.saturating_sub(5), row + 1];
        let features = index.features(row);
        let query = Query { features, controls: None, exclude: &[], hints: &hints };
        let way = index.nearest_fast(&query, 64, &mut scratch, &mut expected);
        assert_eq!(windows.nearest_fast(&query, 64, &mut scratch, &mut found), way);
        assert_eq!(found, expected);
        index.nearest(&query, 64, &mut scratch, &mut expected);
        windows.nearest(&query, 64, &mut scratch, &mut found);
        assert_eq!(found, expected);
    }
}

#[test]
fn a_file_that_was_cut_is_refused() {
    let bytes = written(&small(), &OneThread);
    for end in (0..bytes.len()).rev().step_by(3) {
        assert!(open(&bytes[..end]).is_err(), "cut at {end}");
    }
    let mut longer = bytes;
    longer.push(0);
    assert!(open(&longer).is_err());
}

#[test]
fn a_file_with_any_byte_changed_is_refused() {
    let bytes = written(&small(), &OneThread);
    let (start, _) = places(&bytes);
    let mut changed = bytes.clone();
    for at in 0..bytes.len() {
        // Every byte of head, directory and tail; of the sections, which are long, those beside their ends and others.
        let beside_ends = at % 64 < 2 || at % 64 == 63;
        if (64..start).contains(&at) && !beside_ends && at % 41 != 0 {
            continue;
        }
        changed[at] ^= 1 << (at % 8);
        let file = open(&changed);
        if at < 64 || at >= start {
            assert!(file.is_err(), "byte {at} when opened");
        } else {
            // Opening does not read the sections.
            assert!(file.unwrap().verify().is_err(), "byte {at} when verified");
        }
        changed[at] = bytes[at];
    }
}

/// What was damaged and not verified is searched to no good end, but to an end.
#[test]
fn a_damaged_file_that_was_not_verified_never_panics() {
    let database = large();
    let bytes = written(&database, &OneThread);
    let (start, _) = places(&bytes);
    let mut numbers = Numbers::new(5);
    let query = vec![3.0f32; 124];
    for _ in 0..20 {
        let mut changed = bytes.clone();
        for _ in 0..20_000 {
            let at = 64 + numbers.below(start - 64);
            changed[at] = numbers.below(256) as u8;
        }
        let Ok(file) = open(&changed) else { continue };
        assert!(file.verify().is_err());
        let (database, windows) = file.into_parts();
        let windows = windows.unwrap();
        let (mut scratch, mut found) = (Scratch::default(), Vec::new());
        for hints in [&[][..], &[1, 100, 2_000]] {
            let query = Query { features: &query, controls: None, exclude: &[], hints };
            windows.nearest_fast(&query, 64, &mut scratch, &mut found);
            windows.nearest(&query, 64, &mut scratch, &mut found);
            assert!(found.iter().all(|n| n.row < windows.num_rows()));
        }
        assert_eq!(database.num_poses(), 4_800);
    }
}

/// Whoever writes the checksum can write anything before it: it is still only an error.
#[test]
fn a_forged_directory_never_panics() {
    let bytes = written(&small(), &OneThread);
    let (start, tail) = places(&bytes);
    let mut numbers = Numbers::new(1);
    for at in (0..tail - start).step_by(5) {
        let forged = with_directory(&bytes, |directory| {
            let mut directory = directory.into_bytes();
            directory[at] = b"0123456789-.eE\"{}[],:nul "[numbers.below(25)];
            String::from_utf8_lossy(&directory).into_owned()
        });
        if let Ok(file) = open(&forged) {
            // What is accepted can be used.
            let _ = file.verify();
            assert_eq!(file.database().num_poses(), 17);
            let _ = WindowIndex::new(file.database(), 2);
        }
    }
}

#[test]
fn a_directory_that_claims_too_much_takes_no_memory() {
    let bytes = written(&small(), &OneThread);
    let claims = ["18446744073709551615", "4611686018427387904", "4294967296", "1000000000", "18", "0"];
    let mut forged: Vec<Vec<u8>> = Vec::new();
    for claim in claims {
        for name in ["\"num_poses\":9", "\"offset\":64", "\"frames\":2"] {
            let field = name.split(':').next().unwrap();
            forged.push(with_directory(&bytes, |d| d.replacen(name, &format!("{field}:{claim}"), 1)));
        }
    }
    for (at, value) in [(0, u64::MAX), (0, 0), (8, u64::MAX), (8, bytes.len() as u64), (8, 0)] {
        let mut changed = bytes[..bytes.len() - 40].to_vec();
        let place = changed.len() - 16 + at;
        changed[place..place + 8].copy_from_slice(&value.to_le_bytes());
        forged.push(sealed(changed));
    }
    forged.push(with_directory(&bytes, |h| h.replacen("\"leg_length_m\":", "\"leg_length_m\":-", 1)));
    forged.push(with_directory(&bytes, |h| h.replacen("\"parent\":0", "\"parent\":77", 1)));
    forged.push(with_directory(&bytes, |h| h.replacen("\"clips\":[", "\"clips\":[[],", 1)));
    forged.push(with_directory(&bytes, |h| h.replacen("\"name\":\"poses\"", "\"name\":\"posts\"", 1)));
    for (i, bytes) in forged.into_iter().enumerate() {
        let size = bytes.len() as u64;
        let bytes = Bytes::from(bytes);
        let counted = allocation_counter::measure(|| {
            assert!(IndexFile::open(bytes).is_err(), "forgery {i}");
        });
        assert!(counted.bytes_max < 8 * size, "forgery {i}: {counted:?}");
    }
}

#[test]
fn a_file_of_another_version_says_what_to_do() {
    let mut bytes = small().to_bytes();
    for version in [1, FORMAT_VERSION + 1] {
        bytes[8..12].copy_from_slice(&version.to_le_bytes());
        let error = MotionDatabase::from_bytes(&bytes).unwrap_err();
        assert_eq!(error, Error::Version { found: version, expected: FORMAT_VERSION });
        assert!(error.to_string().ends_with("build it again from its motion files"));
    }
}

#[test]
fn coordinates_that_are_no_numbers_are_refused() {
    let mut bytes = small().to_bytes();
    // The first section holds the poses.
    let poses = 64..64 + 17 * 62 * 4;
    let before = blake3::hash(&bytes[poses.clone()]).to_hex().to_string();
    bytes[64 + 4 * 62..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let after = blake3::hash(&bytes[poses]).to_hex().to_string();
    let forged = with_directory(&bytes, |directory| directory.replace(&before, &after));
    let message = MotionDatabase::from_bytes(&forged).unwrap_err().to_string();
    assert!(message.contains("is not finite"), "{message}");
}

/// A sink that takes a limited number of bytes.
struct Full(usize);

impl std::io::Write for Full {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 = self.0.checked_sub(bytes.len()).ok_or_else(|| std::io::Error::other("no space left"))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_sink_that_is_full_is_reported() {
    for space in [0, 100, 5_000, 20_000] {
        let error = write_index(&small(), Some(2), &OneThread, &mut Full(space)).unwrap_err();
        assert_eq!(error.to_string(), "motion database cannot be written: no space left");
    }
}

#[test]
fn writing_takes_little_memory_beside_the_database() {
    let database = large();
    let counted = allocation_counter::measure(|| {
        write_index(&database, Some(2), &OneThread, &mut std::io::sink()).unwrap();
    });
    let features = database.num_poses() * 124 * 4;
    let bound = 8_192 * 124 * 4 + 20_000 * 124 * 8 + features as u64;
    assert!(counted.bytes_max < bound, "{counted:?}, bound {bound}");
}
