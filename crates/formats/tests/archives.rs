//! Archives of motion: all recorded trials in every kind of archive, and archives that want to do harm.

use std::{io::Write as _, path::Path};

use formats::{
    Error,
    archive::{self, Entry, Limits},
    motion_files::{self, Broken, Options},
};

const FIVE_ACTIONS: &str = "data/motion/five-actions";

fn tar(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut builder = tar::Builder::new(Vec::new());
    for (name, bytes) in files {
        let mut header = tar::Header::new_gnu();
        // names that the crate refuses to write are written all the same
        let field = &mut header.as_gnu_mut().unwrap().name;
        field[..name.len()].copy_from_slice(name.as_bytes());
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        header.set_cksum();
        builder.append(&header, *bytes).unwrap();
    }
    builder.into_inner().unwrap()
}

fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
}

fn entries(bytes: &[u8]) -> formats::Result<Vec<Entry>> {
    archive::entries("upload", bytes, &Limits::default())
}

fn entry(name: &str, text: &str) -> Entry {
    Entry { name: name.into(), bytes: text.as_bytes().to_vec() }
}

#[test]
fn an_archive_whose_checksum_is_wrong_is_refused() {
    let mut packed = gzip(&tar(&[("a.bvh", b"HIERARCHY"), ("b.bvh", b"HIERARCHY")]));
    assert_eq!(entries(&packed).unwrap().len(), 2);
    let checksum = packed.len() - 8;
    packed[checksum] ^= 1;
    let error = entries(&packed).unwrap_err().to_string();
    assert!(error.contains("checksum"), "{error}");
}

#[test]
fn every_kind_of_archive_gives_the_same_files() {
    let (a, b) = (b"first".repeat(100), b"second".repeat(100));
    let packed = zstd(&a);
    let files: [(&str, &[u8]); 3] = [("x/a.amc.zst", &packed), ("x/b.bvh.gz", &gzip(&b)), ("c.txt", b"")];
    let expected = [
        Entry { name: "x/a.amc".into(), bytes: a },
        Entry { name: "x/b.bvh".into(), bytes: b },
        entry("c.txt", ""),
    ];
    let (tar, zip) = (tar(&files), zip(&files));
    for (kind, bytes) in [("tar", tar.clone()), ("zip", zip), ("tar.gz", gzip(&tar)), ("tar.zst", zstd(&tar))]
    {
        assert_eq!(entries(&bytes).unwrap(), expected, "{kind}");
    }
}

#[test]
fn only_the_files_that_are_wanted_are_unpacked() {
    let files: [(&str, &[u8]); 3] = [("cam1/0.png", b"a"), ("cam2/0.png", b"b"), ("cam2/1.png", b"c")];
    for bytes in [tar(&files), zip(&files), gzip(&tar(&files))] {
        let mut seen = Vec::new();
        let found = formats::archive::entries_where("a", &bytes, &Limits::default(), |name| {
            seen.push(name.to_owned());
            name.starts_with("cam2/")
        });
        assert_eq!(found.unwrap(), [entry("cam2/0.png", "b"), entry("cam2/1.png", "c")]);
        assert_eq!(seen, ["cam1/0.png", "cam2/0.png", "cam2/1.png"]);
    }
}

#[test]
fn a_single_file_is_an_archive_of_one() {
    let limits = Limits::default();
    for (name, bytes) in
        [("a.bvh", b"text".to_vec()), ("a.bvh.gz", gzip(b"text")), ("a.bvh.zst", zstd(b"text"))]
    {
        assert_eq!(archive::entries(name, &bytes, &limits).unwrap(), [entry("a.bvh", "text")]);
    }
}

#[test]
fn names_that_lead_out_of_the_archive_are_harmless() {
    for bytes in [tar(&[("../../etc/a.asf", b"x")]), zip(&[("../../etc/a.asf", b"x")])] {
        assert_eq!(entries(&bytes).unwrap()[0].name, "etc/a.asf");
    }
}

#[test]
fn bombs_are_refused() {
    let zeros = vec![0; 64 << 20];
    let bombs = [zip(&[("a.amc", &zeros)]), gzip(&zeros), zstd(&zeros), gzip(&tar(&[("a.amc", &zeros)]))];
    for bomb in bombs {
        assert!(bomb.len() < 300_000, "{}", bomb.len());
        let error = entries(&bomb).unwrap_err().to_string();
        assert!(error.contains("bytes unpacked"), "{error}");
    }
    // a bomb inside: each layer is charged
    let inner = zstd(&zeros);
    let error = entries(&zip(&[("a.amc.zst", &inner)])).unwrap_err().to_string();
    assert!(error.contains("bytes unpacked"), "{error}");
}

