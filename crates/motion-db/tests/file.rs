//! The index file: what was written is read, what was damaged is refused.

mod fixtures;

use fixtures::{Numbers, drawn, drawn_clips};
use motion_db::{Error, FORMAT_VERSION, MotionDatabase};
use sample_motion::Action;

fn small() -> MotionDatabase {
    MotionDatabase::build(&[drawn(Action::Walk, 0, 1, 9), drawn(Action::Run, 1, 2, 8)]).unwrap()
}

/// The bytes with a checksum that is right, so that what is behind it is looked at.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let content = bytes.len() - 32;
    let checksum = blake3::hash(&bytes[..content]);
    bytes[content..].copy_from_slice(checksum.as_bytes());
    bytes
}

/// The file with another header, padded and sealed.
fn with_header(bytes: &[u8], change: impl FnOnce(String) -> String) -> Vec<u8> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let header = change(String::from_utf8(bytes[16..16 + length].to_vec()).unwrap());
    let mut out = bytes[..12].to_vec();
    out.extend_from_slice(&(header.len() as u32).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    out.resize(out.len().next_multiple_of(64), 0);
    out.extend_from_slice(&bytes[(16 + length).next_multiple_of(64)..]);
    sealed(out)
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

#[test]
fn equal_clips_give_equal_bytes() {
    assert_eq!(small().to_bytes(), small().to_bytes());
}

#[test]
fn a_file_cut_at_any_byte_is_refused() {
    let bytes = small().to_bytes();
    for end in 0..bytes.len() {
        assert!(MotionDatabase::from_bytes(&bytes[..end]).is_err(), "cut at {end}");
    }
    let mut longer = bytes;
    longer.push(0);
    assert!(matches!(MotionDatabase::from_bytes(&longer), Err(Error::Checksum { .. })));
}

#[test]
fn a_file_with_any_byte_changed_is_refused() {
    let mut bytes = small().to_bytes();
    for at in 0..bytes.len() {
        bytes[at] ^= 1 << (at % 8);
        assert!(MotionDatabase::from_bytes(&bytes).is_err(), "byte {at}");
        bytes[at] ^= 1 << (at % 8);
    }
}

/// Whoever writes the checksum can write anything before it: it is still only an error.
#[test]
fn a_forged_file_cut_or_changed_anywhere_never_panics() {
    let bytes = small().to_bytes();
    for end in (48..bytes.len()).step_by(7) {
        assert!(MotionDatabase::from_bytes(&sealed(bytes[..end].to_vec())).is_err(), "cut at {end}");
    }
    let mut numbers = Numbers::new(1);
    let header_end = 16 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    for at in 0..header_end {
        let mut changed = bytes.clone();
        changed[at] = b"0123456789-.eE\"{}[],:nul\0\xff"[numbers.below(25)];
        if let Ok(database) = MotionDatabase::from_bytes(&sealed(changed)) {
            // What is accepted can be used.
            assert_eq!(database.num_poses(), 17);
            let _ = motion_db::WindowIndex::new(&database, 2);
        }
    }
}

#[test]
fn a_header_that_claims_too_much_takes_no_memory() {
    let bytes = small().to_bytes();
    let claims = ["18446744073709551615", "4611686018427387904", "4294967296", "1000000000", "18", "0"];
    let mut forged: Vec<Vec<u8>> = claims
        .iter()
        .map(|claim| {
            with_header(&bytes, |h| h.replacen("\"num_poses\":9", &format!("\"num_poses\":{claim}"), 1))
        })
        .collect();
    for length in [u32::MAX, bytes.len() as u32, 0] {
        let mut changed = bytes.clone();
        changed[12..16].copy_from_slice(&length.to_le_bytes());
        forged.push(sealed(changed));
    }
    forged.push(with_header(&bytes, |h| h.replacen("\"leg_length_m\":", "\"leg_length_m\":-", 1)));
    forged.push(with_header(&bytes, |h| h.replacen("\"parent\":0", "\"parent\":77", 1)));
    forged.push(with_header(&bytes, |h| h.replacen("\"clips\":[", "\"clips\":[[],", 1)));
    for (i, bytes) in forged.iter().enumerate() {
        let counted = allocation_counter::measure(|| {
            assert!(MotionDatabase::from_bytes(bytes).is_err(), "forgery {i}");
        });
        assert!(counted.bytes_max < 8 * bytes.len() as u64, "forgery {i}: {counted:?}");
    }
}

#[test]
fn a_file_of_another_version_says_what_to_do() {
    let mut bytes = small().to_bytes();
    bytes[8..12].copy_from_slice(&(FORMAT_VERSION + 1).to_le_bytes());
    let error = MotionDatabase::from_bytes(&bytes).unwrap_err();
    assert_eq!(error, Error::Version { found: FORMAT_VERSION + 1, expected: FORMAT_VERSION });
    assert!(error.to_string().ends_with("build it again from its motion files"));
}

#[test]
fn coordinates_that_are_no_numbers_are_refused() {
    let mut bytes = small().to_bytes();
    let at = bytes.len() - 32 - 4 * 62;
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let message = MotionDatabase::from_bytes(&sealed(bytes)).unwrap_err().to_string();
    assert!(message.contains("is not finite"), "{message}");
}
