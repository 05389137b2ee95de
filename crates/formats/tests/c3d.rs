//! C3D: the recorded files, the same trial as TRC, and files made here for what they don't show.

use formats::{PointsOptions, c3d, trc};
use model::{Axis, PointTrajectories};
use nalgebra::Vector3;

const MARKERS: &str = "data/markers";

fn missing(trajectories: &PointTrajectories) -> usize {
    (0..trajectories.num_frames())
        .map(|f| trajectories.frame(f).iter().filter(|p| p.x.is_nan()).count())
        .sum()
}

#[test]
fn recorded_c3d_files_are_read_right() {
    let Some(folder) = testkit::shared::find(MARKERS, "recorded_c3d_files_are_read_right") else { return };
    let cases = [
        // name, points, frames, rate, first label, missing, warnings
        ("opensim_walking2.c3d", 44, 1249, 250.0, "RTH1", 27_567, 0),
        ("ezc3d_qualisys.c3d", 55, 340, 200.0, "L_IAS", 0, 1),
        ("ktk_tennis_serve.c3d", 39, 1092, 50.0, "Derrick:C7", 0, 1),
        ("ktk_wheelchair_racing.c3d", 41, 700, 69.99261474609375, "Probe1", 6_384, 1),
    ];
    for (name, points, frames, rate, first, lost, warnings) in cases {
        let read = c3d::read(&testkit::shared::read(&folder, name), &PointsOptions::default()).unwrap();
        assert_eq!(read.warnings.len(), warnings, "{name}: {:?}", read.warnings);
        let trajectories = read.value;
        assert_eq!(trajectories.num_points(), points, "{name}");
        assert_eq!(trajectories.num_frames(), frames, "{name}");
        assert_eq!(trajectories.frame_rate(), rate, "{name}");
        assert_eq!(trajectories.names()[0], first, "{name}");
        assert_eq!(missing(&trajectories), lost, "{name}");
    }
}

#[test]
fn heads_are_above_feet() {
    let Some(folder) = testkit::shared::find(MARKERS, "heads_are_above_feet") else { return };
    let cases = [
        ("opensim_walking2.c3d", "LFHD", "LCAL", None),
        ("ezc3d_qualisys.c3d", "L_HDF", "L_FCC", None),
        ("ktk_tennis_serve.c3d", "Derrick:LFHD", "Derrick:LTOE", None),
        ("ktk_wheelchair_racing.c3d", "Head1", "WheelchairFront", Some(Axis::Y)),
    ];
    for (name, head, foot, up) in cases {
        let points = c3d::read(
            &testkit::shared::read(&folder, name),
            &PointsOptions { up, ..PointsOptions::default() },
        )
        .unwrap()
        .value;
        let mean_height = |label: &str| {
            let point = points.point_index(label).unwrap_or_else(|| panic!("{name}: {:?}", points.names()));
            let heights: Vec<f64> =
                (0..points.num_frames()).filter_map(|f| points.position(f, point)).map(|p| p.y).collect();
            heights.iter().sum::<f64>() / heights.len() as f64
        };
        let (head, foot) = (mean_height(head), mean_height(foot));
        assert!(head > foot + 0.3 && head < 2.2 && foot > -0.1, "{name}: head {head} m, foot {foot} m");
    }
}

/// The TRC holds every tenth frame of the C3D (its header still says 250 Hz) and the last frame, in the lab's axes,
/// z up, with five digits.
#[test]
fn a_trial_is_the_same_from_c3d_and_from_trc() {
    let Some(folder) = testkit::shared::find(MARKERS, "a_trial_is_the_same_from_c3d_and_from_trc") else {
        return;
    };
    let options = PointsOptions { up: Some(Axis::Z), ..PointsOptions::default() };
    let binary =
        c3d::read(&testkit::shared::read(&folder, "opensim_walking2.c3d"), &PointsOptions::default())
            .unwrap();
    let text = trc::read(&testkit::shared::read(&folder, "opensim_walking2_markers.trc"), &options).unwrap();
    let messages: Vec<_> = text.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        messages,
        [
            "line 7: the header says 250 Hz, the times say 25 Hz; the times are taken",
            "line 7: the times of 1 row are off the 25 Hz grid"
        ]
    );
    let (binary, text) = (binary.value, text.value);
    assert_eq!(binary.names(), text.names());
    let mut compared = 0;
    for row in 0..text.num_frames() {
        let frame = if row == 125 { 1248 } else { 10 * row };
        for point in 0..text.num_points() {
            match (binary.position(frame, point), text.position(row, point)) {
                (None, None) => {}
                (Some(a), Some(b)) => {
                    let distance = (a - b).norm();
                    assert!(distance < 0.1e-3, "row {row}, {}: {distance} m apart", binary.names()[point]);
                    compared += 1;
                }
                (a, b) => panic!("row {row}, {}: {a:?} is not {b:?}", binary.names()[point]),
            }
        }
    }
    assert!(compared > 2000, "{compared}");
}