#[test]
fn limits_on_files_names_and_bytes_hold() {
    let tar = tar(&[("a", b"12345678"), ("bb", b"12345678")]);
    let limits = Limits { total_bytes: 1 << 20, entries: 2, name_bytes: 2, ratio: 1 };
    let with = |limits: Limits| archive::entries("upload", &tar, &limits).map(|e| e.len());
    assert_eq!(with(limits), Ok(2));
    assert_eq!(with(Limits { entries: 1, ..limits }), Err(Error::Limit { what: "files", limit: 1 }));
    assert!(with(Limits { name_bytes: 1, ..limits }).unwrap_err().to_string().contains("bytes in a name"));
    assert!(with(Limits { total_bytes: 15, ..limits }).unwrap_err().to_string().contains("bytes unpacked"));
}

#[test]
fn truncated_archives_are_errors_or_shorter_but_never_panics() {
    let text = (0..400).map(|i| format!("{i} ")).collect::<String>();
    let files: [(&str, &[u8]); 2] = [("a.amc", text.as_bytes()), ("b.amc", text.as_bytes())];
    let tar = tar(&files);
    for bytes in [zip(&files), gzip(&tar), zstd(&tar), tar] {
        let whole = entries(&bytes).unwrap();
        for length in 1..bytes.len() {
            // a cut between the members of a tar, or within its zeros at the end, leaves whole members; a file cut
            // before its mark is any file
            if let Ok(found) = entries(&bytes[..length]) {
                let is_plain = found.len() == 1 && found[0].bytes == bytes[..length];
                assert!(is_plain || whole.starts_with(&found), "{length}");
            }
        }
    }
}

#[test]
fn a_member_with_a_wrong_checksum_is_named() {
    let mut bytes = zip(&[("good.amc", b"fine"), ("bad.amc", b"0123456789")]);
    let at = bytes.windows(7).position(|w| w == b"bad.amc").unwrap();
    bytes[at + 9] ^= 1;
    let error = entries(&bytes).unwrap_err().to_string();
    assert!(error.starts_with("\"bad.amc\": zip is damaged"), "{error}");
}

const ASF: &str = ":units\nlength 1\nangle deg\n:root\norder TX RX\naxis XYZ\n:bonedata\n:hierarchy\n";
const AMC: &str = ":DEGREES\n1\nroot 1 2\n2\nroot 3 4\n";
const BVH: &str = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\n\
                   Frames: 1\nFrame Time: 0.1\n5\n";

fn clips(entries: &[Entry]) -> formats::Result<formats::Read<Vec<motion_files::MotionFile>>> {
    motion_files::clips(entries, &Options::default())
}

#[test]
fn motions_find_their_skeletons_flat_and_in_folders() {
    let two_inches = ASF.replace("length 1", "length 0.5");
    let entries = [
        entry("subjects/16/16_15.amc", AMC),
        entry("subjects/16/16.asf", ASF),
        entry("subjects/1/1_01.amc", AMC),
        entry("subjects/1/1.ASF", &two_inches),
        entry("subjects/__MACOSX/16/._16_15.amc", "\0"),
        entry("subjects/readme.txt", "hello"),
        entry("bvh/07_walk.bvh", BVH),
    ];
    let read = clips(&entries).unwrap();
    assert_eq!(read.warnings, []);
    let found: Vec<_> = read.value.iter().map(|c| (c.name.as_str(), c.subject.as_str())).collect();
    assert_eq!(found, [("07_walk", "07"), ("1_01", "1"), ("16_15", "16")]);
    assert!((read.value[1].motion.pose(0)[0] - 2.0 * 0.0254).abs() < 1e-12);
    assert!((read.value[2].motion.pose(0)[0] - 0.0254).abs() < 1e-12);
    assert_eq!(read.value[2].motion.frame_rate(), 120.0);
    assert_eq!(read.value[0].motion.frame_rate(), 10.0);
}

#[test]
fn the_longest_name_wins_and_a_single_skeleton_serves_all() {
    let two_inches = ASF.replace("length 1", "length 0.5");
    let x = |entries: &[Entry]| clips(entries).unwrap().value[0].motion.pose(0)[0];
    let both = [entry("ann.asf", ASF), entry("ann_2.asf", &two_inches), entry("ann_2_walk.amc", AMC)];
    assert!((x(&both) - 2.0 * 0.0254).abs() < 1e-12);
    assert!((x(&[entry("skeleton.asf", ASF), entry("take/walk.amc", AMC)]) - 0.0254).abs() < 1e-12);
    let error = clips(&[entry("a.asf", ASF), entry("b.asf", ASF), entry("c_1.amc", AMC)]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "c_1.amc: file: found no ASF file for it among 2, expected one such as c.asf"
    );
}

