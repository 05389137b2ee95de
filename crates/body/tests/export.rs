//! The shipped model as motion and as glTF.

use body::{BodyModel, Posed};
use nalgebra::{Isometry3, Translation3, Vector3};

fn poses(model: &BodyModel) -> Vec<Vec<f64>> {
    let pose =
        |f: usize| (0..model.rig().num_dofs()).map(|d| 0.02 * f as f64 * (d as f64 + 1.0).sin()).collect();
    (0..30).map(pose).collect()
}

#[test]
fn a_motion_puts_the_joints_where_the_poses_put_them() {
    let model = BodyModel::shipped();
    let shape = model.shape(&[0.3]);
    let motion = model.motion(&shape, &poses(&model), 30.0).unwrap();
    let skeleton = motion.skeleton();
    let kinematics = kinematics::Kinematics::new(skeleton, kinematics::Parametrisation::channels(skeleton));
    let (mut state, mut posed) = (kinematics.state(), Posed::default());
    for (values, pose) in motion.poses().zip(poses(&model)) {
        kinematics.update(values, &mut state);
        shape.pose_joints(&model, &pose, &mut posed);
        for (joint, expected) in posed.joints.iter().enumerate() {
            assert!((state.point(joint, &Vector3::zeros()) - expected).norm() < 1e-9, "joint {joint}");
        }
    }
    let bvh = formats::bvh::write(&motion);
    assert!(bvh.contains("JOINT l_elbow"), "a writer takes it");
}

#[test]
fn an_animation_puts_the_joints_where_the_poses_put_them() {
    let model = BodyModel::shipped();
    let (shape, poses) = (model.shape(&[0.3]), poses(&model));
    let (skinned, animation) = (model.skinned(&shape), model.animation(&shape, &poses, 30.0));
    let joints = skinned.joints.len();
    let mut posed = Posed::default();
    for (frame, pose) in poses.iter().enumerate() {
        shape.pose_joints(&model, pose, &mut posed);
        let mut world: Vec<Isometry3<f64>> = Vec::new();
        for (index, joint) in skinned.joints.iter().enumerate() {
            let rotation = animation.rotations[frame * joints + index];
            world.push(match joint.parent {
                None => Isometry3::from_parts(Translation3::from(animation.translations[frame]), rotation),
                Some(parent) => {
                    let offset = joint.rest_position - skinned.joints[parent].rest_position;
                    world[parent] * Isometry3::from_parts(Translation3::from(offset), rotation)
                }
            });
            assert!((world[index].translation.vector - posed.joints[index]).norm() < 1e-9, "joint {index}");
        }
    }
    let glb = formats::glb::write_skinned("body", &skinned, Some(&animation)).unwrap();
    assert!(glb.starts_with(b"glTF"));
}
