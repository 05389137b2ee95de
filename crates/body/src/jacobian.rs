//! Derivatives of posed vertices and joints, analytic.
//!
//! An angle turns everything that hangs from its joint about the DOF's axis through the joint: `∂p/∂θ = ω × (p − c)`. Of a
//! skinned vertex only the joints below that DOF count: `∂v/∂θ = Σ w_k ω × (A_k v − c)`. A coefficient of the shape moves a
//! vertex through the rest vertex and through the rest joints, which shift all bones below them ([`ShapeDrift`]).

use nalgebra::Vector3;

use crate::{BodyModel, Posed, Shape};

/// How the bones of a posed body shift with its shape: derivatives of the translations of `world_from_rest`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShapeDrift {
    /// metres for one standard deviation, shape `[joints, components]`
    shifts: Vec<Vector3<f64>>,
}

impl ShapeDrift {
    /// Fills it for a body posed by [`Shape::pose`] or one of its like; takes no memory after the first time.
    pub fn update(&mut self, model: &BodyModel, posed: &Posed) {
        let components = model.num_components();
        self.shifts.clear();
        self.shifts.resize(components * model.rig.num_joints(), Vector3::zeros());
        for (joint, world_from_rest) in posed.world_from_rest.iter().enumerate() {
            let rotation = world_from_rest.rotation;
            let parent = model.rig.joints()[joint].parent;
            for i in 0..components {
                let moved = model.joint_components[i][joint];
                // τ_j = τ_p + Q_p h_j − Q_j h_j
                let before = match parent {
                    None => moved,
                    Some(p) => self.shifts[p * components + i] + posed.world_from_rest[p].rotation * moved,
                };
                self.shifts[joint * components + i] = before - rotation * moved;
            }
        }
    }

    fn at_joint(&self, joint: usize, components: usize) -> &[Vector3<f64>] {
        &self.shifts[joint * components..(joint + 1) * components]
    }
}

impl Posed {
    /// Derivative of a posed vertex with respect to the pose, metres per metre or radian, shape `[dofs]`. The vertex need
    /// not be among those that were posed.
    pub fn vertex_by_pose(&self, model: &BodyModel, shape: &Shape, vertex: usize, out: &mut [Vector3<f64>]) {
        out.fill(Vector3::zeros());
        let rest = &shape.vertices[vertex];
        for (joint, weight) in model.skin.influences(vertex) {
            let world_from_rest = &self.world_from_rest[joint];
            let point = world_from_rest.rotation * rest + world_from_rest.translation.vector;
            self.add_by_pose(model, joint, &point, weight, out);
        }
    }

    /// Derivative of a joint's position with respect to the pose, metres per metre or radian, shape `[dofs]`.
    pub fn joint_by_pose(&self, model: &BodyModel, joint: usize, out: &mut [Vector3<f64>]) {
        out.fill(Vector3::zeros());
        self.add_by_pose(model, joint, &self.joints[joint], 1.0, out);
    }

    /// Derivative of a posed vertex with respect to the shape, metres for one standard deviation, shape `[components]`.
    pub fn vertex_by_shape(
        &self,
        model: &BodyModel,
        drift: &ShapeDrift,
        vertex: usize,
        out: &mut [Vector3<f64>],
    ) {
        out.fill(Vector3::zeros());
        let components = model.num_components();
        let mut blend = nalgebra::Matrix3::zeros();
        for (joint, weight) in model.skin.influences(vertex) {
            blend += self.world_from_rest[joint].rotation.matrix() * weight;
            for (out, shift) in out.iter_mut().zip(drift.at_joint(joint, components)) {
                *out += shift * weight;
            }
        }
        for (out, component) in out.iter_mut().zip(&model.components) {
            *out += blend * component.displacement(vertex);
        }
    }

    /// Derivative of a joint's position with respect to the shape, metres for one standard deviation, shape `[components]`.
    pub fn joint_by_shape(
        &self,
        model: &BodyModel,
        drift: &ShapeDrift,
        joint: usize,
        out: &mut [Vector3<f64>],
    ) {
        let rotation = self.world_from_rest[joint].rotation;
        let shifts = drift.at_joint(joint, model.num_components());
        for ((out, shift), moved) in out.iter_mut().zip(shifts).zip(&model.joint_components) {
            *out = shift + rotation * moved[joint];
        }
    }

    /// Adds `weight` times the derivative of a point that is fixed to a joint's bone.
    fn add_by_pose(
        &self,
        model: &BodyModel,
        joint: usize,
        point: &Vector3<f64>,
        weight: f64,
        out: &mut [Vector3<f64>],
    ) {
        let mut left = model.rig.moved_by(joint);
        while left != 0 {
            let d = left.trailing_zeros() as usize;
            left &= left - 1;
            out[d] += if d < 3 {
                self.dof_axes[d] * weight
            } else {
                let pivot = self.joints[model.rig.dofs()[d].joint];
                self.dof_axes[d].cross(&(point - pivot)) * weight
            };
        }
    }
}
