//! Videos made by ffmpeg's test pictures, and the recorded ones.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::{Arc, atomic::AtomicBool},
    time::{Duration, Instant},
};

use model::Image;
use video::{Error, FrameReader, FrameWriter, Limits, Programs, ReadOptions, Source, WriteOptions, probe};

/// Runs ffmpeg; its test pictures have a counter, so that no two frames are alike.
fn ffmpeg(arguments: &[&str], to: &Path) {
    let done = Command::new("ffmpeg").args(["-v", "error", "-y"]).args(arguments).arg(to).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

fn test_clip(folder: &Path, name: &str, more: &[&str]) -> PathBuf {
    let path = folder.join(name);
    let input = ["-f", "lavfi", "-i", "testsrc=size=160x120:rate=25:duration=2", "-pix_fmt", "yuv420p"];
    ffmpeg(&[&input, more].concat(), &path);
    path
}

fn all(source: &Source, options: &ReadOptions) -> Result<Vec<Image>, Error> {
    let mut reader = FrameReader::open(source, options)?;
    let (mut frame, mut frames) = (reader.frame(), Vec::new());
    while reader.read(&mut frame)? {
        frames.push(frame.clone());
    }
    assert!(!reader.read(&mut frame)?, "nothing comes after the end");
    assert_eq!(reader.frames_read(), frames.len() as u64);
    Ok(frames)
}

fn mean_difference(a: &Image, b: &Image) -> f64 {
    let sum: u64 = a.rgb().iter().zip(b.rgb()).map(|(&a, &b)| u64::from(a.abs_diff(b))).sum();
    sum as f64 / a.rgb().len() as f64
}

#[test]
fn all_frames_of_a_clip_come_in_order_and_again_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let source = Source::Video(test_clip(folder.path(), "clip.mp4", &[]));
    let frames = all(&source, &ReadOptions::default()).unwrap();
    assert_eq!(frames.len(), 50);
    assert_eq!((frames[0].width(), frames[0].height()), (160, 120));
    assert!(frames.windows(2).all(|pair| pair[0] != pair[1]));
    assert!(frames == all(&source, &ReadOptions { threads: 1, ..ReadOptions::default() }).unwrap());
}

#[test]
fn size_and_rate_are_those_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let source = Source::Video(test_clip(folder.path(), "clip.mp4", &[]));
    let whole = all(&source, &ReadOptions::default()).unwrap();
    let options = ReadOptions { size: Some([80, 60]), rate: Some(5.0), ..ReadOptions::default() };
    let frames = all(&source, &options).unwrap();
    assert_eq!((frames.len(), frames[0].width(), frames[0].height()), (10, 80, 60));
    let every = ReadOptions { every: 7, ..ReadOptions::default() };
    let frames = all(&source, &every).unwrap();
    assert_eq!(frames.len(), 8);
    assert!(frames[3] == whole[21]);
    assert_eq!(FrameReader::open(&source, &every).unwrap().expected_frames(), Some(8));
}

#[test]
fn a_turned_video_comes_upright() {
    let folder = tempfile::tempdir().unwrap();
    let flat = test_clip(folder.path(), "flat.mp4", &[]);
    let turned = folder.path().join("turned.mp4");
    ffmpeg(&["-i", flat.to_str().unwrap(), "-c", "copy", "-metadata:s:v:0", "rotate=90"], &turned);
    let found = probe(&turned, &Programs::default(), &Limits::default()).unwrap();
    assert_eq!(found.size, [120, 160]);
    let upright = all(&Source::Video(turned), &ReadOptions::default()).unwrap();
    let stored = all(&Source::Video(flat), &ReadOptions::default()).unwrap();
    let mut expected = upright[0].clone();
    for (x, y) in (0..160).flat_map(|x| (0..120).map(move |y| (x, y))) {
        let (u, v) = match found.rotation_degrees {
            90 => (119 - y, x),
            270 => (y, 159 - x),
            other => panic!("turned by {other} degrees"),
        };
        expected.set(u, v, stored[0].pixel(x, y));
    }
    let difference = mean_difference(&expected, &upright[0]);
    assert!(difference < 3.0, "{difference}");
}

