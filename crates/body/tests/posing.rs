//! Posing and its derivatives, on the shipped model.

use body::{BodyModel, Limb, Posed, Shape, ShapeDrift};
use kinematics::check_jacobian;
use nalgebra::{Matrix4, Rotation3, Unit, Vector3};

/// A pose with every number different from 0.
fn pose(model: &BodyModel) -> Vec<f64> {
    (0..model.rig().num_dofs()).map(|d| 0.15 + 0.4 * (d as f64 * 1.7).sin()).collect()
}

/// `A_j` by homogeneous matrices, straight from the convention of `rig.json`.
fn transforms(model: &BodyModel, shape: &Shape, pose: &[f64]) -> Vec<Matrix4<f64>> {
    let mut all: Vec<Matrix4<f64>> = Vec::new();
    for (j, joint) in model.rig().joints().iter().enumerate() {
        let h = shape.joints[j];
        let mut rotation = Matrix4::identity();
        if j == 0 {
            rotation = Rotation3::new(Vector3::new(pose[3], pose[4], pose[5])).to_homogeneous();
        } else {
            for (d, dof) in model.rig().dofs().iter().enumerate().filter(|(_, dof)| dof.joint == j) {
                let axis = Unit::new_normalize(dof.axis);
                rotation *= Rotation3::from_axis_angle(&axis, pose[d]).to_homogeneous();
            }
        }
        let about = Matrix4::new_translation(&h) * rotation * Matrix4::new_translation(&-h);
        all.push(match joint.parent {
            None => Matrix4::new_translation(&Vector3::new(pose[0], pose[1], pose[2])) * about,
            Some(parent) => all[parent] * about,
        });
    }
    all
}

#[test]
fn posing_follows_the_convention_of_the_rig() {
    let model = BodyModel::shipped();
    let (shape, pose) = (model.shape(&[0.5, -1.0]), pose(&model));
    let mut posed = Posed::default();
    shape.pose(&model, &pose, &mut posed);
    let transforms = transforms(&model, &shape, &pose);
    for (j, transform) in transforms.iter().enumerate() {
        assert!((posed.world_from_rest[j].to_homogeneous() - transform).norm() < 1e-9, "joint {j}");
        let position = transform.transform_point(&shape.joints[j].into()).coords;
        assert!((posed.joints[j] - position).norm() < 1e-9, "joint {j}");
    }
    for (v, rest) in shape.vertices.iter().enumerate() {
        let blended: Vector3<f64> = model
            .skin()
            .influences(v)
            .map(|(joint, weight)| transforms[joint].transform_point(&(*rest).into()).coords * weight)
            .sum();
        assert!((posed.vertices[v] - blended).norm() < 1e-9, "vertex {v}");
    }
    let some = [6499, 3, 1200];
    let mut few = Posed::default();
    shape.pose_vertices(&model, &pose, &some, &mut few);
    assert_eq!(few.vertices, some.map(|v| posed.vertices[v as usize]));
    assert_eq!(few.joints, posed.joints);
}

#[test]
fn at_rest_nothing_moves() {
    let model = BodyModel::shipped();
    let shape = model.shape(&[1.0, 2.0, -1.0]);
    let mut posed = Posed::default();
    shape.pose(&model, &vec![0.0; model.rig().num_dofs()], &mut posed);
    for (v, rest) in posed.vertices.iter().zip(&shape.vertices) {
        assert!((v - rest).norm() < 1e-12);
    }
}

