//! Damaged real files: cut at every byte, and changed at random. Readers give a value or an error that says where;
//! they do not panic, and what they give is not larger than the file.

use formats::{
    BvhOptions, Error, Place, PointsOptions, Result, amc, archive, asf, bvh, c3d, motion_files, points_csv,
    trc,
};
use model::{Motion, PointTrajectories};
use proptest::{prelude::*, sample::Index, test_runner::TestRunner};

/// Reads a file and gives the number of values in it.
type Reader = dyn Fn(&[u8]) -> Result<usize>;

/// A short piece of a recorded file, and what reads it.
struct Seed {
    name: &'static str,
    bytes: Vec<u8>,
    read: Box<Reader>,
}

fn size_of_motion(motion: &Motion) -> usize {
    assert!(motion.values().iter().all(|v| v.is_finite()));
    motion.values().len()
}

fn size_of_points(points: &PointTrajectories) -> usize {
    points.num_frames() * points.num_points()
}

/// Up to and without the `lines`-th line.
fn first_lines(bytes: &[u8], lines: usize) -> Vec<u8> {
    bytes.split_inclusive(|b| *b == b'\n').take(lines).flatten().copied().collect()
}

/// Pieces of recorded files of every format, or nothing where there are none.
fn seeds(test: &str) -> Option<Vec<Seed>> {
    let motion = testkit::shared::find("data/motion/five-actions", test)?;
    let markers = testkit::shared::find("data/markers", test)?;
    let skeleton = testkit::shared::read(&motion, "16.asf");
    let acclaim = asf::read(&skeleton).unwrap().value;
    // three lines of header and 30 a frame
    let frames = first_lines(&testkit::shared::read(&motion, "16_15.amc"), 3 + 3 * 30);
    let three = amc::read(&frames, &acclaim, 120.0).unwrap().value;
    let written = bvh::write(&three).into_bytes();
    let rows = first_lines(&testkit::shared::read(&markers, "opensim_walk_free_01.trc"), 10);
    let points = trc::read(&rows, &PointsOptions::default()).unwrap().value;
    let trust = "frame,time,a_x,a_y,a_z,a_sigma,a_confidence\n0,0,1,2,3,0.01,0.5\n1,0.1,1,2,3,,1e-3\n";
    // cut behind two frames of 44 points and 96 analog values, and the header says so
    let mut binary = testkit::shared::read(&markers, "opensim_walking2.c3d");
    binary.truncate(13 * 512 + 2 * 4 * (4 * 44 + 96));
    binary[8] = 2;
    binary[9] = 0;

    let options = PointsOptions::default();
    Some(vec![
        Seed {
            name: "asf",
            bytes: skeleton,
            read: Box::new(|b| Ok(asf::read(b)?.value.skeleton.num_joints())),
        },
        Seed {
            name: "amc",
            bytes: frames,
            read: Box::new(move |b| Ok(size_of_motion(&amc::read(b, &acclaim, 120.0)?.value))),
        },
        Seed {
            name: "bvh",
            bytes: written,
            read: Box::new(|b| Ok(size_of_motion(&bvh::read(b, &BvhOptions::default())?.value))),
        },
        Seed {
            name: "csv",
            bytes: points_csv::write(&points).into_bytes(),
            read: Box::new(|b| Ok(size_of_points(&points_csv::read(b)?.value))),
        },
        Seed {
            name: "csv",
            bytes: trust.into(),
            read: Box::new(|b| Ok(size_of_points(&points_csv::read(b)?.value))),
        },
        Seed {
            name: "trc",
            bytes: rows,
            read: Box::new(move |b| Ok(size_of_points(&trc::read(b, &options)?.value))),
        },
        Seed {
            name: "c3d",
            bytes: binary,
            read: Box::new(move |b| Ok(size_of_points(&c3d::read(b, &options)?.value))),
        },
    ])
}

/// An error of a reader names a line or an offset of the file.
fn assert_says_where(error: &Error, seed: &Seed, bytes: &[u8]) {
    let place = match error {
        Error::Unexpected { place, .. } | Error::Model { place, .. } => *place,
        other => panic!("{}: {other}", seed.name),
    };
    match place {
        Place::Line(line) => assert!(line <= bytes.len() + 1, "{}: {error}", seed.name),
        Place::Byte(offset) => assert!(offset <= bytes.len() as u64, "{}: {error}", seed.name),
        Place::File => assert!(bytes.trim_ascii().is_empty() || seed.name == "csv", "{}: {error}", seed.name),
    }
    assert!(error.to_string().len() < 1000, "{}: {} bytes of message", seed.name, error.to_string().len());
}

fn check(seed: &Seed, bytes: &[u8]) {
    match (seed.read)(bytes) {
        // a megabyte of missing samples is free
        Ok(size) => assert!(size <= bytes.len() + (1 << 20), "{}: {size} values", seed.name),
        Err(error) => assert_says_where(&error, seed, bytes),
    }
}

