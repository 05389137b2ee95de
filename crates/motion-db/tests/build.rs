//! From clips to a database: frame rates, structure, size.

mod fixtures;

use fixtures::{drawn, with_skeleton};
use kinematics::{HEADING, Kinematics, Parametrisation, References};
use model::{Axis, Channel, Motion};
use motion_db::{Clip, Error, MotionDatabase, SkeletonSize, WindowIndex, resample};
use sample_motion::Action;

fn smooth(motion: &Motion) -> Parametrisation {
    Parametrisation::smooth(motion.skeleton(), &References::rest(motion.skeleton())).unwrap()
}

/// A motion of any rate whose smooth coordinates are linear in time: a person who turns and glides.
fn even(rate: f64, seconds: f64) -> (Motion, impl Fn(f64) -> Vec<f64>) {
    let walk = drawn(Action::Walk, 0, 1, 20).motion;
    let parametrisation = smooth(&walk);
    let mut start = vec![0.0; 62];
    parametrisation.coordinates_from_pose(walk.skeleton(), walk.pose(0), 0.0, &mut start);
    let at = move |t: f64| {
        let mut x = start.clone();
        x[0] += 1.3 * t;
        x[2] -= 0.4 * t;
        x[HEADING] += 4.0 * t;
        for (d, v) in x.iter_mut().enumerate().skip(6) {
            *v += 0.02 * t * (d as f64).sin();
        }
        x
    };
    let frames = (seconds * rate).floor() as usize + 1;
    let mut values = vec![0.0; frames * 62];
    for (f, out) in values.chunks_exact_mut(62).enumerate() {
        parametrisation.pose_from_coordinates(walk.skeleton(), &at(f as f64 / rate), None, out);
    }
    (Motion::new(walk.skeleton().clone(), rate, values).unwrap(), at)
}

#[test]
fn any_frame_rate_becomes_60_frames_a_second() {
    for rate in [60.0, 120.0, 240.0, 100.0, 250.0, 30.0, 25.0, 59.94, 119.88] {
        let (motion, at) = even(rate, 3.0);
        let parametrisation = smooth(&motion);
        let found = resample(&motion, &parametrisation);
        // Rates within a hundredth of a whole ratio are taken frame by frame.
        let stretch = if (rate / 60.0 - (rate / 60.0).round()).abs() < 0.01 && rate > 59.0 {
            60.0 * (rate / 60.0).round() / rate
        } else {
            1.0
        };
        let frames = found.len() / 62;
        assert!((180..=181).contains(&frames), "{rate}: {frames} frames");
        let mut turns = None;
        for (f, pose) in found.chunks_exact(62).enumerate() {
            let expected = at(f as f64 / 60.0 * stretch);
            let turn = *turns.get_or_insert(expected[HEADING] - pose[HEADING]);
            for (d, (found, expected)) in pose.iter().zip(&expected).enumerate() {
                let expected = if d == HEADING { expected - turn } else { *expected };
                assert!((found - expected).abs() < 1e-6, "{rate} frames/s, frame {f}, coordinate {d}");
            }
        }
    }
}

#[test]
fn a_rotation_is_resampled_the_short_way_through_half_a_turn() {
    // A joint that turns through half a turn about an oblique axis: its rotation vector jumps to the other side.
    let walk = drawn(Action::Walk, 0, 1, 20).motion;
    let skeleton = walk.skeleton();
    let parametrisation = smooth(&walk);
    let j = skeleton.joint_index("lhumerus").unwrap();
    let axis = nalgebra::Vector3::new(1.0, 1.2, -0.9).normalize();
    let kinematics = Kinematics::new(skeleton, parametrisation.clone());
    let mut state = kinematics.state();
    // Wherever the half turn falls between two frames.
    for start in [2.6, 2.613, 2.626, 2.639, 2.652] {
        let mut values = vec![0.0; 60 * 62];
        for (f, out) in values.chunks_exact_mut(62).enumerate() {
            let mut x = vec![0.0; 62];
            let v = axis * (start + f as f64 * 0.02);
            x[skeleton.dofs(j)].copy_from_slice(v.as_slice());
            parametrisation.pose_from_coordinates(skeleton, &x, None, out);
        }
        let motion = Motion::new(skeleton.clone(), 100.0, values).unwrap();
        let mut last: Option<nalgebra::Vector3<f64>> = None;
        for (f, x) in resample(&motion, &parametrisation).chunks_exact(62).enumerate() {
            kinematics.update(x, &mut state);
            let tip = state.point(j, &skeleton.joints()[j].tip);
            if let Some(last) = last {
                // Two radians a second.
                let speed = (tip - last).norm() * 60.0;
                assert!(
                    speed < 2.01 * skeleton.joints()[j].tip.norm(),
                    "from {start}, frame {f}: {speed} m/s"
                );
            }
            last = Some(tip);
        }
    }
}

