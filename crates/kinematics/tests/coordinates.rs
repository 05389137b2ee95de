//! A pose, written in channels or in smooth coordinates, is the same pose.

mod fixtures;

use std::f64::consts::{PI, TAU};

use fixtures::{Numbers, bvh_rig, parametrisations, references_at, walk};
use kinematics::{Error, Kinematics, Parametrisation, References, State, can_flip};
use model::{Axis, Channel, Joint, Skeleton};
use proptest::prelude::*;

/// The joint that differs, and by how much: positions and bone ends in metres, rotations where the bone has not been
/// flipped.
fn difference(skeleton: &Skeleton, a: &State, b: &State) -> (f64, String) {
    let mut worst = (0.0, String::new());
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let mut found = (a.positions[j] - b.positions[j]).norm();
        found = found.max((a.point(j, &joint.tip) - b.point(j, &joint.tip)).norm());
        if !can_flip(skeleton, j) {
            found = found.max((a.rotations[j] - b.rotations[j]).norm());
        }
        if found > worst.0 || found.is_nan() {
            worst = (found, joint.name.clone());
        }
    }
    worst
}

/// Checks that `pose` keeps its place through `parametrisation` and back.
fn check_round_trip(skeleton: &Skeleton, parametrisation: &Parametrisation, pose: &[f64], tolerance: f64) {
    let channels = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let smooth = Kinematics::new(skeleton, parametrisation.clone());
    let (mut expected, mut found) = (channels.state(), channels.state());
    let (mut x, mut back) = (vec![0.0; pose.len()], vec![0.0; pose.len()]);
    parametrisation.coordinates_from_pose(skeleton, pose, 0.3, &mut x);
    channels.update(pose, &mut expected);
    smooth.update(&x, &mut found);
    let (worst, joint) = difference(skeleton, &expected, &found);
    assert!(worst < 1e-9, "{joint} is {worst} from where the channels put it");
    for previous in [None, Some(pose)] {
        parametrisation.pose_from_coordinates(skeleton, &x, previous, &mut back);
        channels.update(&back, &mut found);
        let (worst, joint) = difference(skeleton, &expected, &found);
        assert!(worst < tolerance, "{joint} is {worst} from where it was, after pose {pose:?}");
    }
    let turns = |dof: usize| (back[dof] - pose[dof]).abs();
    for (j, joint) in skeleton.joints().iter().enumerate().filter(|(j, _)| !can_flip(skeleton, *j)) {
        let is_near_pole = joint.num_rotations() == 3 && {
            let is_second = |c: &Channel| {
                *c == Channel { limits: c.limits, ..Channel::rotation(joint.rotation_order[1]) }
            };
            let slot = joint.channels.iter().position(is_second).unwrap();
            pose[skeleton.dofs(j).start + slot].cos().abs() < 1e-2
        };
        for dof in skeleton.dofs(j).filter(|_| !is_near_pole) {
            assert!(
                turns(dof) < 1e-6,
                "{} came back as {}, was {}",
                skeleton.dof_names()[dof],
                back[dof],
                pose[dof]
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_pose_of_the_cmu_skeleton_comes_back(seed: u64) {
        let motion = walk();
        let channels = Parametrisation::channels(motion.skeleton());
        let pose = Numbers::new(seed).coordinates(&channels, motion.skeleton().num_dofs());
        for (_, parametrisation) in parametrisations(&motion) {
            check_round_trip(motion.skeleton(), &parametrisation, &pose, 1e-7);
        }
    }

    #[test]
    fn poses_at_gimbal_poles_come_back(seed: u64) {
        let motion = walk();
        let channels = Parametrisation::channels(motion.skeleton());
        let pose = Numbers::new(seed).awkward(motion.skeleton(), &channels);
        for (_, parametrisation) in parametrisations(&motion) {
            check_round_trip(motion.skeleton(), &parametrisation, &pose, 1e-6);
        }
    }

    #[test]
    fn any_pose_of_a_bvh_rig_comes_back(seed: u64) {
        let rig = bvh_rig();
        let mut numbers = Numbers::new(seed);
        let channels = Parametrisation::channels(&rig);
        let reference = numbers.coordinates(&channels, rig.num_dofs());
        let smooth = Parametrisation::smooth(&rig, &references_at(&rig, &reference)).unwrap();
        let pose = numbers.coordinates(&channels, rig.num_dofs());
        check_round_trip(&rig, &smooth, &pose, 1e-7);
        check_round_trip(&rig, &smooth, &numbers.awkward(&rig, &channels), 1e-6);
    }

    #[test]
    fn wrapping_moves_nothing_and_brings_angles_near_their_reference(seed: u64) {
        let motion = walk();
        let skeleton = motion.skeleton();
        for (name, parametrisation) in parametrisations(&motion) {
            let mut numbers = Numbers::new(seed);
            let mut x: Vec<f64> = (0..skeleton.num_dofs()).map(|_| 9.0 * numbers.next()).collect();
            let kinematics = Kinematics::new(skeleton, parametrisation.clone());
            let (mut before, mut after) = (kinematics.state(), kinematics.state());
            kinematics.update(&x, &mut before);
            parametrisation.wrap(&mut x);
            kinematics.update(&x, &mut after);
            let (worst, joint) = difference(skeleton, &before, &after);
            prop_assert!(worst < 1e-9, "{name}: {joint} moved by {worst}");
            if name == "channels" {
                continue;
            }
            let centre = |dof: usize| if name == "smooth about rest" { 0.0 } else { motion.pose(60)[dof] };
            for (j, joint) in skeleton.joints().iter().enumerate().skip(1) {
                let dofs = skeleton.dofs(j);
                if joint.num_rotations() == 3 {
                    let length = x[dofs.end - 3..dofs.end].iter().map(|v| v * v).sum::<f64>().sqrt();
                    prop_assert!(length <= PI + 1e-9, "{} is turned by {length}", joint.name);
                    continue;
                }
                for dof in dofs {
                    prop_assert!((x[dof] - centre(dof)).abs() <= PI + 1e-9, "{}", skeleton.dof_names()[dof]);
                }
            }
            // Wrapped coordinates stay as they are.
            let once = x.clone();
            parametrisation.wrap(&mut x);
            prop_assert!(once.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}

proptest! {
    #[test]
    fn coordinates_near_others_are_the_same_pose_and_never_farther(seed: u64) {
        let motion = walk();
        let skeleton = motion.skeleton();
        for (_, parametrisation) in parametrisations(&motion) {
            let mut numbers = Numbers::new(seed);
            let mut draw = || numbers.coordinates(&parametrisation, skeleton.num_dofs());
            let (mut x, near) = (draw(), draw());
            let kinematics = Kinematics::new(skeleton, parametrisation.clone());
            let (mut before, mut after) = (kinematics.state(), kinematics.state());
            let distance = |x: &[f64]| x.iter().zip(&near).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            kinematics.update(&x, &mut before);
            let far = distance(&x);
            parametrisation.unwrap_near(&mut x, &near);
            kinematics.update(&x, &mut after);
            let (worst, joint) = difference(skeleton, &before, &after);
            prop_assert!(worst < 1e-9, "{joint} moved by {worst}");
            prop_assert!(distance(&x) <= far + 1e-9);
        }
    }
}

#[test]
fn every_pose_of_drawn_motion_comes_back() {
    let motion = walk();
    for (_, parametrisation) in parametrisations(&motion) {
        for pose in motion.poses() {
            check_round_trip(motion.skeleton(), &parametrisation, pose, 1e-7);
        }
    }
}

#[test]
fn every_pose_of_recorded_motion_comes_back() {
    let test = "every_pose_of_recorded_motion_comes_back";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    for trial in ["16_15", "35_17", "35_01", "64_01", "91_29"] {
        if !folder.join(format!("{trial}.amc.zst")).exists() {
            continue;
        }
        let motion = testkit::shared::trial(&folder, trial);
        for (_, parametrisation) in parametrisations(&motion) {
            for pose in motion.poses() {
                check_round_trip(motion.skeleton(), &parametrisation, pose, 1e-6);
            }
        }
    }
}

/// Smooth coordinates exist so that nothing jumps: a pose that turns on and on through the poles moves evenly.
#[test]
fn smooth_coordinates_of_a_turning_person_do_not_jump() {
    let motion = walk();
    let skeleton = motion.skeleton();
    let channels = Parametrisation::channels(skeleton);
    let smooth = Parametrisation::smooth(skeleton, &References::rest(skeleton)).unwrap();
    let (mut x, mut pose, mut last) = (vec![0.0; 62], motion.pose(0).to_vec(), Vec::<f64>::new());
    smooth.coordinates_from_pose(skeleton, motion.pose(0), 0.0, &mut x);
    let mut heading = x[kinematics::HEADING];
    let steps = 500;
    for step in 0..steps {
        let mut turned = x.clone();
        turned[kinematics::HEADING] = 5.0 * TAU * step as f64 / steps as f64;
        let previous = pose.clone();
        smooth.pose_from_coordinates(skeleton, &turned, Some(&previous), &mut pose);
        let mut found = vec![0.0; 62];
        smooth.coordinates_from_pose(skeleton, &pose, heading, &mut found);
        heading = found[kinematics::HEADING];
        for (dof, (a, b)) in last.iter().zip(&found).enumerate() {
            assert!((a - b).abs() < 0.07, "{} jumped from {a} to {b}", skeleton.dof_names()[dof]);
        }
        // The channels do not jump by more than a pole makes them.
        assert!(previous.iter().zip(&pose).all(|(a, b)| (a - b).abs() < 4.0));
        last = found;
    }
    assert!(channels.is_angle(5) && !channels.is_angle(2));
}

#[test]
fn a_root_that_is_not_free_is_refused_by_name() {
    let root = Joint::root("Hips", vec![Channel::translation(Axis::X), Channel::rotation(Axis::Y)]);
    let skeleton = Skeleton::new("stuck", vec![root]).unwrap();
    let error = Parametrisation::smooth(&skeleton, &References::rest(&skeleton)).unwrap_err();
    assert!(matches!(error, Error::RootNotFree { .. }));
    assert_eq!(
        error.to_string(),
        "root Hips has channels tx ry, expected three translations and three rotations"
    );
}