#[test]
fn files_cut_at_every_byte_are_refused_with_a_place_or_are_shorter() {
    let Some(seeds) = seeds("files_cut_at_every_byte_are_refused_with_a_place_or_are_shorter") else {
        return;
    };
    for seed in &seeds {
        (seed.read)(&seed.bytes).unwrap_or_else(|e| panic!("{}: {e}", seed.name));
        let mut refused = 0;
        for length in 0..seed.bytes.len() {
            check(seed, &seed.bytes[..length]);
            refused += usize::from((seed.read)(&seed.bytes[..length]).is_err());
        }
        println!("{}: {refused} of {} cuts refused", seed.name, seed.bytes.len());
        assert!(refused > seed.bytes.len() / 4, "{}: {refused} of {}", seed.name, seed.bytes.len());
    }
}

/// One change of a file.
#[derive(Debug, Clone)]
enum Change {
    Set(Index, u8),
    Remove(Index, usize),
    Repeat(Index, usize, usize),
    Insert(Index, &'static str),
    Move(Index, Index, usize),
}

const WORDS: [&str; 24] = [
    " nan ",
    " -inf ",
    "1e308",
    "1e999",
    "-1",
    "0",
    "4294967296",
    "1000000000",
    "99999999999999999999",
    "{",
    "}",
    "(",
    "\n",
    "\t",
    "\r",
    "#",
    ":hierarchy\n",
    ":bonedata\n",
    "begin\n",
    "end\n",
    "root",
    "JOINT a\n{\n",
    "End Site\n{\n",
    "\u{feff}é",
];

fn change() -> impl Strategy<Value = Change> {
    let index = any::<Index>;
    prop_oneof![
        (index(), any::<u8>()).prop_map(|(at, byte)| Change::Set(at, byte)),
        (index(), 1..200_usize).prop_map(|(at, length)| Change::Remove(at, length)),
        (index(), 1..200_usize, 1..20_usize)
            .prop_map(|(at, length, times)| Change::Repeat(at, length, times)),
        (index(), proptest::sample::select(WORDS.as_slice())).prop_map(|(at, word)| Change::Insert(at, word)),
        (index(), index(), 1..200_usize).prop_map(|(from, to, length)| Change::Move(from, to, length)),
    ]
}

fn apply(bytes: &mut Vec<u8>, change: &Change, within: usize) {
    let end = bytes.len().min(within);
    if end == 0 {
        return;
    }
    let range = |at: &Index, length: usize| at.index(end)..(at.index(end) + length).min(end);
    match change {
        Change::Set(at, byte) => bytes[at.index(end)] = *byte,
        Change::Remove(at, length) => drop(bytes.drain(range(at, *length))),
        Change::Repeat(at, length, times) => {
            let piece = bytes[range(at, *length)].repeat(*times);
            bytes.splice(at.index(end)..at.index(end), piece);
        }
        Change::Insert(at, word) => drop(bytes.splice(at.index(end)..at.index(end), word.bytes())),
        Change::Move(from, to, length) => {
            let piece: Vec<u8> = bytes.drain(range(from, *length)).collect();
            let to = to.index(bytes.len() + 1);
            bytes.splice(to..to, piece);
        }
    }
}

fn runner() -> TestRunner {
    TestRunner::new_with_rng(
        ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() },
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    )
}

#[test]
fn files_changed_at_random_are_read_or_refused_with_a_place() {
    let Some(seeds) = seeds("files_changed_at_random_are_read_or_refused_with_a_place") else { return };
    for seed in &seeds {
        // headers break more than rows of numbers: every other change is at the beginning
        let changes = proptest::collection::vec((change(), any::<bool>()), 1..6);
        let result = runner().run(&changes, |changes| {
            let mut bytes = seed.bytes.clone();
            for (change, at_start) in &changes {
                apply(&mut bytes, change, if *at_start { 1500 } else { usize::MAX });
            }
            check(seed, &bytes);
            Ok(())
        });
        result.unwrap_or_else(|e| panic!("{}: {e}", seed.name));
    }
}

#[test]
fn archives_changed_at_random_are_read_or_refused() {
    let Some(seeds) = seeds("archives_changed_at_random_are_read_or_refused") else { return };
    let bytes_of = |name: &str| seeds.iter().find(|s| s.name == name).unwrap().bytes.as_slice();
    let mut tar = tar::Builder::new(Vec::new());
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in
        [("16/16.asf", bytes_of("asf")), ("16/16_15.amc", bytes_of("amc")), ("a.bvh", bytes_of("bvh"))]
    {
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        tar.append_data(&mut header, name, bytes).unwrap();
        zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut zip, bytes).unwrap();
    }
    let tar = tar.into_inner().unwrap();
    let zst = ruzstd::encoding::compress_to_vec(tar.as_slice(), ruzstd::encoding::CompressionLevel::Fastest);
    let zip = zip.finish().unwrap().into_inner();
    for (kind, archive) in [("tar", tar), ("tar.zst", zst), ("zip", zip)] {
        let changes = proptest::collection::vec(change(), 1..4);
        let result = runner().run(&changes, |changes| {
            let mut bytes = archive.clone();
            changes.iter().for_each(|change| apply(&mut bytes, change, usize::MAX));
            let limits = archive::Limits { total_bytes: 1 << 20, ..archive::Limits::default() };
            if let Ok(entries) = archive::entries("upload", &bytes, &limits) {
                assert!(entries.iter().map(|e| e.bytes.len()).sum::<usize>() <= bytes.len().max(1 << 20));
                let _ = motion_files::clips(&entries, &motion_files::Options::default());
            }
            Ok(())
        });
        result.unwrap_or_else(|e| panic!("{kind}: {e}"));
    }
}