#[test]
fn derivatives_by_the_pose_are_those_of_differences() {
    let model = BodyModel::shipped();
    let (shape, pose) = (model.shape(&[0.5, -1.0, 0.7]), pose(&model));
    let vertices: Vec<u32> = (0..model.num_vertices() as u32).step_by(97).collect();
    let joints = model.rig().num_joints();
    let mut posed = Posed::default();
    shape.pose_joints(&model, &pose, &mut posed);
    let mut jacobian = Vec::new();
    let mut columns = vec![Vector3::zeros(); pose.len()];
    for &vertex in &vertices {
        posed.vertex_by_pose(&model, &shape, vertex as usize, &mut columns);
        (0..3).for_each(|axis| jacobian.extend(columns.iter().map(|c| c[axis])));
    }
    for joint in 0..joints {
        posed.joint_by_pose(&model, joint, &mut columns);
        (0..3).for_each(|axis| jacobian.extend(columns.iter().map(|c| c[axis])));
    }
    let rows = 3 * (vertices.len() + joints);
    check_jacobian(&pose, rows, &jacobian, 1e-7, |pose, out| {
        shape.pose_vertices(&model, pose, &vertices, &mut posed);
        for (out, point) in
            out.as_chunks_mut::<3>().0.iter_mut().zip(posed.vertices.iter().chain(&posed.joints))
        {
            *out = (*point).into();
        }
    })
    .unwrap();
}

#[test]
fn derivatives_by_the_shape_are_those_of_differences() {
    let model = BodyModel::shipped();
    let pose = pose(&model);
    let alpha: Vec<f64> = (0..model.num_components()).map(|i| (i as f64 + 0.5).sin()).collect();
    let vertices: Vec<u32> = (0..model.num_vertices() as u32).step_by(97).collect();
    let joints = model.rig().num_joints();
    let mut posed = Posed::default();
    model.shape(&alpha).pose_joints(&model, &pose, &mut posed);
    let mut drift = ShapeDrift::default();
    drift.update(&model, &posed);
    let mut jacobian = Vec::new();
    let mut columns = vec![Vector3::zeros(); alpha.len()];
    for &vertex in &vertices {
        posed.vertex_by_shape(&model, &drift, vertex as usize, &mut columns);
        (0..3).for_each(|axis| jacobian.extend(columns.iter().map(|c| c[axis])));
    }
    for joint in 0..joints {
        posed.joint_by_shape(&model, &drift, joint, &mut columns);
        (0..3).for_each(|axis| jacobian.extend(columns.iter().map(|c| c[axis])));
    }
    let rows = 3 * (vertices.len() + joints);
    check_jacobian(&alpha, rows, &jacobian, 1e-7, |alpha, out| {
        model.shape(alpha).pose_vertices(&model, &pose, &vertices, &mut posed);
        for (out, point) in
            out.as_chunks_mut::<3>().0.iter_mut().zip(posed.vertices.iter().chain(&posed.joints))
        {
            *out = (*point).into();
        }
    })
    .unwrap();
}

#[test]
fn every_limb_has_its_vertices_on_its_side() {
    let model = BodyModel::shipped();
    for limb in Limb::ALL {
        let limb_vertices =
            || model.limbs().iter().zip(model.mean()).filter(|(l, _)| **l == limb).map(|(_, v)| v);
        assert!(limb_vertices().count() > 50, "{limb:?} has {} vertices", limb_vertices().count());
        let mean_x = limb_vertices().map(|v| v.x).sum::<f64>() / limb_vertices().count() as f64;
        let name = format!("{limb:?}");
        let side = if name.starts_with("Left") {
            1.0
        } else if name.starts_with("Right") {
            -1.0
        } else {
            0.0
        };
        assert!(if side == 0.0 { mean_x.abs() < 0.02 } else { mean_x * side > 0.05 }, "{limb:?}: {mean_x}");
    }
}

#[test]
fn posing_again_takes_no_memory() {
    let model = BodyModel::shipped();
    let (mut shape, pose) = (model.shape(&[0.5]), pose(&model));
    let (mut posed, mut drift) = (Posed::default(), ShapeDrift::default());
    let mut once = || {
        model.shape_into(&[0.1, 0.2], &mut shape);
        shape.pose(&model, &pose, &mut posed);
        drift.update(&model, &posed);
    };
    once();
    assert_eq!(allocation_counter::measure(once).count_total, 0);
}