#[test]
fn an_index_gives_action_subject_and_frame_rate() {
    let index = "file,subject,trial,action,fps,description\n\
                 16_15.amc.zst,Ann,,walk,60,\"walk, slow\"\n,,16_16,run,,\n";
    let entries = [
        entry("d/index.csv", index),
        entry("d/16.asf", ASF),
        entry("d/16_15.amc", AMC),
        entry("d/16_16.amc", AMC),
        entry("d/16_17.amc", &AMC.replace(":DEGREES", ":SAMPLES-PER-SECOND 30\n:DEGREES")),
    ];
    let clips = clips(&entries).unwrap().value;
    let found: Vec<_> =
        clips.iter().map(|c| (c.subject.as_str(), c.action.as_str(), c.motion.frame_rate())).collect();
    assert_eq!(found, [("Ann", "walk", 60.0), ("16", "run", 120.0), ("16", "", 30.0)]);
    let bad = [entry("index.csv", &index.replace("60", "fast")), entry("a.bvh", BVH)];
    let error = motion_files::clips(&bad, &Options::default()).unwrap_err();
    assert_eq!(error.to_string(), "index.csv: line 2: found \"fast\", expected fps: frames per second");
}

#[test]
fn a_broken_file_among_many_is_named_or_skipped() {
    let entries = [
        entry("16.asf", ASF),
        entry("16_15.amc", AMC),
        entry("16_16.amc", &AMC.replace("root 3 4", "root 3 x")),
    ];
    let message = "16_16.amc: line 5: found \"x\", expected a finite number";
    assert_eq!(clips(&entries).unwrap_err().to_string(), message);
    let options = Options { broken: Broken::Skip, ..Options::default() };
    let read = motion_files::clips(&entries, &options).unwrap();
    assert_eq!(read.value.len(), 1);
    assert_eq!(read.warnings[0].to_string(), format!("{message} is left out"));
    let error = clips(&[entry("16.asf", "damaged"), entry("16_15.amc", AMC)]).unwrap_err().to_string();
    assert!(error.starts_with("16.asf: line 1: found \"damaged\""), "{error}");
    let error = clips(&[entry("readme.txt", "")]).unwrap_err().to_string();
    assert!(error.contains("one file, which is no motion"), "{error}");
}

#[test]
fn the_folder_of_five_actions_is_read_from_a_tar() {
    let Some(folder) = testkit::shared::find(FIVE_ACTIONS, "the_folder_of_five_actions_is_read_from_a_tar")
    else {
        return;
    };
    let mut names: Vec<_> =
        std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let files: Vec<_> =
        names.iter().map(|n| (n.as_str(), std::fs::read(Path::new(&folder).join(n)).unwrap())).collect();
    let files: Vec<_> = files.iter().map(|(n, b)| (*n, b.as_slice())).collect();
    let read = clips(&entries(&tar(&files)).unwrap()).unwrap();
    assert_eq!(read.warnings, []);
    let mut index = testkit::shared::index(&folder);
    index.sort_by_key(|row| row.get("file").to_owned());
    assert_eq!(read.value.len(), index.len());
    for (clip, row) in read.value.iter().zip(&index) {
        assert_eq!(clip.name, row.get("trial"));
        assert_eq!(clip.subject, row.get("subject"));
        assert_eq!(clip.action, row.get("action"));
        assert_eq!(clip.motion.num_frames().to_string(), row.get("frames"));
    }
}

#[test]
fn what_is_called_an_archive_and_is_none_is_said_to_be_none() {
    let text = b"just words";
    let gz = {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut encoder, text).unwrap();
        encoder.finish().unwrap()
    };
    for (name, bytes) in
        [("a.zip", &text[..]), ("A.TAR", text), ("a.tgz", &gz), ("a.tar.gz", &gz), ("a.tar", &[])]
    {
        let error = archive::entries(name, bytes, &Limits::default()).unwrap_err().to_string();
        assert!(
            error.contains("found a file that is no archive with files in it, expected a .zip"),
            "{error}"
        );
    }
    for (name, bytes) in [("a.csv", &text[..]), ("a.csv.gz", &gz), ("zip", text)] {
        assert_eq!(archive::entries(name, bytes, &Limits::default()).unwrap().len(), 1, "{name}");
    }
}