/// A file with two points and two analog values in a frame, for a processor, in integers or floats.
struct Made {
    processor: u8,
    scale: f32,
    frames: usize,
    header_last: u16,
    /// further parameters of POINT and TRIAL
    parameters: Vec<(i8, &'static str, Vec<u8>)>,
}

impl Made {
    fn new(processor: u8, scale: f32) -> Self {
        Self { processor, scale, frames: 3, header_last: 3, parameters: Vec::new() }
    }

    fn word(&self, value: u16) -> [u8; 2] {
        if self.processor == 86 { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    fn float(&self, value: f32) -> [u8; 4] {
        match self.processor {
            86 => value.to_be_bytes(),
            85 if value != 0.0 => {
                let [a, b, c, d] = (value * 4.0).to_le_bytes();
                [c, d, a, b]
            }
            _ => value.to_le_bytes(),
        }
    }

    fn text(values: &[&str]) -> Vec<u8> {
        let length = values.iter().map(|v| v.len()).max().unwrap_or(0);
        let mut out = vec![255, 2, length as u8, values.len() as u8];
        for value in values {
            out.extend(format!("{value:length$}").bytes());
        }
        out
    }

    /// Point 1 moves along x, point 2 is not measured in the second frame.
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![2, 0x50];
        for word in [2, 2, 1, self.header_last, 10] {
            bytes.extend(self.word(word));
        }
        bytes.extend(self.float(self.scale));
        bytes.extend(self.word(4));
        bytes.extend(self.word(1));
        bytes.extend(self.float(50.0));
        bytes.resize(512, 0);
        bytes.extend([1, 0x50, 2, self.processor]);
        let record = |bytes: &mut Vec<u8>, id: i8, name: &str, body: &[u8]| {
            bytes.extend([name.len() as u8, id.cast_unsigned()]);
            bytes.extend(name.bytes());
            bytes.extend(self.word(body.len() as u16 + 3));
            bytes.extend(body);
            bytes.push(0);
        };
        record(&mut bytes, -1, "POINT", &[]);
        record(&mut bytes, -2, "trial", &[]);
        record(&mut bytes, 1, "LABELS", &Self::text(&["head", "foot"]));
        record(&mut bytes, 1, "UNITS", &Self::text(&["cm"]));
        record(&mut bytes, 1, "Y_SCREEN", &Self::text(&["+Z"]));
        for (id, name, body) in &self.parameters {
            record(&mut bytes, *id, name, body);
        }
        assert!(bytes.len() < 3 * 512);
        bytes.resize(3 * 512, 0);
        for frame in 0..self.frames {
            let lost = if frame == 1 { -1.0 } else { 1.0 };
            for (values, residual) in [([10.0 + frame as f32, 20.0, 160.0], 1.0), ([1.0, 2.0, 3.0], lost)] {
                if self.scale < 0.0 {
                    values.iter().chain([&residual]).for_each(|v| bytes.extend(self.float(*v)));
                } else {
                    let steps = values.map(|v| v / self.scale);
                    let words = steps.iter().chain([&residual]).map(|v| (*v as i16).cast_unsigned());
                    words.for_each(|v| bytes.extend(self.word(v)));
                }
            }
            bytes.resize(bytes.len() + if self.scale < 0.0 { 8 } else { 4 }, 0);
        }
        bytes
    }

    fn read(&self) -> formats::Read<PointTrajectories> {
        c3d::read(&self.bytes(), &PointsOptions::default()).unwrap()
    }
}

#[test]
fn another_axis_than_the_file_says_is_used_with_a_warning() {
    let bytes = Made::new(84, -1.0).bytes();
    let read = |up| c3d::read(&bytes, &PointsOptions { up, ..PointsOptions::default() }).unwrap();
    assert_eq!(read(Some(Axis::Z)).warnings, []);
    let turned = read(Some(Axis::Y));
    let warning = turned.warnings[0].to_string();
    assert!(warning.contains("says z is up; the y that was asked for is taken instead"), "{warning}");
    assert_ne!(turned.value.frame(0)[0], read(None).value.frame(0)[0]);
}

#[test]
fn all_processors_and_both_kinds_of_data_are_read_alike() {
    for processor in [84, 85, 86] {
        for scale in [-1.0, 0.5] {
            let read = Made::new(processor, scale).read();
            assert_eq!(read.warnings, []);
            let points = read.value;
            assert_eq!(
                (points.names(), points.frame_rate()),
                (["head", "foot"].map(String::from).as_slice(), 50.0)
            );
            assert_eq!(points.num_frames(), 3);
            let head = points.position(2, 0).unwrap();
            assert!((head - Vector3::new(0.12, 1.6, -0.2)).norm() < 1e-6, "{processor} {scale}: {head}");
            assert_eq!(points.position(1, 1), None);
            assert!((points.position(0, 1).unwrap() - Vector3::new(0.01, 0.03, -0.02)).norm() < 1e-6);
        }
    }
}

/// The residual of the made files is one step of their scale, their unit is the centimetre.
#[test]
fn residuals_are_standard_deviations_where_they_can_be() {
    for processor in [84, 85, 86] {
        for scale in [-0.5, 0.5] {
            let points = Made::new(processor, scale).read().value;
            assert!((points.sigma(0, 0).unwrap() - 0.005).abs() < 1e-9, "{processor} {scale}");
            assert_eq!(points.sigma(1, 1), None);
        }
    }
    let made = Made::new(84, -0.5).bytes();
    let careless = PointsOptions { sigma_m: 0.006, ..PointsOptions::default() };
    assert!(!c3d::read(&made, &careless).unwrap().value.has_sigmas());
    // a metre and a half is not a residual
    assert!(!Made::new(84, -150.0).read().value.has_sigmas());
}

#[test]
fn a_long_trial_has_the_frames_that_its_parameters_say() {
    let mut made = Made::new(84, 1.0);
    made.frames = 70_000;
    made.header_last = u16::MAX;
    // 70,000 is 1 times 65,536 and 4,464
    made.parameters = vec![
        (2, "ACTUAL_START_FIELD", [vec![2, 1, 2], vec![1, 0, 0, 0]].concat()),
        (2, "ACTUAL_END_FIELD", [vec![2, 1, 2], 4464_u16.to_le_bytes().to_vec(), vec![1, 0]].concat()),
        (1, "FRAMES", [vec![2, 0], vec![255, 255]].concat()),
    ];
    let read = made.read();
    assert_eq!(read.value.num_frames(), 70_000);
    assert_eq!(read.warnings, []);
}

#[test]
fn frames_that_are_stated_twice_differently_are_a_warning() {
    let mut made = Made::new(84, -1.0);
    made.parameters = vec![(1, "FRAMES", vec![2, 0, 2, 0])];
    let read = made.read();
    assert_eq!(read.value.num_frames(), 3);
    assert_eq!(read.warnings[0].message, "POINT:FRAMES says 2 frames; the 3 of the header are read");
}

#[test]
fn labels_go_on_in_further_parameters() {
    let mut made = Made::new(86, -1.0);
    made.parameters = vec![(1, "LABELS2", Made::text(&["more"]))];
    assert_eq!(made.read().value.names(), ["head", "foot"]);
    let bytes = made.bytes();
    let at = bytes.windows(6).position(|w| w == b"LABELS").unwrap();
    let mut one_label = bytes.clone();
    // the first parameter keeps one label of eight letters
    one_label[at + 10..at + 12].copy_from_slice(&[8, 1]);
    let read = c3d::read(&one_label, &PointsOptions::default()).unwrap();
    assert_eq!(read.value.names(), ["headfoot", "more"]);
}

#[test]
fn every_truncation_is_refused_with_its_offset() {
    let bytes = Made::new(84, -1.0).bytes();
    for length in 0..bytes.len() {
        let error = c3d::read(&bytes[..length], &PointsOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with("byte "), "{length}: {error}");
    }
}

#[test]
fn damage_is_refused_with_its_offset() {
    let good = Made::new(84, -1.0).bytes();
    let cases: [(usize, &[u8], &str); 8] = [
        (0, &[0], "byte 0: found 0"),
        (1, &[0x51], "byte 1: found 0x51"),
        (2, &[0, 0], "byte 2: found 0 points"),
        (2, &[255, 255], "byte 1536: found data for 0 frames"),
        (8, &[255, 254], "byte 1536: found data for 3 frames, expected 65279 frames as the header says"),
        (12, &[0, 0, 192, 127], "byte 12: found a scale of NaN"),
        (20, &[0, 0, 0, 0], "byte 20: found a frame rate of 0 Hz"),
        (515, &[87], "byte 515: found 87, expected the processor"),
    ];
    for (at, with, expected) in cases {
        let mut bytes = good.clone();
        bytes[at..at + with.len()].copy_from_slice(with);
        let error = c3d::read(&bytes, &PointsOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error} instead of {expected}");
    }
}
