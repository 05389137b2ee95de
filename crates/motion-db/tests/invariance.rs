//! The database knows neither where on the floor a person stands nor which way they face.

mod fixtures;

use fixtures::{drawn, drawn_clips, moved, with_skeleton};
use kinematics::{PointSet, control_points};
use motion_db::{Clip, ControlTable, HeadingFrame, MotionDatabase, WindowIndex, resample, start_poses};
use nalgebra::Vector3;
use proptest::prelude::*;
use sample_motion::Action;

/// The features of every window of a motion, in double precision.
fn features(database: &MotionDatabase, index: &WindowIndex, clip: &Clip) -> Vec<f64> {
    let coordinates = resample(&clip.motion, database.parametrisation());
    let poses: Vec<&[f64]> = coordinates.chunks_exact(database.num_dofs()).collect();
    let (mut scratch, mut out) = (vec![0.0; index.width()], vec![0.0; index.width()]);
    let mut all = Vec::new();
    for t in index.window()..poses.len() {
        let window: Vec<&[f64]> = (1..=index.window()).map(|i| poses[t - i]).collect();
        index.query_features(&window, &mut scratch, &mut out);
        all.extend_from_slice(&out);
    }
    all
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn windows_stay_what_they_are_wherever_the_motion_is_put(
        turn in -7.0..7.0f64, x in -50.0..50.0f64, z in -50.0..50.0f64, seed in 0u64..8, offset: bool,
    ) {
        let mut clip = drawn(Action::ALL[seed as usize % 4], seed, seed, 60);
        if offset {
            // As in BVH files: the root hangs beside the origin.
            clip.motion = with_skeleton(&clip.motion, |joints| joints[0].offset = Vector3::new(0.3, 0.1, -0.7));
        }
        let elsewhere = Clip { motion: moved(&clip.motion, turn, [x, z]), ..clip.clone() };
        let database = MotionDatabase::build(std::slice::from_ref(&clip)).unwrap();
        let index = WindowIndex::new(&database, 3).unwrap();
        let (here, there) = (features(&database, &index, &clip), features(&database, &index, &elsewhere));
        // Degrees and centimetres; the Euler angles in between are singular at some headings.
        prop_assert!(largest_difference(&here, &there) < 1e-4);
    }
}

#[test]
fn rows_stay_what_they_are_wherever_the_motion_is_put() {
    let clips = drawn_clips(80);
    let put = |clip: &Clip| Clip { motion: moved(&clip.motion, 2.5, [3.0, -4.0]), ..clip.clone() };
    let database = MotionDatabase::build(&clips).unwrap();
    let elsewhere = MotionDatabase::build(&clips.iter().map(put).collect::<Vec<_>>()).unwrap();
    let (a, b) = (WindowIndex::new(&database, 2).unwrap(), WindowIndex::new(&elsewhere, 2).unwrap());
    assert_eq!(a.num_rows(), b.num_rows());
    // Principal axes may differ in sign: distances between rows do not.
    let distance = |index: &WindowIndex, row: usize| {
        let pairs = index.features(row).iter().zip(index.features(7));
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt()
    };
    for row in 0..a.num_rows() {
        let (here, there) = (distance(&a, row), distance(&b, row));
        assert!((here - there).abs() < 1e-3 + 1e-4 * here, "row {row}: {here} and {there}");
    }
}

/// Principal axes are a rotation: features keep the distances of the windows they stand for.
#[test]
fn features_keep_distances() {
    let database = MotionDatabase::build(&drawn_clips(80)).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    let raw = |row: usize| {
        let target = index.target(row);
        let mut poses = vec![vec![0.0; database.num_dofs()]; 2];
        database.copy_pose(target - 1, &mut poses[0]);
        database.copy_pose(target - 2, &mut poses[1]);
        let mut out = vec![0.0; index.width()];
        index.scale().window_features(&[&poses[0], &poses[1]], &mut out);
        out
    };
    let first = raw(0);
    for row in (0..index.num_rows()).step_by(13) {
        let expected: f64 = raw(row).iter().zip(&first).map(|(a, b)| (a - b).powi(2)).sum();
        let pairs = index.features(row).iter().zip(index.features(0));
        let found: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
        assert!((found.sqrt() - expected.sqrt()).abs() < 1e-3, "row {row}");
        assert_eq!(index.target_row(index.target(row)), Some(row));
    }
}

#[test]
fn the_start_of_a_moved_clip_is_found_with_its_turn_and_shift() {
    let clips = drawn_clips(200);
    let database = MotionDatabase::build(&clips).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    for (c, clip) in clips.iter().enumerate() {
        let skeleton = clip.motion.skeleton();
        let kinematics = database.kinematics(skeleton);
        let names = ["left_wrist", "right_wrist", "left_ankle", "right_ankle"];
        let points = PointSet::new(&kinematics, control_points(skeleton, &names).unwrap());
        let table = ControlTable::new(&database, &index, skeleton, &kinematics, &points, &[], &[]);
        assert!(table.unlikeness(c) < 1e-9);
        let planted = database.clips()[c].first_pose + 50;
        let offsets = [0, 3, 6, 9, 12];
        for (turn, shift) in [(0.0, [0.0, 0.0]), (2.9, [1.5, -4.0]), (-1.2, [-0.3, 12.0])] {
            let frame = HeadingFrame::new(shift[0], shift[1], turn);
            let mut observed: Vec<Option<Vector3<f64>>> = offsets
                .iter()
                .flat_map(|o| table.world(planted + o))
                .map(|p| Some(frame.world_from_local(&Vector3::from(p.map(f64::from)))))
                .collect();
            // What was not measured is not missed.
            observed[2] = None;
            observed[9] = None;
            let found = start_poses(&database, &table, &offsets, &observed, 2, 0.3, &[], 4);
            let best = found[0];
            assert_eq!(best.pose, planted, "{}: {best:?}", clip.name);
            let turned = kinematics::unwrap_near(best.turn, turn) - turn;
            assert!(turned.abs() < 1e-6, "turn {turn}, found {}", best.turn);
            let away = (best.shift[0] - shift[0]).hypot(best.shift[1] - shift[1]);
            assert!(away < 1e-6, "shift {shift:?}, found {:?}", best.shift);
            assert!(best.distance < 1e-6);
            assert!(found.windows(2).all(|w| w[0].distance <= w[1].distance));
            assert!(found.iter().all(|s| s.pose == planted || s.pose.abs_diff(planted) > 6));
            // Left out, the pose is not found.
            let out = database.clips()[c].first_pose..database.clips()[c].first_pose + 200;
            let found =
                start_poses(&database, &table, &offsets, &observed, 2, 0.3, std::slice::from_ref(&out), 4);
            assert!(!found.is_empty() && found.iter().all(|s| !out.contains(&s.pose)));
        }
    }
}

#[test]
fn nothing_measured_has_no_start() {
    let database = MotionDatabase::build(&drawn_clips(40)).unwrap();
    let index = WindowIndex::new(&database, 2).unwrap();
    let skeleton = database.skeleton().clone();
    let kinematics = database.kinematics(&skeleton);
    let points = PointSet::new(&kinematics, control_points(&skeleton, &["root", "head"]).unwrap());
    let table = ControlTable::new(&database, &index, &skeleton, &kinematics, &points, &[], &[]);
    assert!(start_poses(&database, &table, &[0, 3], &[None; 4], 2, 0.3, &[], 4).is_empty());
    // Offsets that no clip is long enough for.
    let observed = [Some(Vector3::zeros()); 4];
    assert!(start_poses(&database, &table, &[0, 300], &observed, 2, 0.3, &[], 4).is_empty());
}
