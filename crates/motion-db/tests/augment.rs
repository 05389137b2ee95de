//! Motion made of motion: mirrored, and at other speeds.

mod fixtures;

use fixtures::{drawn, recorded, with_skeleton};
use kinematics::{Kinematics, Parametrisation};
use model::Motion;
use motion_db::{Augment, Clip, MotionDatabase, mirror, resample, trial_name, warp};
use nalgebra::Vector3;
use sample_motion::Action;

/// Where every joint and every end of a bone is in a frame, metres, with the joints' names.
fn places(motion: &Motion, frame: usize) -> Vec<(String, Vector3<f64>)> {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    kinematics.update(motion.pose(frame), &mut state);
    let joints = skeleton.joints().iter().enumerate();
    joints
        .flat_map(|(j, joint)| {
            let tip = (format!("{}.tip", joint.name), state.point(j, &joint.tip));
            [(joint.name.clone(), state.positions[j]), tip]
        })
        .collect()
}

fn other_side(name: &str, motion: &Motion) -> String {
    let (joint, rest) = name.split_once('.').map_or((name, ""), |(j, _)| (j, ".tip"));
    let swapped = match joint.split_at(1) {
        ("l", end) => format!("r{end}"),
        ("r", end) => format!("l{end}"),
        _ => joint.to_owned(),
    };
    let there = motion.skeleton().joint_index(&swapped).is_some();
    if there { swapped + rest } else { name.to_owned() }
}

/// Every joint is where the joint of the other side is seen in the mirror.
fn check_is_mirror_image(motion: &Motion, name: &str) {
    let mirrored = mirror(motion).unwrap();
    assert_eq!((mirrored.num_frames(), mirrored.frame_rate()), (motion.num_frames(), motion.frame_rate()));
    for frame in (0..motion.num_frames()).step_by(7) {
        let found: std::collections::HashMap<_, _> = places(&mirrored, frame).into_iter().collect();
        for (joint, place) in places(motion, frame) {
            let other = found[&other_side(&joint, motion)];
            let expected = Vector3::new(-place.x, place.y, place.z);
            assert!((other - expected).norm() < 1e-6, "{name}, frame {frame}, {joint}: {}", other - expected);
        }
    }
    // Twice is not at all.
    let back = mirror(&mirrored).unwrap();
    for frame in (0..motion.num_frames()).step_by(7) {
        for ((joint, a), (_, b)) in places(motion, frame).iter().zip(places(&back, frame)) {
            assert!((a - b).norm() < 1e-6, "{name}, frame {frame}, {joint}");
        }
    }
}

#[test]
fn a_mirrored_pose_is_the_mirror_image() {
    for (seed, action) in Action::ALL.into_iter().enumerate() {
        check_is_mirror_image(&drawn(action, seed as u64, seed as u64, 60).motion, &action.to_string());
    }
}

#[test]
fn a_performer_whose_sides_differ_is_mirrored_too() {
    let motion = with_skeleton(&drawn(Action::Run, 1, 1, 40).motion, |joints| {
        for (j, joint) in joints.iter_mut().enumerate() {
            joint.offset *= 1.0 + 0.02 * j as f64;
            joint.tip.z += 0.01 * j as f64;
        }
    });
    check_is_mirror_image(&motion, "uneven");
}

#[test]
fn recorded_poses_are_mirrored_exactly() {
    let Some(folder) =
        testkit::shared::find("data/motion/five-actions", "recorded_poses_are_mirrored_exactly")
    else {
        return;
    };
    for clip in recorded(&folder, 17) {
        check_is_mirror_image(&clip.motion, &clip.name);
    }
}

#[test]
fn sides_that_are_no_pair_are_named() {
    let walk = drawn(Action::Walk, 1, 1, 10).motion;
    let refused = |change: &dyn Fn(&mut Vec<model::Joint>)| {
        mirror(&with_skeleton(&walk, |joints| change(joints))).unwrap_err().to_string()
    };
    let message = refused(&|joints| {
        let j = joints.iter().position(|j| j.name == "rfemur").unwrap();
        joints[j].rotation_order.reverse();
    });
    assert!(message.contains("femur") && message.contains("channels"), "{message}");
    let message = refused(&|joints| {
        let j = joints.iter().position(|j| j.name == "rtibia").unwrap();
        joints[j].axes = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 1.0);
    });
    assert!(message.contains("tibia") && message.contains("mirror image"), "{message}");
}

#[test]
fn a_warped_clip_passes_through_the_same_poses_at_other_times() {
    let walk = drawn(Action::Walk, 1, 1, 120);
    let database = MotionDatabase::build(std::slice::from_ref(&walk)).unwrap();
    let plain = resample(&walk.motion, database.parametrisation());
    for (speed, step) in [(0.8, 5), (1.25, 4), (2.0, 2)] {
        let warped = resample(&warp(&walk, speed).unwrap().motion, database.parametrisation());
        let frames = warped.len() / 62;
        assert!((frames as f64 - 120.0 / speed).abs() <= 2.0, "{speed}: {frames} frames");
        // Where both have a frame at the same moment of the recording.
        let mut compared = 0;
        for f in (0..frames).step_by(step) {
            let at = f as f64 * speed;
            if (at - at.round()).abs() > 1e-9 || at.round() >= 120.0 {
                continue;
            }
            compared += 1;
            let expected = &plain[at.round() as usize * 62..][..62];
            for (d, (a, b)) in warped[f * 62..][..62].iter().zip(expected).enumerate() {
                assert!((a - b).abs() < 1e-9, "speed {speed}, frame {f}, coordinate {d}");
            }
        }
        assert!(compared > 10, "{speed}: {compared}");
    }
    for speed in [0.0, -1.0, 17.0, 0.06, f64::NAN, f64::INFINITY] {
        assert!(warp(&walk, speed).unwrap_err().to_string().starts_with("speed is"), "{speed}");
    }
}

#[test]
fn every_variant_is_indexed_under_its_own_name_and_knows_its_trial() {
    let clips = [drawn(Action::Walk, 1, 1, 100), drawn(Action::Jump, 2, 2, 80)];
    let all: Vec<Clip> = clips.iter().flat_map(|c| Augment::all().clips(c).unwrap()).collect();
    let names: std::collections::HashSet<&str> = all.iter().map(|c| c.name.as_str()).collect();
    assert_eq!((all.len(), names.len()), (12, 12));
    assert_eq!(all[0], clips[0]);
    assert!(all[..6].iter().all(|c| trial_name(&c.name) == clips[0].name && c.subject == clips[0].subject));
    let database = MotionDatabase::build(&all).unwrap();
    let poses = database.num_poses() as f64;
    assert!((poses / 180.0 - 6.1).abs() < 0.1, "{poses} poses");
    let plain: Vec<Clip> = clips.iter().flat_map(|c| Augment::default().clips(c).unwrap()).collect();
    assert_eq!(plain, clips);
}
