//! A body's joints as a skeleton, and its poses as a motion: what writers of motion files take.

use std::sync::Arc;

use kinematics::angles_from_rotation;
use model::{Axis, Channel, Joint, Motion, Skeleton};
use nalgebra::Vector3;

use crate::{BodyModel, Posed, Result, Shape};

/// Axes of a joint's rotations, leftmost first: what is nearest to a gimbal pole is the turn about x at 90°, which no joint
/// of a body at rest has.
const ORDER: [Axis; 3] = [Axis::Z, Axis::X, Axis::Y];

impl BodyModel {
    /// The joints of a shape as a skeleton: offsets as at rest, three rotations a joint, and translations of the root. In
    /// its zero pose the body stands at rest with the root at the origin.
    ///
    /// # Errors
    /// [`crate::Error::Motion`] if the rig is none that a skeleton can be.
    pub fn skeleton(&self, shape: &Shape) -> Result<Skeleton> {
        let mut joints = Vec::new();
        for (index, joint) in self.rig.joints().iter().enumerate() {
            let rotations = ORDER.map(Channel::rotation);
            joints.push(match joint.parent {
                None => {
                    let translations = [Axis::X, Axis::Y, Axis::Z].map(Channel::translation);
                    Joint::root(&joint.name, translations.into_iter().chain(rotations).collect())
                }
                Some(parent) => {
                    let offset = shape.joints[index] - shape.joints[parent];
                    Joint::child(&joint.name, parent, offset, rotations.to_vec())
                }
            });
        }
        for index in 0..joints.len() {
            let mut children = self.rig.joints().iter().enumerate().filter(|(_, j)| j.parent == Some(index));
            joints[index].tip = match (children.next(), joints[index].parent) {
                (Some((child, _)), _) => joints[child].offset,
                // The last bone of a chain goes on as the one before it, at half its length.
                (None, Some(_)) => joints[index].offset * 0.5,
                (None, None) => Vector3::zeros(),
            };
        }
        Ok(Skeleton::new("body", joints)?)
    }

    /// Poses of one shape as a motion on its [`skeleton`](Self::skeleton); angles run on smoothly from frame to frame.
    ///
    /// # Errors
    /// [`crate::Error::Motion`] if the frame rate is not positive or a pose is not finite.
    ///
    /// # Panics
    /// If a pose has not as many numbers as the rig has DOFs.
    pub fn motion(&self, shape: &Shape, poses: &[Vec<f64>], frame_rate: f64) -> Result<Motion> {
        let skeleton = Arc::new(self.skeleton(shape)?);
        let mut posed = Posed::default();
        let mut before = vec![[0.0; 3]; self.rig.num_joints()];
        let mut values = Vec::with_capacity(poses.len() * skeleton.num_dofs());
        for pose in poses {
            shape.pose_joints(self, pose, &mut posed);
            for (index, joint) in self.rig.joints().iter().enumerate() {
                if joint.parent.is_none() {
                    values.extend(posed.joints[index].iter());
                }
                let rotation = posed.parent_from_joint(self, index);
                before[index] = angles_from_rotation(ORDER, rotation.matrix(), before[index]);
                values.extend(before[index]);
            }
        }
        Ok(Motion::new(skeleton, frame_rate, values)?)
    }
}
