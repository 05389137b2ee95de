//! Every recorded marker file: which preset, how much of it, and whether what comes out is a person.

use std::path::Path;

use formats::{PointsOptions, c3d, trc};
use markers::{Error, Mapped, detect, fits};
use model::{Axis, PointTrajectories};
use nalgebra::Vector3;

const MARKERS: &str = "data/markers";

fn read(folder: &Path, name: &str) -> PointTrajectories {
    let bytes = testkit::shared::read(folder, name);
    // of the TRC files this one alone has z up, and does not say so
    let up = (name == "opensim_walking2_markers.trc").then_some(Axis::Z);
    let options = PointsOptions { up, ..PointsOptions::default() };
    if name.ends_with(".c3d") { c3d::read(&bytes, &options) } else { trc::read(&bytes, &options) }
        .unwrap()
        .value
}

fn mapped(folder: &Path, name: &str) -> (PointTrajectories, Mapped) {
    let file = read(folder, name);
    let fit = detect(file.names()).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mapped = fit.with_prefix().apply(&file, &[]).unwrap();
    (file, mapped)
}

#[test]
fn every_recorded_file_is_known_or_refused() {
    let Some(folder) = testkit::shared::find(MARKERS, "every_recorded_file_is_known_or_refused") else {
        return;
    };
    for (name, expected) in [
        ("opensim_walking2.c3d", "fullbody-2009, 4 points"),
        ("opensim_walking2_markers.trc", "fullbody-2009, 4 points"),
        ("opensim_blanks_for_missing.trc", "fullbody-2009, 3 points"),
        ("opensim_subject01_static.trc", "gait2392, 6 points"),
        ("opensim_walk_free_01.trc", "gait2392, 6 points"),
        ("ezc3d_qualisys.c3d", "isb-landmarks, 6 points"),
        ("ktk_tennis_serve.c3d", "plug-in-gait for Derrick:, 6 points"),
    ] {
        let file = read(&folder, name);
        for fit in fits(file.names()).iter().take(3) {
            println!("{name}: {} {} {} {:.2}", fit.label(), fit.num_whole(), fit.num_any(), fit.agreement);
        }
        let fit = detect(file.names()).unwrap();
        assert_eq!(format!("{}, {} points", fit.label(), fit.num_whole()), expected, "{name}");
    }
    // rigid clusters and a wheelchair
    let wheelchair = read(&folder, "ktk_wheelchair_racing.c3d");
    let error = detect(wheelchair.names()).unwrap_err();
    assert!(matches!(error, Error::Unknown { .. }), "{error}");
}

/// Mean of a point over the frames in which all `points` were measured.
fn means(mapped: &Mapped, points: &[&str]) -> Vec<Vector3<f64>> {
    let t = &mapped.trajectories;
    let columns: Vec<usize> = points.iter().map(|p| t.point_index(p).unwrap()).collect();
    let frames = (0..t.num_frames()).filter(|f| columns.iter().all(|c| t.position(*f, *c).is_some()));
    let frames: Vec<usize> = frames.collect();
    assert!(!frames.is_empty());
    let mean = |c: &usize| frames.iter().map(|f| t.frame(*f)[*c]).sum::<Vector3<f64>>() / frames.len() as f64;
    columns.iter().map(mean).collect()
}

/// The side of the body on which each left point is, from where the pelvis looks: positive for left.
fn sidedness(file: &PointTrajectories, mapped: &Mapped, pelvis: [&str; 3], pair: [&str; 2]) -> f64 {
    let marker = |name: &str| file.point_index(name).unwrap();
    let [left, right, back] = pelvis.map(marker);
    let t = &mapped.trajectories;
    let [left_point, right_point] = pair.map(|p| t.point_index(p).unwrap());
    let mut sum = 0.0;
    let mut count = 0;
    for f in 0..t.num_frames() {
        let (Some(l), Some(r), Some(b)) =
            (file.position(f, left), file.position(f, right), file.position(f, back))
        else {
            continue;
        };
        let (Some(p), Some(q)) = (t.position(f, left_point), t.position(f, right_point)) else { continue };
        let forward = (l + r) / 2.0 - b;
        let to_left = Vector3::y().cross(&forward).normalize();
        sum += (p - q).dot(&to_left);
        count += 1;
    }
    assert!(count > 0);
    sum / f64::from(count)
}

