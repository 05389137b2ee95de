use std::ops::Range;

use crate::{Axis, Channel, ChannelKind, Error, Joint, Result};

/// A tree of joints, parents first, with one number (DOF) per channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    name: String,
    joints: Vec<Joint>,
    /// first DOF of each joint, and the number of DOFs at the end
    first_dof: Vec<usize>,
}

impl Skeleton {
    /// Checks the tree and numbers the DOFs: joint by joint, in the order of each joint's channels.
    ///
    /// # Errors
    /// If there is no joint, a parent does not come before its child, a name or a channel is there twice, or a
    /// length or limit is not finite.
    pub fn new(name: impl Into<String>, joints: Vec<Joint>) -> Result<Self> {
        if joints.is_empty() {
            return Err(Error::NoJoints);
        }
        let mut names = std::collections::HashSet::new();
        let mut first_dof = vec![0];
        for (index, joint) in joints.iter().enumerate() {
            if joint.parent.is_none_or(|p| p >= index) != (index == 0)
                || (index == 0 && joint.parent.is_some())
            {
                return Err(Error::ParentOrder {
                    joint: index,
                    name: joint.name.clone(),
                    parent: joint.parent,
                });
            }
            if !names.insert(joint.name.as_str()) {
                return Err(Error::DuplicateName { name: joint.name.clone() });
            }
            check_joint(joint)?;
            first_dof.push(first_dof[index] + joint.channels.len());
        }
        Ok(Self { name: name.into(), joints, first_dof })
    }

    /// Name given by the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The joints, parents first; joint 0 is the root.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Number of joints.
    pub fn num_joints(&self) -> usize {
        self.joints.len()
    }

    /// Number of degrees of freedom D: the length of a pose.
    pub fn num_dofs(&self) -> usize {
        self.first_dof[self.joints.len()]
    }

    /// The DOFs of a joint, as a range of indices into a pose.
    pub fn dofs(&self, joint_index: usize) -> Range<usize> {
        self.first_dof[joint_index]..self.first_dof[joint_index + 1]
    }

    /// Index of the joint of that name.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|j| j.name == name)
    }

    /// Joint and channel of every DOF, in the order of a pose.
    pub fn channels(&self) -> impl Iterator<Item = (usize, &Channel)> {
        self.joints.iter().enumerate().flat_map(|(i, j)| j.channels.iter().map(move |c| (i, c)))
    }

    /// Name of every DOF, `joint.rx`, in the order of a pose.
    pub fn dof_names(&self) -> Vec<String> {
        self.channels().map(|(j, c)| format!("{}.{c}", self.joints[j].name)).collect()
    }

    /// Whether both have the same joints, tree and channels, so that a pose of one is a pose of the other; lengths
    /// and axes may differ.
    pub fn same_structure(&self, other: &Self) -> bool {
        self.joints.len() == other.joints.len()
            && self.joints.iter().zip(&other.joints).all(|(a, b)| {
                a.name == b.name
                    && a.parent == b.parent
                    && a.rotation_order == b.rotation_order
                    && a.channels.len() == b.channels.len()
                    && a.channels.iter().zip(&b.channels).all(|(c, d)| c.kind == d.kind && c.axis == d.axis)
            })
    }
}

fn check_joint(joint: &Joint) -> Result<()> {
    let not_finite = |what| Error::NotFinite { what, name: joint.name.clone() };
    if !joint.offset.iter().all(|v| v.is_finite()) {
        return Err(not_finite("offset"));
    }
    if !joint.tip.iter().all(|v| v.is_finite()) {
        return Err(not_finite("tip"));
    }
    if !joint.axes.matrix().iter().all(|v| v.is_finite()) {
        return Err(not_finite("axes"));
    }
    let mut seen = Vec::<(ChannelKind, Axis)>::new();
    for channel in &joint.channels {
        if seen.contains(&(channel.kind, channel.axis)) {
            return Err(Error::DuplicateChannel { name: joint.name.clone(), channel: channel.to_string() });
        }
        seen.push((channel.kind, channel.axis));
        if channel.limits.is_some_and(|(low, high)| low.is_nan() || high.is_nan()) {
            return Err(not_finite("limit"));
        }
    }
    let mut rotations: Vec<_> =
        seen.iter().filter(|(k, _)| *k == ChannelKind::Rotation).map(|(_, a)| *a).collect();
    let mut order = joint.rotation_order.clone();
    rotations.sort();
    order.sort();
    if rotations != order {
        return Err(Error::DuplicateChannel {
            name: joint.name.clone(),
            channel: format!("rotation order {:?} for rotations {rotations:?}", joint.rotation_order),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn child(name: &str, parent: usize) -> Joint {
        Joint::child(name, parent, Vector3::y(), vec![Channel::rotation(Axis::X)])
    }

    #[test]
    fn dofs_are_numbered_joint_by_joint() {
        let root = Joint::root("root", vec![Channel::translation(Axis::X), Channel::rotation(Axis::Z)]);
        let skeleton = Skeleton::new("s", vec![root, child("a", 0), child("b", 1)]).unwrap();
        assert_eq!(skeleton.num_dofs(), 4);
        assert_eq!(skeleton.dofs(1), 2..3);
        assert_eq!(skeleton.dof_names(), ["root.tx", "root.rz", "a.rx", "b.rx"]);
    }

    #[test]
    fn a_child_before_its_parent_is_refused() {
        let joints = vec![Joint::root("root", vec![]), child("a", 2), child("b", 0)];
        assert!(matches!(Skeleton::new("s", joints), Err(Error::ParentOrder { joint: 1, .. })));
    }

    #[test]
    fn a_second_root_is_refused() {
        let joints = vec![Joint::root("root", vec![]), Joint::root("other", vec![])];
        assert!(matches!(Skeleton::new("s", joints), Err(Error::ParentOrder { joint: 1, .. })));
    }

    #[test]
    fn two_joints_of_one_name_are_refused() {
        let joints = vec![Joint::root("root", vec![]), child("a", 0), child("a", 0)];
        assert!(matches!(Skeleton::new("s", joints), Err(Error::DuplicateName { .. })));
    }
}
