//! The whole body through the same solver.

use body::{BodyModel, Posed};
use inverse_kinematics::rig::RigChain;
use inverse_kinematics::{Evidence, Options, Solver};
use nalgebra::Vector3;

fn pose(model: &BodyModel) -> Vec<f64> {
    let mut pose = vec![0.0; model.rig().num_dofs()];
    pose[..6].copy_from_slice(&[0.2, 0.1, -0.3, 0.1, 0.9, -0.2]);
    for (d, dof) in model.rig().dofs().iter().enumerate().skip(6) {
        let [low, high] = dof.limits.unwrap();
        pose[d] = low + (high - low) * (0.35 + 0.3 * (d % 3) as f64 / 2.0);
    }
    pose
}

fn posed(model: &BodyModel, pose: &[f64]) -> Vec<Vector3<f64>> {
    let mut posed = Posed::default();
    model.shape(&[]).pose_joints(model, pose, &mut posed);
    posed.joints
}

#[test]
fn a_chain_of_a_rig_puts_joints_where_the_body_does() {
    let model = BodyModel::shipped();
    let rig = RigChain::new(&model, &model.shape(&[])).unwrap();
    let (pose, chain) = (pose(&model), &rig.chain);
    let mut x = vec![0.0; chain.num_dofs()];
    rig.coordinates(&pose, &mut x);
    let mut positions = vec![Vector3::zeros(); chain.points().len()];
    chain.points().positions(chain.kinematics(), &x, &mut chain.kinematics().state(), &mut positions);
    for ((found, expected), joint) in positions.iter().zip(posed(&model, &pose)).zip(model.rig().joints()) {
        assert!((found - expected).norm() < 1e-9, "{}: {found} {expected}", joint.name);
    }
    let mut again = vec![0.0; pose.len()];
    rig.pose(&x, &mut again);
    assert!(pose.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-9), "{pose:?} {again:?}");
}

#[test]
fn hands_feet_head_and_hips_move_the_whole_body() {
    let model = BodyModel::shipped();
    let rig = RigChain::new(&model, &model.shape(&[])).unwrap();
    let truth = pose(&model);
    let joints = posed(&model, &truth);
    let names = ["l_wrist", "r_wrist", "l_ankle", "r_ankle", "l_hip", "r_hip", "head"];
    let pursued = names.map(|name| model.rig().joint_index(name).unwrap());
    let mut solver =
        Solver::new(rig.chain.clone(), Options { steps: 100, ..Options::reach(&pursued) }).unwrap();
    // from the rest pose, facing roughly the right way
    let mut start = vec![0.0; truth.len()];
    start[4] = 0.6;
    let mut x = vec![0.0; rig.chain.num_dofs()];
    rig.coordinates(&start, &mut x);
    let posture = x.clone();
    let mut targets = vec![None; rig.chain.points().len()];
    for joint in pursued {
        targets[joint] = Some(joints[joint]);
    }
    let outcome =
        solver.solve(&mut x, &Evidence { targets: &targets, views: &[], posture: &posture }).unwrap();
    println!("{outcome:?}");
    assert!(outcome.residual_m < 0.005, "{outcome:?}");
    for (value, [low, high]) in x.iter().zip(rig.chain.limits()) {
        assert!((low..=high).contains(&value));
    }
}
