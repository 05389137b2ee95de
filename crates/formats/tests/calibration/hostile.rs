//! Damaged calibrations are read or refused; they do not panic.

use std::panic::catch_unwind;

use formats::calibration::{self, Options, fit_to_image};
use proptest::{prelude::*, sample::Index};

use crate::ring::{error, ring, toml};

const YAML: &str = "%YAML:1.0\n---\nsize: [ 640, 480 ]\nleft_K: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 9.0e+02, 0., \
                    320, 0., 9e2,\n       240., 0., 0., 1. ]\nleft_dist: [ 0, 0, 0, 0 ]\nleft_R: [ 3.14, 0, 0 ]\nleft_t: [ 0, 1, 3 ]\n";

const QUALISYS: &str = "<?xml version='1.0'?>\n<calibration>\n<cameras>\n<camera active=\"1\" serial=\"7\" viewrotation=\"0\">\n\
    <fov_video bottom=\"1079\" left=\"0\" right=\"1919\" top=\"0\"/>\n\
    <transform r11=\"1\" r12=\"0\" r13=\"0\" r21=\"0\" r22=\"0\" r23=\"1\" r31=\"0\" r32=\"-1\" r33=\"0\" x=\"0\" y=\"-3000\" z=\"1200\"/>\n\
    <intrinsic centerPointU=\"61440\" centerPointV=\"34560\" focalLengthU=\"90000\" focalLengthV=\"90000\" \
    radialDistortion1=\"0\" skew=\"0\"/>\n</camera>\n</cameras>\n</calibration>\n";

const WORDS: [&str; 16] = [
    "1e308", "-1", "nan", "null", "[", "]", "{", "}", "\n- ", "\n    ", ": ", "\"", "<a>", "9", "#", "\u{e9}",
];

#[test]
fn calibrations_changed_at_random_are_read_or_refused() {
    let json = calibration::write(&ring()[..2]);
    for (name, seed) in
        [("c.json", json.as_str()), ("c.toml", &toml(1.0)), ("c.yml", YAML), ("c.txt", QUALISYS)]
    {
        let bytes = seed.as_bytes();
        calibration::read(name, bytes, &Options::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
        for length in 0..bytes.len() {
            let _ = calibration::read(name, &bytes[..length], &Options::default());
        }
        let change = (any::<Index>(), 0..30_usize, proptest::sample::select(WORDS.as_slice()));
        let config = ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() };
        let mut runner = proptest::test_runner::TestRunner::new_with_rng(
            config,
            proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
        );
        let result = runner.run(&proptest::collection::vec(change, 1..4), |changes| {
            let mut bytes = bytes.to_vec();
            for (at, removed, word) in changes {
                let at = at.index(bytes.len() + 1);
                let end = (at + removed).min(bytes.len());
                bytes.splice(at..end, word.bytes());
            }
            match calibration::read(name, &bytes, &Options::default()) {
                Ok(read) => {
                    for camera in &read.value {
                        camera.check().unwrap();
                        let _ = fit_to_image(camera, [480, 640]);
                    }
                }
                Err(error) => prop_assert!(error.to_string().len() < 1500, "{error}"),
            }
            Ok(())
        });
        result.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn deep_and_expanding_files_are_refused() {
    let deep = 100_000;
    let xml = format!("{}{}", "<a>".repeat(deep), "</a>".repeat(deep));
    let list = format!("a: {}{}", "[".repeat(deep), "]".repeat(deep));
    let table = format!("a = {}{}", "[".repeat(deep), "]".repeat(deep));
    let json = format!("{{\"a\": {}{}}}", "[".repeat(deep), "]".repeat(deep));
    let laughs =
        "<!DOCTYPE a [<!ENTITY b \"c\"><!ENTITY d \"&b;&b;\">]><calibration>&d;</calibration>".to_owned();
    for (name, text) in
        [("a.txt", xml), ("a.yml", list), ("a.toml", table), ("a.json", json), ("a.txt", laughs)]
    {
        let refused = catch_unwind(|| error(name, &text));
        assert!(refused.is_ok_and(|message| message.len() < 1500), "{name}");
    }
    let large = vec![b' '; (16 << 20) + 1];
    assert!(calibration::read("a.yml", &large, &Options::default()).is_err());
    let message = calibration::read("a.yml", b"name: \xff", &Options::default()).unwrap_err().to_string();
    assert!(message.starts_with("byte 6: found "), "{message}");
}