#[test]
fn pictures_come_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let clip = test_clip(folder.path(), "clip.mp4", &[]);
    let flags = "bicubic+accurate_rnd+full_chroma_int+bitexact";
    ffmpeg(&["-i", clip.to_str().unwrap(), "-sws_flags", flags], &folder.path().join("%03d.png"));
    // the number 4 is missing and one name would be an option
    fs::remove_file(folder.path().join("004.png")).unwrap();
    fs::rename(folder.path().join("001.png"), folder.path().join("-i.png")).unwrap();
    let mut files: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "png"));
    files.sort();
    let pictures =
        all(&Source::Images { files: files.clone(), rate: 30.0 }, &ReadOptions::default()).unwrap();
    let frames = all(&Source::Video(clip), &ReadOptions::default()).unwrap();
    assert_eq!(pictures.len(), 49);
    for (picture, frame) in [(0, 0), (1, 1), (48, 49)] {
        let difference = mean_difference(&pictures[picture], &frames[frame]);
        assert!(difference < 0.5, "{difference}");
    }

    files.push(folder.path().join("x.jpg"));
    let error = all(&Source::Images { files, rate: 30.0 }, &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("two kinds"), "{error}");
}

#[test]
fn a_file_that_is_cut_off_tells_how_many_frames_came() {
    let folder = tempfile::tempdir().unwrap();
    let whole = test_clip(folder.path(), "whole.mp4", &["-movflags", "+faststart", "-g", "5"]);
    let bytes = fs::read(whole).unwrap();
    let path = folder.path().join("cut.mp4");
    fs::write(&path, &bytes[..bytes.len() * 6 / 10]).unwrap();
    match all(&Source::Video(path), &ReadOptions::default()).unwrap_err() {
        Error::CutOff { found, expected, message, .. } => {
            assert!((5..50).contains(&found) && expected == "50" && !message.is_empty(), "{found} {message}");
        }
        other => panic!("{other}"),
    }
}

#[test]
fn what_is_no_video_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("text.mp4");
    fs::write(&text, "this is no video\n".repeat(100)).unwrap();
    let error = all(&Source::Video(text), &ReadOptions::default()).unwrap_err();
    assert!(matches!(&error, Error::NotAVideo { message, .. } if !message.is_empty()), "{error}");
    let error = all(&Source::video(folder.path().join("nothing.mp4")), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::File { .. }), "{error}");
    let sound = folder.path().join("sound.mp4");
    ffmpeg(&["-f", "lavfi", "-i", "sine=duration=1"], &sound);
    let error = all(&Source::Video(sound), &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("no picture stream"), "{error}");
}

#[test]
fn a_playlist_opens_no_other_file() {
    let folder = tempfile::tempdir().unwrap();
    let clip = test_clip(folder.path(), "clip.ts", &[]);
    let playlist = folder.path().join("list.mp4");
    let text =
        format!("#EXTM3U\n#EXT-X-TARGETDURATION:2\n#EXTINF:2,\nfile://{}\n#EXT-X-ENDLIST\n", clip.display());
    fs::write(&playlist, text).unwrap();
    let error = all(&Source::Video(playlist), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, Error::NotAVideo { .. }), "{error}");
}

#[test]
fn limits_hold_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let source = Source::Video(test_clip(folder.path(), "clip.mp4", &[]));
    let limited = |max_pixels, max_frames| ReadOptions {
        limits: Limits { max_pixels, max_frames },
        ..ReadOptions::default()
    };
    let error = all(&source, &limited(160 * 120 - 1, 1000)).unwrap_err();
    assert!(matches!(error, Error::TooLarge { .. }), "{error}");
    let error = all(&source, &limited(1 << 20, 49)).unwrap_err();
    assert!(matches!(error, Error::TooLong { found: 50, limit: 49, .. }), "{error}");
    let huge = ReadOptions { size: Some([60000, 60000]), ..ReadOptions::default() };
    assert!(matches!(all(&source, &huge), Err(Error::TooLarge { .. })));
    assert!(all(&source, &limited(160 * 120, 50)).is_ok());
}

#[test]
fn a_missing_program_names_its_package() {
    let folder = tempfile::tempdir().unwrap();
    let source = Source::Video(test_clip(folder.path(), "clip.mp4", &[]));
    let programs = Programs { ffprobe: "/nowhere/ffprobe".into(), ..Programs::default() };
    let error = all(&source, &ReadOptions { programs, ..ReadOptions::default() }).unwrap_err();
    assert!(error.to_string().contains("apt-get install ffmpeg"), "{error}");
}

