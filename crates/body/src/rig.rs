use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// Degrees of freedom of the root: translation x, y, z in metres, then a rotation vector in radians.
pub const ROOT_DOFS: usize = 6;

/// Most joints and most DOFs of a rig: sets of them are bits of one word.
const MOST: usize = 64;

/// A joint of a rig.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RigJoint {
    /// unique in the rig
    pub name: String,
    /// index of the parent joint, `None` for the root
    pub parent: Option<usize>,
}

/// What a degree of freedom does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DofKind {
    /// moves the root along the axis, metres
    Translation,
    /// turns the joint about the axis, radians; the root's three are the parts of one rotation vector
    Rotation,
}

/// A degree of freedom of a rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Dof {
    /// unique in the rig
    pub name: String,
    /// index of the joint
    pub joint: usize,
    /// translation or rotation
    pub kind: DofKind,
    /// unit vector, in the axes of the rest pose
    pub axis: Vector3<f64>,
    /// lowest and highest value, radians from the rest pose; `None` for the root
    pub limits: Option<[f64; 2]>,
}

/// A tree of joints, parents first, and the degrees of freedom that turn them.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    joints: Vec<RigJoint>,
    dofs: Vec<Dof>,
    /// bit d is set where DOF d moves the joint's bone, shape `[joints]`
    moved_by: Vec<u64>,
}

impl Rig {
    /// Checks the tree and the DOFs: first the root's six ([`ROOT_DOFS`]), then rotations, those of one joint side by side.
    ///
    /// # Errors
    /// [`Error::Rig`] with the first joint or DOF that is wrong.
    pub fn new(joints: Vec<RigJoint>, mut dofs: Vec<Dof>) -> Result<Self> {
        let fail = |what: String| Err(Error::Rig { what });
        if joints.is_empty() || joints.len() > MOST || dofs.len() < ROOT_DOFS || dofs.len() > MOST {
            return fail(format!(
                "{} joints and {} DOFs, expected 1 to {MOST} and {ROOT_DOFS} to {MOST}",
                joints.len(),
                dofs.len()
            ));
        }
        for (index, joint) in joints.iter().enumerate() {
            if joint.parent.is_none_or(|parent| parent >= index) != (index == 0)
                || (index == 0 && joint.parent.is_some())
            {
                return fail(format!(
                    "joint {index} ({}) has parent {:?}, expected an earlier joint (only joint 0 is the root)",
                    joint.name, joint.parent
                ));
            }
            if joints[..index].iter().any(|other| other.name == joint.name) {
                return fail(format!("two joints are named {}", joint.name));
            }
        }
        for (index, dof) in dofs.iter_mut().enumerate() {
            check_dof(index, dof, joints.len())?;
        }
        for (index, dof) in dofs.iter().enumerate() {
            let before = &dofs[..index];
            if before.iter().any(|other| other.name == dof.name) {
                return fail(format!("two DOFs are named {}", dof.name));
            }
            let is_apart = before.last().is_some_and(|last| last.joint != dof.joint)
                && before.iter().any(|other| other.joint == dof.joint);
            if is_apart {
                return fail(format!("DOF {} stands apart from the others of its joint", dof.name));
            }
        }
        let mut moved_by = vec![0u64; joints.len()];
        for (index, joint) in joints.iter().enumerate() {
            let own = dofs.iter().enumerate().filter(|(_, dof)| dof.joint == index);
            let inherited = joint.parent.map_or(0, |parent| moved_by[parent]);
            moved_by[index] = own.fold(inherited, |bits, (d, _)| bits | 1 << d);
        }
        Ok(Self { joints, dofs, moved_by })
    }

    /// The joints, parents first.
    pub fn joints(&self) -> &[RigJoint] {
        &self.joints
    }

    /// The degrees of freedom in the order of a pose.
    pub fn dofs(&self) -> &[Dof] {
        &self.dofs
    }

    /// Number of joints.
    pub fn num_joints(&self) -> usize {
        self.joints.len()
    }

    /// Number of degrees of freedom: the length of a pose; 22 for the rig of the shipped model.
    pub fn num_dofs(&self) -> usize {
        self.dofs.len()
    }

    /// Index of the joint of that name.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Index of the DOF of that name.
    pub fn dof_index(&self, name: &str) -> Option<usize> {
        self.dofs.iter().position(|dof| dof.name == name)
    }

    /// Which DOFs move the bone that hangs from a joint: bit d for DOF d.
    pub fn moved_by(&self, joint: usize) -> u64 {
        self.moved_by[joint]
    }

    /// The pose with every limited DOF within its limits, shape `[dofs]`.
    pub fn clamp(&self, pose: &mut [f64]) {
        for (value, dof) in pose.iter_mut().zip(&self.dofs) {
            if let Some([low, high]) = dof.limits {
                *value = value.clamp(low, high);
            }
        }
    }
}

/// Checks one DOF and makes its axis exactly a unit vector.
fn check_dof(index: usize, dof: &mut Dof, num_joints: usize) -> Result<()> {
    let fail = |what: String| Err(Error::Rig { what: format!("DOF {index} ({}) {what}", dof.name) });
    if dof.joint >= num_joints {
        return fail(format!("turns joint {}, expected an index below {num_joints}", dof.joint));
    }
    if index < ROOT_DOFS {
        let kind = if index < 3 { DofKind::Translation } else { DofKind::Rotation };
        let axis = Vector3::ith(index % 3, 1.0);
        if dof.joint != 0 || dof.kind != kind || (dof.axis - axis).norm() > 1e-6 || dof.limits.is_some() {
            return fail(
                "is not the root's: expected translations x, y, z and rotations x, y, z without limits"
                    .into(),
            );
        }
        dof.axis = axis;
        return Ok(());
    }
    if dof.joint == 0 || dof.kind != DofKind::Rotation {
        return fail("belongs to the root or is a translation, expected a rotation of another joint".into());
    }
    let length = dof.axis.norm();
    if (length - 1.0).abs() > 1e-3 || length.is_nan() {
        return fail(format!("has an axis of length {length}, expected 1"));
    }
    // What is a unit vector already stays as it is, or a file would not be read as it was written.
    if (length - 1.0).abs() > 1e-12 {
        dof.axis /= length;
    }
    match dof.limits {
        Some([low, high]) if low <= 0.0 && 0.0 <= high && low.is_finite() && high.is_finite() => Ok(()),
        Some([low, high]) => fail(format!("has limits {low} to {high}, expected finite ones around 0")),
        None => fail("has no limits".into()),
    }
}
