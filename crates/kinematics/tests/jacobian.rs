//! The analytic Jacobian against central differences, coordinate by coordinate.

mod fixtures;

use fixtures::{Numbers, bvh_rig, parametrisations, walk};
use kinematics::{
    ControlPoint, Kinematics, Parametrisation, PointSet, References, check_jacobian, control_points,
};
use model::Skeleton;
use nalgebra::Vector3;

const SIX: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];

/// The tip of every bone, every joint, and a point beside each.
fn everywhere(skeleton: &Skeleton) -> Vec<ControlPoint> {
    let joints = skeleton.joints().iter().enumerate();
    let points = joints.flat_map(|(joint, j)| {
        [j.tip, Vector3::zeros(), Vector3::new(0.05, -0.1, 0.02)].map(|offset| ControlPoint {
            name: format!("{} {offset:?}", j.name),
            joint,
            offset,
        })
    });
    points.collect()
}

fn check(skeleton: &Skeleton, parametrisation: &Parametrisation, points: Vec<ControlPoint>, x: &[f64]) {
    let kinematics = Kinematics::new(skeleton, parametrisation.clone());
    let points = PointSet::new(&kinematics, points);
    let rows = 3 * points.len();
    let mut state = kinematics.state();
    let mut positions = vec![Vector3::zeros(); points.len()];
    // Stale numbers must not survive in the places that no coordinate moves.
    let mut jacobian = vec![f64::NAN; rows * kinematics.num_dofs()];
    points.positions(&kinematics, x, &mut state, &mut positions);
    points.jacobian(&kinematics, &state, &positions, &mut jacobian);
    let function = |x: &[f64], out: &mut [f64]| {
        points.positions(&kinematics, x, &mut state, &mut positions);
        for (out, p) in out.chunks_exact_mut(3).zip(&positions) {
            out.copy_from_slice(p.as_slice());
        }
    };
    if let Err(wrong) = check_jacobian(x, rows, &jacobian, 1e-7, function) {
        panic!("{wrong} ({:?})", skeleton.dof_names());
    }
}

#[test]
fn six_points_move_as_their_jacobian_says_in_every_coordinate() {
    let motion = walk();
    let skeleton = motion.skeleton();
    let six = control_points(skeleton, &SIX).unwrap();
    for (_, parametrisation) in parametrisations(&motion) {
        let mut numbers = Numbers::new(1);
        for _ in 0..60 {
            let x = numbers.coordinates(&parametrisation, skeleton.num_dofs());
            check(skeleton, &parametrisation, six.clone(), &x);
        }
    }
}

#[test]
fn every_point_moves_as_its_jacobian_says_at_gimbal_poles_and_half_turns() {
    let motion = walk();
    let skeleton = motion.skeleton();
    for (_, parametrisation) in parametrisations(&motion) {
        let mut numbers = Numbers::new(2);
        for _ in 0..12 {
            let x = numbers.awkward(skeleton, &parametrisation);
            check(skeleton, &parametrisation, everywhere(skeleton), &x);
        }
        // Rotation vectors of length 0, and so short that the series takes over from the closed form.
        for length in [0.0, 1e-9, 9.9e-5, 1.01e-4] {
            let x = vec![length / 3f64.sqrt(); skeleton.num_dofs()];
            check(skeleton, &parametrisation, everywhere(skeleton), &x);
        }
    }
}

#[test]
fn poses_of_a_walk_move_as_their_jacobian_says() {
    let motion = walk();
    let skeleton = motion.skeleton();
    let six = control_points(skeleton, &SIX).unwrap();
    let mut x = vec![0.0; skeleton.num_dofs()];
    for (_, parametrisation) in parametrisations(&motion) {
        for pose in motion.poses().step_by(10) {
            parametrisation.coordinates_from_pose(skeleton, pose, 0.0, &mut x);
            check(skeleton, &parametrisation, six.clone(), &x);
        }
    }
}

#[test]
fn translations_on_inner_joints_move_their_points() {
    let rig = bvh_rig();
    let smooth = Parametrisation::smooth(&rig, &References::rest(&rig)).unwrap();
    for parametrisation in [Parametrisation::channels(&rig), smooth] {
        let mut numbers = Numbers::new(3);
        for _ in 0..60 {
            let x = numbers.coordinates(&parametrisation, rig.num_dofs());
            check(&rig, &parametrisation, everywhere(&rig), &x);
            let x = numbers.awkward(&rig, &parametrisation);
            check(&rig, &parametrisation, everywhere(&rig), &x);
        }
    }
}

#[test]
fn a_wrong_jacobian_is_found_out_by_name() {
    let function = |x: &[f64], out: &mut [f64]| out[0] = x[0] * x[1];
    assert_eq!(check_jacobian(&[2.0, 3.0], 1, &[3.0, 2.0], 1e-6, function), Ok(()));
    let message = check_jacobian(&[2.0, 3.0], 1, &[3.0, f64::NAN], 1e-6, function).unwrap_err();
    assert!(message.starts_with("row 0, coordinate 1: analytic NaN"), "{message}");
}
