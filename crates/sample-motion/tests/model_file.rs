//! The model's file: read back as written, and hostile bytes refused or harmless.

use proptest::prelude::*;
use sample_motion::{Action, DrawOptions, Error, Model};

const BYTES: &[u8] = include_bytes!("../data/cmu.motion-model");

/// Bytes with a checksum that fits them again.
fn resealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let content = bytes.len() - 32;
    let checksum = blake3::hash(&bytes[..content]);
    bytes[content..].copy_from_slice(checksum.as_bytes());
    bytes
}

#[test]
fn a_model_read_back_draws_the_same() {
    let model = Model::bundled();
    let again = Model::from_bytes(&model.to_bytes()).unwrap();
    assert_eq!(&again, model);
    for action in Action::ALL {
        let options = DrawOptions { frames: 90, subject: 2 };
        assert_eq!(again.draw(action, 5, &options), model.draw(action, 5, &options));
    }
}

#[test]
fn the_header_says_where_it_comes_from() {
    let header = String::from_utf8_lossy(&BYTES[..2000]);
    assert!(header.contains("mocap.cs.cmu.edu") && header.contains("EIA-0196217"), "{header}");
    assert!(header.contains("synthetic"), "{header}");
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    for length in (0..64).chain((64..BYTES.len()).step_by(997)) {
        assert!(matches!(Model::from_bytes(&BYTES[..length]), Err(Error::BadFile { .. })), "{length} bytes");
    }
}

#[test]
fn a_file_of_another_version_says_so() {
    let mut bytes = BYTES.to_vec();
    bytes[8] = 200;
    assert_eq!(Model::from_bytes(&bytes), Err(Error::Version { found: 200, expected: 1 }));
}

#[test]
fn a_file_of_absurd_size_is_refused_unread() {
    assert!(Model::from_bytes(&vec![0; sample_motion::MAX_BYTES + 1]).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_damaged_byte_is_found(at in 12..BYTES.len(), bit in 0u8..8) {
        let mut bytes = BYTES.to_vec();
        bytes[at] ^= 1 << bit;
        prop_assert!(Model::from_bytes(&bytes).is_err());
    }

    #[test]
    fn damage_under_a_fitting_checksum_does_no_harm(
        edits in prop::collection::vec((16..BYTES.len() - 32, any::<u8>()), 1..4),
        in_header in any::<bool>(),
    ) {
        let mut bytes = BYTES.to_vec();
        for (at, value) in edits {
            let at = if in_header { 16 + at % 14_000 } else { at };
            // Digits for digits: otherwise nearly all edits end as broken JSON.
            bytes[at] = if in_header && bytes[at].is_ascii_digit() { b'0' + value % 10 } else { value };
        }
        if let Ok(model) = Model::from_bytes(&resealed(bytes)) {
            for action in Action::ALL {
                if let Ok(motion) = model.draw(action, 1, &DrawOptions { frames: 40, subject: 1 }) {
                    prop_assert_eq!(motion.num_frames(), 40);
                }
            }
        }
    }
}
