//! A morphable body's skeleton as a chain, so that the whole body is solved by the same code as a limb.

use body::{BodyModel, DofKind, ROOT_DOFS, Shape};
use kinematics::{
    Parametrisation, angles_from_rotation, control_points, rotation_exp, rotation_from_angles, rotation_log,
};
use model::{Axis, Channel, Joint, Skeleton};
use nalgebra::{Rotation3, Unit, Vector3};

use crate::{Chain, Result};

/// Order of the root's rotations: its pole is at 90° of tilt about x.
const ORDER: [Axis; 3] = [Axis::Y, Axis::X, Axis::Z];

/// The chain of a body and what its coordinates are in the body's pose.
///
/// The first six coordinates are the root's translation (metres) and its rotations about y, x, z; then come the rig's
/// angles, joint by joint, with the rig's limits. The points are the rig's joints, in its order; segments are its bones.
#[derive(Debug, Clone)]
pub struct RigChain {
    /// the chain
    pub chain: Chain,
    /// place of the root at rest, metres
    root: Vector3<f64>,
    /// the rig's DOF of each coordinate from the seventh on
    rig_dofs: Vec<usize>,
}

impl RigChain {
    /// The chain of one shape of a model.
    ///
    /// # Errors
    /// If the rig's joints are none that a skeleton can have.
    pub fn new(model: &BodyModel, shape: &Shape) -> Result<Self> {
        let rig = model.rig();
        let mut joints = Vec::<Joint>::new();
        // where what hangs from a rig's joint hangs in the skeleton
        let mut last = Vec::new();
        let mut limits = vec![[f64::NEG_INFINITY, f64::INFINITY]; ROOT_DOFS];
        let mut rig_dofs = Vec::new();
        for (index, joint) in rig.joints().iter().enumerate() {
            match joint.parent {
                None => {
                    let translations = [Axis::X, Axis::Y, Axis::Z].map(Channel::translation);
                    let rotations = ORDER.map(Channel::rotation);
                    joints
                        .push(Joint::root(&joint.name, translations.into_iter().chain(rotations).collect()));
                }
                Some(parent) => {
                    let offset = shape.joints[index] - shape.joints[parent];
                    joints.push(Joint::child(&joint.name, last[parent], offset, Vec::new()));
                }
            }
            for (d, dof) in rig.dofs().iter().enumerate() {
                if dof.joint != index || d < ROOT_DOFS || dof.kind == DofKind::Translation {
                    continue;
                }
                let parent = joints.len() - 1;
                let channel = vec![Channel::rotation(Axis::X)];
                let mut turned =
                    Joint::child(format!("turn:{}", dof.name), parent, Vector3::zeros(), channel);
                turned.axes = Rotation3::rotation_between(&Vector3::x(), &dof.axis).unwrap_or_else(|| {
                    Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::y()), std::f64::consts::PI)
                });
                joints.push(turned);
                limits.push(dof.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]));
                rig_dofs.push(d);
            }
            last.push(joints.len() - 1);
        }
        let skeleton = Skeleton::new("rig", joints)?;
        let names: Vec<_> = rig.joints().iter().map(|joint| joint.name.as_str()).collect();
        let points = control_points(&skeleton, &names)?;
        let bones = rig.joints().iter().enumerate();
        let segments = bones.filter_map(|(index, joint)| Some([joint.parent?, index])).collect();
        let chain = Chain::new(&skeleton, Parametrisation::channels(&skeleton), points)?
            .with_segments(segments)?
            .with_limits(limits)?;
        Ok(Self { chain, root: shape.joints[0], rig_dofs })
    }

    /// The body's pose (root translation, rotation vector, angles; shape `[dofs of the rig]`) of coordinates.
    pub fn pose(&self, x: &[f64], pose: &mut [f64]) {
        let rotation = rotation_from_angles(&ORDER, &[x[3], x[4], x[5]]);
        for axis in 0..3 {
            pose[axis] = x[axis] - self.root[axis];
        }
        pose[3..6].copy_from_slice(rotation_log(&rotation).as_slice());
        for (&dof, &value) in self.rig_dofs.iter().zip(&x[ROOT_DOFS..]) {
            pose[dof] = value;
        }
    }

    /// The coordinates of a body's pose: the inverse of [`pose`](Self::pose).
    pub fn coordinates(&self, pose: &[f64], x: &mut [f64]) {
        for axis in 0..3 {
            x[axis] = pose[axis] + self.root[axis];
        }
        let rotation = rotation_exp(&Vector3::new(pose[3], pose[4], pose[5]));
        x[3..6].copy_from_slice(&angles_from_rotation(ORDER, &rotation, [0.0; 3]));
        for (&dof, value) in self.rig_dofs.iter().zip(&mut x[ROOT_DOFS..]) {
            *value = pose[dof];
        }
    }
}
