//! TRC and CSV of points: the recorded files, and the dialects they don't show.

use std::path::Path;

use formats::{PointsOptions, points_csv, trc};
use model::{Axis, PointTrajectories};
use nalgebra::Vector3;

const MARKERS: &str = "data/markers";

fn read_trc(folder: &Path, name: &str, up: Option<Axis>) -> (PointTrajectories, Vec<String>) {
    let read =
        trc::read(&testkit::shared::read(folder, name), &PointsOptions { up, ..PointsOptions::default() })
            .unwrap();
    (read.value, read.warnings.iter().map(ToString::to_string).collect())
}

fn missing(trajectories: &PointTrajectories) -> usize {
    (0..trajectories.num_frames())
        .map(|f| trajectories.frame(f).iter().filter(|p| p.x.is_nan()).count())
        .sum()
}

#[test]
fn recorded_trc_files_are_read_right() {
    let Some(folder) = testkit::shared::find(MARKERS, "recorded_trc_files_are_read_right") else { return };
    let cases = [
        ("opensim_subject01_static.trc", 49, 300, 60.0, "R.ASIS"),
        ("opensim_walk_free_01.trc", 41, 73, 60.0, "R.ASIS"),
        ("opensim_blanks_for_missing.trc", 40, 464, 250.0, "LTH3"),
        ("opensim_walking2_markers.trc", 44, 126, 25.0, "RTH1"),
    ];
    for (name, points, frames, rate, first) in cases {
        let (trajectories, _) = read_trc(&folder, name, None);
        assert_eq!(trajectories.num_points(), points, "{name}");
        assert_eq!(trajectories.num_frames(), frames, "{name}");
        assert_eq!(trajectories.frame_rate(), rate, "{name}");
        assert_eq!(trajectories.names()[0], first, "{name}");
    }
    let (standing, warnings) = read_trc(&folder, "opensim_subject01_static.trc", None);
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(missing(&standing), 0);
    let hip = standing.position(0, 0).unwrap();
    assert!((hip - nalgebra::Vector3::new(0.60866431, 1.07271313, 0.15744215)).norm() < 1e-12);
}

#[test]
fn a_header_that_declares_900_frames_over_73_rows_is_a_warning() {
    let test = "a_header_that_declares_900_frames_over_73_rows_is_a_warning";
    let Some(folder) = testkit::shared::find(MARKERS, test) else { return };
    let (trajectories, warnings) = read_trc(&folder, "opensim_walk_free_01.trc", None);
    assert_eq!(trajectories.num_frames(), 73);
    assert_eq!(warnings, ["line 3: the file declares 900 frames and has 73; all 73 are read"]);
}

#[test]
fn blank_cells_are_missing_samples() {
    let Some(folder) = testkit::shared::find(MARKERS, "blank_cells_are_missing_samples") else { return };
    let (trajectories, warnings) = read_trc(&folder, "opensim_blanks_for_missing.trc", None);
    assert_eq!(warnings, Vec::<String>::new());
    // counted apart from the reader: triples of empty cells in the rows
    let bytes = testkit::shared::read(&folder, "opensim_blanks_for_missing.trc");
    let text = String::from_utf8(bytes).unwrap();
    let rows: Vec<Vec<&str>> =
        text.lines().skip(6).map(|l| l.trim_end_matches(' ').split('\t').skip(2).collect()).collect();
    let blank: usize = rows
        .iter()
        .map(|r| (0..40).filter(|p| r.get(3 * p).is_none_or(|c| c.trim().is_empty())).count())
        .sum();
    assert_eq!(rows.len(), 464);
    assert!(blank > 0);
    assert_eq!(missing(&trajectories), blank);
}

#[test]
fn points_from_trc_survive_writing_and_reading_as_csv() {
    let test = "points_from_trc_survive_writing_and_reading_as_csv";
    let Some(folder) = testkit::shared::find(MARKERS, test) else { return };
    for name in ["opensim_subject01_static.trc", "opensim_walk_free_01.trc", "opensim_blanks_for_missing.trc"]
    {
        let (before, _) = read_trc(&folder, name, None);
        let read = points_csv::read(points_csv::write(&before).as_bytes()).unwrap();
        assert_eq!(read.warnings, []);
        let after = read.value;
        assert_eq!(after.names(), before.names());
        assert_eq!(after.frame_rate(), before.frame_rate());
        assert_eq!(after.num_frames(), before.num_frames());
        for frame in 0..before.num_frames() {
            for point in 0..before.num_points() {
                match (before.position(frame, point), after.position(frame, point)) {
                    (None, None) => {}
                    (Some(a), Some(b)) => assert!((a - b).norm() < 1e-7, "{name}: frame {frame}"),
                    (a, b) => panic!("{name}: frame {frame}, point {point}: {a:?} became {b:?}"),
                }
            }
        }
    }
}