#[test]
fn points_are_where_a_person_has_them() {
    let Some(folder) = testkit::shared::find(MARKERS, "points_are_where_a_person_has_them") else { return };
    let cases = [
        ("opensim_walking2.c3d", ["LASI", "RASI", "RPSI"], false),
        ("opensim_walking2_markers.trc", ["LASI", "RASI", "RPSI"], false),
        ("opensim_subject01_static.trc", ["L.ASIS", "R.ASIS", "V.Sacral"], true),
        ("opensim_walk_free_01.trc", ["L.ASIS", "R.ASIS", "V.Sacral"], true),
        ("ezc3d_qualisys.c3d", ["L_IAS", "R_IAS", "R_IPS"], true),
        ("ktk_tennis_serve.c3d", ["Derrick:LASI", "Derrick:RASI", "Derrick:RPSI"], true),
    ];
    for (name, pelvis, has_wrists) in cases {
        let (file, mapped) = mapped(&folder, name);
        for point in &mapped.points {
            println!("{name}: {} of {} in {} frames", point.name, point.markers.join(", "), point.measured);
        }
        assert_eq!(mapped.warnings.iter().find(|w| w.contains("above")), None, "{name}");
        let found = means(&mapped, &["left_ankle", "right_ankle", "root", "head"]);
        println!("{name}: {found:?}");
        for ankle in &found[..2] {
            assert!((0.03..0.35).contains(&ankle.y), "{name}: ankle at {} m", ankle.y);
        }
        assert!((0.7..1.25).contains(&found[2].y), "{name}: root at {} m", found[2].y);
        let above = found[3].y - found[2].y;
        assert!((0.4..0.85).contains(&above), "{name}: head {above} m above the root");
        let feet = sidedness(&file, &mapped, pelvis, ["left_ankle", "right_ankle"]);
        assert!((0.02..0.6).contains(&feet), "{name}: left ankle {feet} m to the left of the right one");
        if has_wrists {
            let hands = sidedness(&file, &mapped, pelvis, ["left_wrist", "right_wrist"]);
            assert!((0.1..1.8).contains(&hands), "{name}: left wrist {hands} m to the left of the right one");
        }
    }
}

#[test]
fn a_person_who_lies_in_every_frame_is_a_warning() {
    let Some(folder) = testkit::shared::find(MARKERS, "a_person_who_lies_in_every_frame_is_a_warning") else {
        return;
    };
    let bytes = testkit::shared::read(&folder, "opensim_walking2_markers.trc");
    let lying = trc::read(&bytes, &PointsOptions::default()).unwrap().value;
    let mapped = detect(lying.names()).unwrap().with_prefix().apply(&lying, &[]).unwrap();
    assert!(mapped.warnings.iter().any(|w| w.contains("is not above the ankles")), "{:?}", mapped.warnings);
}

/// Most of a second's way that a joint of a walking or serving person goes in a frame, m/s.
const FASTEST: f64 = 25.0;

#[test]
fn points_do_not_jump_where_markers_drop_out() {
    let Some(folder) = testkit::shared::find(MARKERS, "points_do_not_jump_where_markers_drop_out") else {
        return;
    };
    for name in ["opensim_walking2.c3d", "opensim_blanks_for_missing.trc", "ktk_tennis_serve.c3d"] {
        let (_, mapped) = mapped(&folder, name);
        let t = &mapped.trajectories;
        for point in 0..t.num_points() {
            for frame in 1..t.num_frames() {
                let (Some(a), Some(b)) = (t.position(frame - 1, point), t.position(frame, point)) else {
                    continue;
                };
                let speed = (b - a).norm() * t.frame_rate();
                assert!(speed < FASTEST, "{name}: {} at {speed} m/s in frame {frame}", t.names()[point]);
            }
        }
    }
}

/// In the static trial both kinds of ankle are there: what the walk has must lead to the same place.
#[test]
fn the_ankle_from_foot_markers_is_the_ankle() {
    let Some(folder) = testkit::shared::find(MARKERS, "the_ankle_from_foot_markers_is_the_ankle") else {
        return;
    };
    let file = read(&folder, "opensim_subject01_static.trc");
    let gait = markers::preset("gait2392").unwrap();
    for side in ["left_ankle", "right_ankle"] {
        let choices = &gait.point(side).unwrap().choices;
        let centre = |group: &markers::Group| {
            let columns = group.markers.iter().zip(&group.weights);
            let mean: Vector3<f64> =
                columns.map(|(m, w)| file.frame(50)[file.point_index(m).unwrap()] * *w).sum();
            mean.y - group.offset_m[1]
        };
        let (exact, from_foot) = (centre(&choices[0]), centre(&choices[1]));
        assert!((exact - from_foot).abs() < 0.01, "{side}: {exact} m and {from_foot} m high");
    }
}
