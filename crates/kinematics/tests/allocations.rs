//! The inner loop of a reconstruction takes no memory.

mod fixtures;

use fixtures::{Numbers, parametrisations, walk};
use kinematics::{Kinematics, PointSet, control_points};
use nalgebra::Vector3;

#[test]
fn kinematics_and_jacobian_take_no_memory() {
    let motion = walk();
    let skeleton = motion.skeleton();
    let names = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
    for (name, parametrisation) in parametrisations(&motion) {
        let kinematics = Kinematics::new(skeleton, parametrisation.clone());
        let points = PointSet::new(&kinematics, control_points(skeleton, &names).unwrap());
        let mut x = Numbers::new(1).coordinates(&parametrisation, skeleton.num_dofs());
        let mut pose = vec![0.0; x.len()];
        let mut state = kinematics.state();
        let mut positions = vec![Vector3::zeros(); points.len()];
        let mut jacobian = vec![0.0; 3 * points.len() * x.len()];
        let counted = allocation_counter::measure(|| {
            kinematics.update(&x, &mut state);
            points.positions(&kinematics, &x, &mut state, &mut positions);
            points.jacobian(&kinematics, &state, &positions, &mut jacobian);
            parametrisation.wrap(&mut x);
            parametrisation.pose_from_coordinates(skeleton, &x, None, &mut pose);
            parametrisation.coordinates_from_pose(skeleton, &pose, 0.0, &mut x);
        });
        assert_eq!(counted.count_total, 0, "{name}: {counted:?}");
    }
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocation_counter::measure(|| drop(std::hint::black_box(vec![0.0; 9]))).count_total, 1);
}