#[test]
fn reading_stops_when_it_is_cancelled_and_leaves_no_process() {
    let folder = tempfile::tempdir().unwrap();
    let source = Source::Video(test_clip(folder.path(), "clip.mp4", &[]));
    let flag = Arc::new(AtomicBool::new(false));
    let options = ReadOptions { cancelled: Some(flag.clone()), ..ReadOptions::default() };
    let mut reader = FrameReader::open(&source, &options).unwrap();
    let mut frame = reader.frame();
    assert!(reader.read(&mut frame).unwrap());
    flag.store(true, std::sync::atomic::Ordering::Relaxed);
    assert!(matches!(reader.read(&mut frame), Err(Error::Cancelled { frames: 1 })));
    let start = Instant::now();
    drop(reader);
    assert!(start.elapsed() < Duration::from_secs(5));
    // a child process that ended but was not waited for would be a zombie, state Z; other tests' live ones are not
    let name = source_name(folder.path());
    let left = fs::read_dir("/proc").into_iter().flatten().flatten().filter(|entry| {
        fs::read(entry.path().join("cmdline"))
            .is_ok_and(|line| String::from_utf8_lossy(&line).contains(&name))
    });
    assert_eq!(left.count(), 0);
}

fn source_name(folder: &Path) -> String {
    folder.join("clip.mp4").display().to_string()
}

#[test]
fn what_is_written_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("overlay.mp4");
    // an odd size, which the pixel format hasn't
    let size = [101, 75];
    let picture = |number: usize| {
        let mut image = Image::black(101, 75);
        for y in 0..75 {
            for x in 0..101 {
                image.set(x, y, [(2 * x) as u8, (3 * y) as u8, (20 * number) as u8]);
            }
        }
        image
    };
    let mut writer =
        FrameWriter::create(&path, size, &WriteOptions { rate: 12.5, ..WriteOptions::default() }).unwrap();
    for number in 0..10 {
        writer.write(&picture(number)).unwrap();
    }
    assert!(matches!(writer.write(&Image::black(3, 3)), Err(Error::FrameSize { .. })));
    writer.finish().unwrap();
    let found = probe(&path, &Programs::default(), &Limits::default()).unwrap();
    assert_eq!((found.size, found.num_frames), ([102, 76], Some(10)));
    assert!((found.rate - 12.5).abs() < 1e-9);
    let frames = all(&Source::Video(path), &ReadOptions::default()).unwrap();
    for (number, frame) in frames.iter().enumerate() {
        let [expected, read] = [picture(number).pixel(50, 40), frame.pixel(50, 40)];
        assert!(expected.iter().zip(read).all(|(&a, b)| a.abs_diff(b) < 16), "{expected:?} {read:?}");
    }
}

#[test]
fn a_file_that_was_not_finished_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("overlay.mp4");
    let mut writer = FrameWriter::create(&path, [64, 48], &WriteOptions::default()).unwrap();
    writer.write(&Image::black(64, 48)).unwrap();
    drop(writer);
    assert!(!path.exists());
    let nowhere = folder.path().join("nowhere/overlay.mp4");
    let mut writer = FrameWriter::create(nowhere, [64, 48], &WriteOptions::default()).unwrap();
    let error = (0..1000).find_map(|_| writer.write(&Image::black(64, 48)).err());
    let error = error.unwrap_or_else(|| writer.finish().unwrap_err());
    assert!(error.to_string().contains("No such file"), "{error}");
}

#[test]
fn the_recorded_videos_are_read_whole() {
    let test = "the_recorded_videos_are_read_whole";
    let Some(folder) = testkit::shared::find("data/multiview/pose2sim-demo/videos", test) else { return };
    for (number, width) in [(1, 1080), (2, 1080), (3, 1088), (4, 1088)] {
        let source = Source::Video(folder.join(format!("cam0{number}.mp4")));
        let small = ReadOptions { size: Some([width / 4, 480]), ..ReadOptions::default() };
        let mut reader = FrameReader::open(&source, &small).unwrap();
        assert_eq!((reader.probe().size, reader.probe().num_frames), ([width, 1920], Some(100)));
        assert!((reader.probe().rate - 60.0).abs() < 1e-9);
        let mut frame = reader.frame();
        let mut count = 0;
        while reader.read(&mut frame).unwrap() {
            count += 1;
        }
        assert_eq!(count, 100);
    }
}
