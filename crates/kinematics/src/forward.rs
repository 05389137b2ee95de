use model::{Axis, Skeleton};
use nalgebra::{Matrix3, Vector3};

use crate::Parametrisation;
use crate::parametrisation::JointRotation;
use crate::rotation_vector::{exp_and_left_jacobian, rotation_exp};

/// A skeleton made ready for fast forward kinematics: constant products taken, flat arrays, parents first.
#[derive(Debug, Clone)]
pub struct Kinematics {
    pub(crate) joints: Vec<CompiledJoint>,
    pub(crate) dofs: Vec<Dof>,
    parametrisation: Parametrisation,
}

#[derive(Debug, Clone)]
pub(crate) struct CompiledJoint {
    pub parent: Option<usize>,
    offset: Vector3<f64>,
    axes: Matrix3<f64>,
    has_axes: bool,
    translations: Vec<(usize, Axis)>,
    rotation: JointRotation,
}

/// Which joint a coordinate moves, and whether it turns or shifts it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Dof {
    pub joint: usize,
    pub is_translation: bool,
}

/// The joints in the world for one set of coordinates: the memory that [`Kinematics::update`] fills.
#[derive(Debug, Clone)]
pub struct State {
    /// world_from_joint rotations, shape `[num_joints]`
    pub rotations: Vec<Matrix3<f64>>,
    /// positions of the joints in the world, metres, shape `[num_joints]`
    pub positions: Vec<Vector3<f64>>,
    /// axis of each coordinate in the world, shape `[dofs]`: of length 1 for angles and translations
    pub dof_axes: Vec<Vector3<f64>>,
}

impl State {
    /// World position (metres) of a point given in the frame of a joint (metres).
    pub fn point(&self, joint: usize, point_in_joint: &Vector3<f64>) -> Vector3<f64> {
        self.positions[joint] + self.rotations[joint] * point_in_joint
    }
}

impl Kinematics {
    /// Compiles `skeleton` under a parametrisation that was made for it (or for one of the same structure).
    pub fn new(skeleton: &Skeleton, parametrisation: Parametrisation) -> Self {
        let joints: Vec<_> = skeleton
            .joints()
            .iter()
            .enumerate()
            .map(|(j, joint)| CompiledJoint {
                parent: joint.parent,
                offset: joint.offset,
                axes: joint.axes.into_inner(),
                has_axes: joint.axes.matrix() != &Matrix3::identity(),
                translations: parametrisation.translations[j].clone(),
                rotation: parametrisation.joints[j].clone(),
            })
            .collect();
        let mut dofs = vec![Dof { joint: 0, is_translation: false }; skeleton.num_dofs()];
        for (j, joint) in joints.iter().enumerate() {
            for dof in skeleton.dofs(j) {
                dofs[dof].joint = j;
            }
            for (dof, _) in &joint.translations {
                dofs[*dof].is_translation = true;
            }
        }
        Self { joints, dofs, parametrisation }
    }

    /// The parametrisation given to [`Self::new`].
    pub fn parametrisation(&self) -> &Parametrisation {
        &self.parametrisation
    }

    /// Number of joints.
    pub fn num_joints(&self) -> usize {
        self.joints.len()
    }

    /// Number of coordinates D.
    pub fn num_dofs(&self) -> usize {
        self.dofs.len()
    }

    /// Memory for [`Self::update`].
    pub fn state(&self) -> State {
        State {
            rotations: vec![Matrix3::identity(); self.num_joints()],
            positions: vec![Vector3::zeros(); self.num_joints()],
            dof_axes: vec![Vector3::zeros(); self.num_dofs()],
        }
    }

    /// Computes position, rotation and coordinate axes of every joint in the world (forward kinematics).
    ///
    /// `x`: coordinates, metres and radians, shape `[dofs]`. Joints are parents first, so one pass suffices.
    pub fn update(&self, x: &[f64], state: &mut State) {
        for joint in 0..self.joints.len() {
            self.update_joint(joint, x, state);
        }
    }

    /// As [`Self::update`], for the given joints only; a joint's ancestors must be among them, before it.
    pub fn update_joints(&self, joints: &[usize], x: &[f64], state: &mut State) {
        for &joint in joints {
            self.update_joint(joint, x, state);
        }
    }

    #[inline]
    fn update_joint(&self, index: usize, x: &[f64], state: &mut State) {
        let joint = &self.joints[index];
        let (world_from_parent, mut position) = match joint.parent {
            Some(parent) => {
                let rotation = state.rotations[parent];
                (rotation, state.positions[parent] + rotation * joint.offset)
            }
            None => (Matrix3::identity(), joint.offset),
        };
        for (dof, axis) in &joint.translations {
            let direction = world_from_parent.column(axis.index()).into_owned();
            position += direction * x[*dof];
            state.dof_axes[*dof] = direction;
        }
        state.positions[index] = position;
        // The frame in which the joint's rotation axes are given.
        let world_from_axes = if joint.has_axes { world_from_parent * joint.axes } else { world_from_parent };
        let turned = match &joint.rotation {
            JointRotation::Angles(angles) => {
                let mut turned = world_from_axes;
                for (dof, axis) in angles {
                    state.dof_axes[*dof] = turned.column(axis.index()).into_owned();
                    rotate_about(&mut turned, *axis, x[*dof]);
                }
                turned
            }
            JointRotation::Vector { first_dof, reference } => {
                let v = Vector3::new(x[*first_dof], x[first_dof + 1], x[first_dof + 2]);
                let (rotation, jacobian) = exp_and_left_jacobian(&v);
                let world_from_reference = world_from_axes * reference;
                let axes = world_from_reference * jacobian;
                for i in 0..3 {
                    state.dof_axes[first_dof + i] = axes.column(i).into_owned();
                }
                world_from_reference * rotation
            }
            JointRotation::HeadingTilt { first_dof } => {
                // Heading and tilt already are rotations of the world: the joint's own axes do not enter.
                let heading = rotation_exp(&Vector3::new(0.0, x[*first_dof], 0.0));
                let tilt = Vector3::new(x[first_dof + 1], 0.0, x[first_dof + 2]);
                let (rotation, jacobian) = exp_and_left_jacobian(&tilt);
                let axes = heading * jacobian;
                state.dof_axes[*first_dof] = Vector3::y();
                state.dof_axes[first_dof + 1] = axes.column(0).into_owned();
                state.dof_axes[first_dof + 2] = axes.column(2).into_owned();
                state.rotations[index] = heading * rotation;
                return;
            }
        };
        state.rotations[index] = if joint.has_axes { turned * joint.axes.transpose() } else { turned };
    }
}

/// Multiplies `matrix` from the right by the rotation about a coordinate axis.
#[inline]
fn rotate_about(matrix: &mut Matrix3<f64>, axis: Axis, angle: f64) {
    let (sin, cos) = angle.sin_cos();
    let (i, j) = match axis {
        Axis::X => (1, 2),
        Axis::Y => (2, 0),
        Axis::Z => (0, 1),
    };
    for row in 0..3 {
        let (u, v) = (matrix[(row, i)], matrix[(row, j)]);
        matrix[(row, i)] = u * cos + v * sin;
        matrix[(row, j)] = v * cos - u * sin;
    }
}
