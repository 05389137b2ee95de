use kinematics::{left_jacobian, rotation_exp};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Unit, Vector3};
use pulp::{Arch, Simd, WithSimd};

use crate::skin::{INFLUENCES, WHOLE};
use crate::{BodyModel, ROOT_DOFS, Rig, Shape};

/// A body in a pose. Made once, it is filled again and again without taking memory.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Posed {
    /// posed vertices, metres: all, or those that were asked for, in that order
    pub vertices: Vec<Vector3<f64>>,
    /// positions of the joints, metres, shape `[joints]`
    pub joints: Vec<Vector3<f64>>,
    /// A_j: takes points of the rest pose along with the bone of a joint, shape `[joints]`
    pub world_from_rest: Vec<IsometryMatrix3<f64>>,
    /// axis of every DOF in the world, shape `[dofs]`
    pub(crate) dof_axes: Vec<Vector3<f64>>,
    /// columns of A_j, the translation last, each with a fourth number that isn't used, shape `[joints]`
    columns: Vec<[[f64; 4]; 4]>,
}

impl Shape {
    /// Poses the whole body. `pose`: root translation (metres), rotation vector and angles (radians), shape `[dofs]`.
    ///
    /// # Panics
    /// If the pose has not as many numbers as the rig has DOFs, or the shape is of another model.
    pub fn pose(&self, model: &BodyModel, pose: &[f64], posed: &mut Posed) {
        self.pose_joints(model, pose, posed);
        assert_eq!(self.vertices.len(), model.num_vertices(), "vertices of the shape and of the model");
        posed.vertices.resize(self.vertices.len(), Vector3::zeros());
        let Posed { vertices, columns, .. } = posed;
        let rest = self.vertices.iter();
        let skin = model.skin.joints().iter().zip(model.skin.weights());
        Arch::new().dispatch(Blend { columns, out: vertices, rest: rest.zip(skin) });
    }

    /// Poses some of the vertices: `posed.vertices[i]` is that of `vertices[i]`.
    ///
    /// # Panics
    /// As [`pose`](Self::pose), or if a vertex isn't there.
    pub fn pose_vertices(&self, model: &BodyModel, pose: &[f64], vertices: &[u32], posed: &mut Posed) {
        self.pose_joints(model, pose, posed);
        posed.vertices.resize(vertices.len(), Vector3::zeros());
        let Posed { vertices: out, columns, .. } = posed;
        let (joints, weights) = (model.skin.joints(), model.skin.weights());
        let rest = vertices.iter().map(|&vertex| {
            let vertex = vertex as usize;
            (&self.vertices[vertex], (&joints[vertex], &weights[vertex]))
        });
        Arch::new().dispatch(Blend { columns, out, rest });
    }

    /// Poses the joints alone; `posed.vertices` stay as they are.
    ///
    /// # Panics
    /// If the pose has not as many numbers as the rig has DOFs, or the shape is of another model.
    pub fn pose_joints(&self, model: &BodyModel, pose: &[f64], posed: &mut Posed) {
        let rig = &model.rig;
        assert_eq!(pose.len(), rig.num_dofs(), "numbers of the pose and DOFs of the rig");
        assert_eq!(self.joints.len(), rig.num_joints(), "joints of the shape and of the rig");
        posed.joints.clear();
        posed.world_from_rest.clear();
        posed.columns.clear();
        posed.dof_axes.clear();
        posed.dof_axes.resize(rig.num_dofs(), Vector3::zeros());
        for (joint, rest) in self.joints.iter().enumerate() {
            let (position, rotation) = match rig.joints()[joint].parent {
                None => place_root(rest, pose, &mut posed.dof_axes),
                Some(parent) => {
                    let parent = &posed.world_from_rest[parent];
                    let position = parent.rotation * rest + parent.translation.vector;
                    (position, turn(rig, joint, *parent.rotation.matrix(), pose, &mut posed.dof_axes))
                }
            };
            let shift = position - rotation * rest;
            posed.joints.push(position);
            posed.world_from_rest.push(IsometryMatrix3::from_parts(
                Translation3::from(shift),
                Rotation3::from_matrix_unchecked(rotation),
            ));
            let column = |v: Vector3<f64>| [v.x, v.y, v.z, 0.0];
            let [x, y, z] = [0, 1, 2].map(|axis| column(rotation.column(axis).into()));
            posed.columns.push([x, y, z, column(shift)]);
        }
    }
}

impl Posed {
    /// Rotation of a joint relative to its parent; of the root, in the world.
    pub fn parent_from_joint(&self, model: &BodyModel, joint: usize) -> Rotation3<f64> {
        let world = self.world_from_rest[joint].rotation;
        let parent = model.rig.joints()[joint].parent;
        parent.map_or(world, |parent| self.world_from_rest[parent].rotation.inverse() * world)
    }
}

/// Position and rotation of the root, and the axes of its DOFs: those of a rotation vector are the columns of SO(3)'s left
/// Jacobian.
fn place_root(rest: &Vector3<f64>, pose: &[f64], axes: &mut [Vector3<f64>]) -> (Vector3<f64>, Matrix3<f64>) {
    let translation = Vector3::new(pose[0], pose[1], pose[2]);
    let vector = Vector3::new(pose[3], pose[4], pose[5]);
    let jacobian = left_jacobian(&vector);
    for axis in 0..3 {
        axes[axis] = Vector3::ith(axis, 1.0);
        axes[3 + axis] = jacobian.column(axis).into();
    }
    (rest + translation, rotation_exp(&vector))
}

/// The parent's rotation times those of the joint's DOFs, and the axes of these in the world.
fn turn(
    rig: &Rig,
    joint: usize,
    mut rotation: Matrix3<f64>,
    pose: &[f64],
    axes: &mut [Vector3<f64>],
) -> Matrix3<f64> {
    for (d, dof) in rig.dofs().iter().enumerate().skip(ROOT_DOFS) {
        if dof.joint == joint {
            axes[d] = rotation * dof.axis;
            rotation *= Rotation3::from_axis_angle(&Unit::new_unchecked(dof.axis), pose[d]).into_inner();
        }
    }
    rotation
}

/// Linear blend skinning. Sums are the same on every processor: nothing is fused.
struct Blend<'a, I> {
    columns: &'a [[[f64; 4]; 4]],
    out: &'a mut [Vector3<f64>],
    rest: I,
}

type Influences<'a> = (&'a [u8; INFLUENCES], &'a [u16; INFLUENCES]);

impl<'a, I: Iterator<Item = (&'a Vector3<f64>, Influences<'a>)>> WithSimd for Blend<'_, I> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for (out, (rest, (joints, weights))) in self.out.iter_mut().zip(self.rest) {
            let mut blend = [[0.0; 4]; 4];
            for k in 0..INFLUENCES {
                if weights[k] == 0 {
                    break;
                }
                let weight = f64::from(weights[k]) * (1.0 / WHOLE as f64);
                let columns = &self.columns[usize::from(joints[k])];
                for c in 0..4 {
                    for lane in 0..4 {
                        blend[c][lane] += weight * columns[c][lane];
                    }
                }
            }
            let mut sum = blend[3];
            for lane in 0..4 {
                sum[lane] += blend[0][lane] * rest.x + blend[1][lane] * rest.y + blend[2][lane] * rest.z;
            }
            *out = Vector3::new(sum[0], sum[1], sum[2]);
        }
    }
}