const CSV: &str = "time,hand_x,hand_y,hand_z,foot_x,foot_y,foot_z
0,1,2,3,4,5,6
0.1,1,2,3,,,
0.2,nan,nan,nan,4,5,6.5
";

fn csv(text: &str) -> PointTrajectories {
    points_csv::read(text.as_bytes()).unwrap().value
}

#[test]
fn a_csv_is_turned_from_the_axis_that_is_said_to_be_up() {
    let options = |up| PointsOptions { up, ..PointsOptions::default() };
    for (up, expected) in
        [(None, [1.0, 2.0, 3.0]), (Some(Axis::Z), [1.0, 3.0, -2.0]), (Some(Axis::X), [3.0, 1.0, 2.0])]
    {
        let read = points_csv::read_with(CSV.as_bytes(), &options(up)).unwrap();
        assert_eq!(read.value.frame(0)[0], Vector3::from(expected), "{up:?}");
        assert!(read.warnings.is_empty());
    }
    let written = points_csv::write(&csv(CSV));
    let read = points_csv::read_with(written.as_bytes(), &options(Some(Axis::Z))).unwrap();
    assert_eq!(read.value.frame(0)[0], Vector3::new(1.0, 3.0, -2.0));
    assert_eq!(
        read.warnings[0].to_string(),
        "line 1: the file says y is up; the z that was asked for is taken instead"
    );
    assert!(points_csv::read_with(written.as_bytes(), &options(Some(Axis::Y))).unwrap().warnings.is_empty());
}

