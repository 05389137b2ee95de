//! A body as GLB: the mesh at rest, its skeleton and skin, and poses as an animation.

use formats::glb::{Animation, Joint, SkinnedMesh};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{BodyModel, Error, Posed, Result, Shape};

/// Poses of a body, one a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poses<'a> {
    /// shape `[frames, dofs]`
    pub poses: &'a [Vec<f64>],
    /// frames a second
    pub frame_rate: f64,
}

/// A body with skeleton and skin, and with its motion if poses are given; the first pose is the frame at 0 s.
///
/// # Errors
/// [`Error::Glb`] if a pose is not finite.
///
/// # Panics
/// If shape or poses are of another model.
pub fn glb(model: &BodyModel, shape: &Shape, poses: Option<Poses<'_>>) -> Result<Vec<u8>> {
    let mesh = shape.mesh(model);
    let joints = model.rig().joints().iter().zip(&shape.joints);
    let skin = model.skin();
    let skinned = SkinnedMesh {
        normals: mesh.normals(),
        mesh,
        joints: joints
            .map(|(joint, rest)| Joint {
                name: joint.name.clone(),
                parent: joint.parent,
                rest_position: *rest,
            })
            .collect(),
        joint_indices: skin.joints().to_vec(),
        weights: skin
            .weights()
            .iter()
            .map(|weights| weights.map(|w| f32::from(w) / f32::from(u16::MAX)))
            .collect(),
    };
    let animation = poses.map(|poses| animation(model, shape, poses));
    formats::glb::write_skinned("body", &skinned, animation.as_ref()).map_err(Error::Glb)
}

fn animation(model: &BodyModel, shape: &Shape, poses: Poses<'_>) -> Animation {
    let mut posed = Posed::default();
    let mut animation = Animation { times: Vec::new(), rotations: Vec::new(), translations: Vec::new() };
    for (frame, pose) in poses.poses.iter().enumerate() {
        shape.pose_joints(model, pose, &mut posed);
        animation.times.push(frame as f64 / poses.frame_rate);
        animation.translations.push(posed.joints.first().copied().unwrap_or_else(Vector3::zeros));
        for (index, joint) in model.rig().joints().iter().enumerate() {
            let world = posed.world_from_rest[index].rotation;
            let local = match joint.parent {
                None => world,
                Some(parent) => posed.world_from_rest[parent].rotation.inverse() * world,
            };
            animation.rotations.push(UnitQuaternion::from_rotation_matrix(&local));
        }
    }
    animation
}