#[test]
fn another_skeleton_is_refused_and_the_joint_is_named() {
    let first = drawn(Action::Walk, 0, 1, 30);
    let other = drawn(Action::Run, 1, 2, 30);
    let with = |change: &dyn Fn(&mut Vec<model::Joint>)| {
        let motion = with_skeleton(&other.motion, |joints| change(joints));
        let clips = [first.clone(), Clip { name: "odd".to_owned(), motion, ..other.clone() }];
        MotionDatabase::build(&clips).unwrap_err().to_string()
    };
    let at = |joints: &[model::Joint], name: &str| joints.iter().position(|j| j.name == name).unwrap();
    let message = with(&|joints| {
        let j = at(joints, "ltibia");
        joints[j].name = "shin".to_owned();
    });
    assert!(message.contains("odd") && message.contains("joint shin instead of ltibia"), "{message}");
    let message = with(&|joints| {
        let j = at(joints, "rfemur");
        joints[j].rotation_order.reverse();
    });
    assert!(message.contains("rfemur") && message.contains("another order"), "{message}");
    let message = with(&|joints| {
        let j = at(joints, "lowerback");
        joints[j].axes = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::x_axis(), 0.1);
    });
    assert!(message.contains("joint lowerback has other rotation axes"), "{message}");
    let message = with(&|joints| {
        let j = at(joints, "rradius");
        joints[j].channels = vec![Channel::rotation(Axis::Y)];
        joints[j].rotation_order = vec![Axis::Y];
    });
    assert!(message.contains("joint rradius has channels ry instead of rx"), "{message}");
}

#[test]
fn lengths_may_differ_and_are_scaled_away() {
    let small = drawn(Action::Walk, 0, 1, 60);
    let scale = 1.25;
    let motion = with_skeleton(&small.motion, |joints| {
        for joint in joints {
            joint.offset *= scale;
            joint.tip *= scale;
        }
    });
    let mut values = motion.values().to_vec();
    for pose in values.chunks_exact_mut(62) {
        pose[..3].iter_mut().for_each(|v| *v *= scale);
    }
    let motion = Motion::new(motion.skeleton().clone(), 60.0, values).unwrap();
    let (a, b) =
        (SkeletonSize::leg_length(small.motion.skeleton()), SkeletonSize::leg_length(motion.skeleton()));
    assert!((b / a - scale).abs() < 1e-9);
    let large = Clip { name: "large".to_owned(), motion, ..small.clone() };
    let database = MotionDatabase::build(&[small, large]).unwrap();
    assert!((database.leg_length() - (a + b) / 2.0).abs() < 1e-12);
    for pose in 0..60 {
        for (a, b) in database.pose(pose).iter().zip(database.pose(60 + pose)) {
            assert!((a - b).abs() < 1e-5);
        }
    }
}

#[test]
fn clips_that_are_too_short_are_left_out() {
    let clips = [drawn(Action::Walk, 0, 1, 7), drawn(Action::Run, 0, 2, 8), drawn(Action::Walk, 0, 3, 1)];
    let database = MotionDatabase::build(&clips).unwrap();
    assert_eq!((database.clips().len(), database.num_poses()), (1, 8));
    assert_eq!(database.clips()[0].name, clips[1].name);
    assert_eq!(MotionDatabase::build(&clips[..1]), Err(Error::NoMotion { min_frames: 8 }));
    assert_eq!(MotionDatabase::build(&[]), Err(Error::NoMotion { min_frames: 8 }));
}

#[test]
fn a_window_that_no_clip_holds_is_refused() {
    let database = MotionDatabase::build(&[drawn(Action::Walk, 0, 1, 9)]).unwrap();
    assert_eq!(WindowIndex::new(&database, 8).unwrap().num_rows(), 1);
    for window in [0, 9, 17] {
        assert_eq!(WindowIndex::new(&database, window).unwrap_err(), Error::Window { found: window, max: 8 });
    }
}

#[test]
fn every_pose_knows_its_clip() {
    let database = MotionDatabase::build(&fixtures::drawn_clips(33)).unwrap();
    for (i, clip) in database.clips().iter().enumerate() {
        assert_eq!(database.clip_at(clip.first_pose), i);
        assert_eq!(database.clip_at(clip.first_pose + clip.num_poses - 1), i);
    }
}

#[test]
fn a_recording_that_nobody_can_have_made_is_refused_by_name() {
    let mut clips = vec![drawn(Action::Walk, 0, 1, 60), drawn(Action::Walk, 1, 1, 60)];
    for farthest in [1e25, 1e300] {
        let walk = clips[1].motion.clone();
        let mut values: Vec<f64> = (0..walk.num_frames()).flat_map(|f| walk.pose(f).to_vec()).collect();
        values[30 * 62 + 1] = farthest;
        clips[1].name = "broken".into();
        clips[1].motion = Motion::new(walk.skeleton().clone(), walk.frame_rate(), values).unwrap();
        let error = MotionDatabase::build(&clips).unwrap_err();
        assert!(matches!(&error, Error::Value { clip, .. } if clip == "broken"), "{error}");
    }
}