fn csv_error(text: &str) -> String {
    points_csv::read(text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn csv_of_points_has_missing_samples() {
    let points = csv(CSV);
    assert_eq!(points.names(), ["hand", "foot"]);
    assert_eq!((points.frame_rate(), points.num_frames()), (10.0, 3));
    assert_eq!(points.position(1, 1), None);
    assert_eq!(points.position(2, 0), None);
    assert_eq!(points.position(2, 1).unwrap().z, 6.5);
}

#[test]
fn csv_of_other_dialects_is_the_same() {
    let same = [
        CSV.replace('\n', "\r\n"),
        CSV.replace(',', ";"),
        CSV.replace("time", "# made by hand\n\nTime"),
        format!("\u{feff}{CSV}"),
        CSV.replace(",1,", ", 1 ,"),
        CSV.replace("hand_x", "\"hand_x\""),
    ];
    let as_text = |p: &PointTrajectories| points_csv::write(p);
    for text in same {
        assert_eq!(as_text(&csv(&text)), as_text(&csv(CSV)), "{text}");
    }
}

#[test]
fn a_row_that_is_not_there_is_a_frame_without_samples() {
    let points =
        csv(&CSV.replace("0.1,1,2,3,,,\n", "0.1,1,2,3,,,\n0.3,1,1,1,1,1,1\n").replace("0.2,nan", "0.4,nan"));
    assert_eq!(points.num_frames(), 5);
    assert_eq!(points.position(2, 0), None);
    assert_eq!(points.position(3, 1).unwrap().x, 1.0);
}

#[test]
fn damaged_csv_is_refused_with_its_line() {
    let cases = [
        (CSV.replace("time,", ""), "line 1: found no column of time"),
        (CSV.replace("foot_z", "foot"), "line 1: found column \"foot\""),
        (CSV.replace("foot_z", "toe_z"), "line 1: found point \"foot\" without three coordinates"),
        (CSV.replace("foot_z", "foot_y"), "line 1: found column \"foot_y\" twice"),
        (CSV.replace("4,5,6\n", "4,5\n"), "line 2: found 6 cells, expected 7"),
        (CSV.replace("4,5,6\n", "4,5,six\n"), "line 2: found \"six\""),
        (CSV.replace("4,5,6\n", "4,5,inf\n"), "line 2: found \"inf\""),
        (CSV.replace("0.2,", "0.05,"), "line 4: found time 0.05 s"),
        (CSV.replace("0.2,", "2e8,"), "line 4: found time 200000000 s, frame"),
        (CSV.lines().next().unwrap().to_owned(), "line 1: found a header without rows"),
        (String::new(), "file: found no line"),
    ];
    for (text, expected) in cases {
        assert!(csv_error(&text).starts_with(expected), "{} instead of {expected}", csv_error(&text));
    }
}

#[test]
fn csv_says_how_sure_samples_are() {
    let points = csv("time,a_x,a_y,a_z,a_sigma,b_Confidence,b_x,b_y,b_z,c_x,c_y,c_z,c_sigma,c_confidence\n\
                      0,1,2,3,0.02,1,1,2,3,1,2,3,0.01,0.5\n\
                      0.1,1,2,3,,0.25,1,2,3,1,2,3,,\n\
                      0.2,1,2,3,nan,0,1,2,3,1,2,3,0.01,1e-9\n");
    let sigmas = |point| [0, 1, 2].map(|frame| points.sigma(frame, point));
    assert_eq!(sigmas(0), [Some(0.02), None, None]);
    assert_eq!(sigmas(1), [None, Some(0.006), None]);
    assert_eq!(sigmas(2), [Some(0.02), None, None]);
    let measured = |point| [0, 1, 2].map(|frame| points.position(frame, point).is_some());
    assert_eq!(
        (measured(0), measured(1), measured(2)),
        ([true; 3], [true, true, false], [true, true, false])
    );

    let written = points_csv::write(&points);
    assert!(written.contains("time,a_x,a_y,a_z,a_sigma,b_x,b_y,b_z,b_sigma,c_x"), "{written}");
    let again = csv(&written);
    for frame in 0..3 {
        for point in 0..3 {
            assert_eq!(again.sigma(frame, point), points.sigma(frame, point));
            assert_eq!(again.position(frame, point), points.position(frame, point));
        }
    }
    assert!(!points_csv::write(&csv(CSV)).contains("sigma"));
}

#[test]
fn a_full_confidence_is_worth_what_the_options_say() {
    let text = "time,a_x,a_y,a_z,a_confidence\n0,1,2,3,0.5\n0.1,1,2,3,1\n";
    let options = PointsOptions { sigma_m: 0.01, ..PointsOptions::default() };
    let points = points_csv::read_with(text.as_bytes(), &options).unwrap().value;
    assert_eq!((points.sigma(0, 0), points.sigma(1, 0)), (Some(0.02), None));
}

#[test]
fn sigmas_and_confidences_that_make_no_sense_are_refused_with_the_line() {
    let text = |column: &str, cell: &str| format!("time,a_x,a_y,a_z,{column}\n0,1,2,3,\n0.1,1,2,3,{cell}\n");
    for cell in ["0", "-0.01", "x", "inf", "-0"] {
        let error = csv_error(&text("a_sigma", cell));
        assert!(error.starts_with(&format!("line 3: found \"{cell}\"")), "{error}");
    }
    for cell in ["1.01", "-0.1", "x", "inf"] {
        let error = csv_error(&text("a_confidence", cell));
        assert!(error.starts_with(&format!("line 3: found \"{cell}\"")), "{error}");
    }
    let error = csv_error(&text("b_sigma", "1"));
    assert!(error.starts_with("line 1: found point \"b\" without three coordinates"), "{error}");
    let error = csv_error(&text("a_sigma,a_sigma", "1,1"));
    assert!(error.starts_with("line 1: found column \"a_sigma\" twice"), "{error}");
    assert!(csv_error(&text("_sigma", "1")).starts_with("line 1: found column \"_sigma\""));
}

const TRC: &str = "PathFileType\t4\t(X/Y/Z)\tx.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate
 100.0\t100\t3\t2\tcm\t100
Frame#\tTime\tleft hand\t\t\tfoot
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.00\t10\t20\t30\t1\t2\t3
2\t0.01\t10\t20\t30\t\t\t
3\t0.02\t0\t0\t0\t1\t2\t3\t\t
";

#[test]
fn units_names_with_blanks_and_trailing_tabs_are_read() {
    let read =
        trc::read(TRC.as_bytes(), &PointsOptions { up: Some(Axis::Z), ..PointsOptions::default() }).unwrap();
    let points = read.value;
    assert_eq!(points.names(), ["left hand", "foot"]);
    let hand = points.position(0, 0).unwrap();
    assert!((hand - nalgebra::Vector3::new(0.1, 0.3, -0.2)).norm() < 1e-12);
    assert_eq!(points.position(1, 1), None);
    assert_eq!(points.position(2, 0), None);
    assert_eq!(read.warnings[0].message, "1 sample at exactly 0 0 0 taken as missing");
}

#[test]
fn damaged_trc_is_refused_with_its_line() {
    let cases = [
        (TRC.replace("PathFileType", "Path"), "line 1: found \"Path"),
        (TRC.replace("cm\t", "ells\t"), "line 3: found \"ells\", expected mm, cm, m or in"),
        (TRC.replace("100.0\t", "-1\t"), "line 3: found \"-1\", expected DataRate"),
        (TRC.replace("Frame#", "F"), "line 4: found \"F\\tTime"),
        (TRC.replace("X1\tY1\tZ1", "1\t2\t3"), "line 5: found "),
        (TRC.replace("0.01\t", "now\t"), "line 8: found \"now\", expected a time"),
        (TRC.replace("0.02\t0", "0.02\tx"), "line 9: found \"x\""),
        (TRC.replace("3\t\t\n", "3\t4\t5\n"), "line 9: found more than 6 coordinates"),
        (TRC[..TRC.find("1\t0.00").unwrap()].to_owned(), "line 6: found the end of the file, expected a row"),
    ];
    for (text, expected) in cases {
        let error = trc::read(text.as_bytes(), &PointsOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error} instead of {expected}");
    }
}

#[test]
fn short_rows_under_many_names_do_not_fill_memory() {
    let names = "\tn".repeat(100_000);
    let head = TRC[..TRC.find("Frame#").unwrap()].to_owned();
    let rows: String = (0..100_000).map(|row| format!("{row}\t{}\n", f64::from(row) / 100.0)).collect();
    let text = format!("{head}Frame#\tTime{names}\n\t\tX1\n{rows}");
    let error = trc::read(text.as_bytes(), &PointsOptions::default()).unwrap_err().to_string();
    assert!(error.contains("rows with a cell for each coordinate"), "{error}");
}

#[test]
fn points_written_as_trc_and_c3d_are_read_back() {
    let at = |frame: usize, point: usize| {
        if (frame + point) % 5 == 4 {
            nalgebra::Vector3::repeat(f64::NAN)
        } else {
            nalgebra::Vector3::new(frame as f64 * 0.01 - 0.3, 1.0 + point as f64 * 0.125, 0.5)
        }
    };
    let names: Vec<String> = (0..7).map(|point| format!("joint_{point}")).collect();
    let positions = (0..40).flat_map(|frame| (0..7).map(move |point| at(frame, point))).collect();
    let written = PointTrajectories::new(names, 30.0, positions).unwrap();
    let options = PointsOptions::default();
    let text = trc::write("joints.trc", &written);
    let bytes = formats::c3d::write(&written);
    for read in [trc::read(text.as_bytes(), &options).unwrap(), formats::c3d::read(&bytes, &options).unwrap()]
    {
        assert!(read.warnings.is_empty(), "{:?}", read.warnings);
        let read = read.value;
        assert_eq!((read.names(), read.frame_rate()), (written.names(), 30.0));
        assert_eq!((read.num_frames(), missing(&read)), (40, missing(&written)));
        for frame in 0..40 {
            for (a, b) in read.frame(frame).iter().zip(written.frame(frame)) {
                assert!(a.x.is_nan() || (a - b).norm() < 1e-6, "frame {frame}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn long_recordings_and_many_points_fit_into_c3d() {
    let names: Vec<String> = (0..300).map(|point| format!("p{point}")).collect();
    let many =
        PointTrajectories::new(names, 100.0, vec![nalgebra::Vector3::new(1.0, 2.0, 3.0); 600]).unwrap();
    let read = formats::c3d::read(&formats::c3d::write(&many), &PointsOptions::default()).unwrap().value;
    assert_eq!(read.names(), many.names());
    let one = vec![nalgebra::Vector3::new(1.0, 2.0, 3.0); 70_000];
    let long = PointTrajectories::new(vec!["p".into()], 100.0, one).unwrap();
    let read = formats::c3d::read(&formats::c3d::write(&long), &PointsOptions::default()).unwrap().value;
    assert_eq!(read.num_frames(), 70_000);
}
