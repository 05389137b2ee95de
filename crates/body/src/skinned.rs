//! A body for writers of glTF: rest mesh, skeleton and skin; poses as an animation.

use formats::glb::{Animation, Joint, SkinnedMesh};
use nalgebra::UnitQuaternion;

use crate::skin::WHOLE;
use crate::{BodyModel, Posed, Shape};

impl BodyModel {
    /// A shape at rest with its skeleton and skin.
    pub fn skinned(&self, shape: &Shape) -> SkinnedMesh {
        let mesh = shape.mesh(self);
        let joint = |(joint, rest)| {
            let joint: &crate::RigJoint = joint;
            Joint { name: joint.name.clone(), parent: joint.parent, rest_position: rest }
        };
        SkinnedMesh {
            normals: mesh.normals(),
            mesh,
            joints: self.rig.joints().iter().zip(shape.joints.iter().copied()).map(joint).collect(),
            joint_indices: self.skin.joints().to_vec(),
            weights: self
                .skin
                .weights()
                .iter()
                .map(|weights| weights.map(|weight| f32::from(weight) / f32::from(WHOLE)))
                .collect(),
        }
    }

    /// Poses of a shape as an animation of its [`skinned`](Self::skinned) mesh.
    ///
    /// # Panics
    /// If a pose has not as many numbers as the rig has DOFs.
    pub fn animation(&self, shape: &Shape, poses: &[Vec<f64>], frame_rate: f64) -> Animation {
        let mut posed = Posed::default();
        let (mut rotations, mut translations) = (Vec::new(), Vec::new());
        for pose in poses {
            shape.pose_joints(self, pose, &mut posed);
            translations.push(posed.joints[0]);
            for joint in 0..self.rig.num_joints() {
                rotations.push(UnitQuaternion::from_rotation_matrix(&posed.parent_from_joint(self, joint)));
            }
        }
        Animation {
            times: (0..poses.len()).map(|f| f as f64 / frame_rate).collect(),
            rotations,
            translations,
        }
    }
}
