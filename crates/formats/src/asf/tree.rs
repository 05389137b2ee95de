//! From bones in the order of the file to joints, parents first.

use std::{collections::HashMap, sync::Arc};

use model::{Axis, Channel, ChannelKind, Joint, Skeleton};
use nalgebra::{Rotation3, Vector3};

use super::{
    File,
    sections::{Children, RawBone, Root, Units},
};
use crate::{Error, Place, Result, euler, read::Warnings, text::quote};

/// Node 0 is the root, node i the bone i - 1 of the file.
struct Tree {
    parent: Vec<Option<usize>>,
    children: Vec<Vec<usize>>,
}

pub(super) fn build(
    name: String,
    units: Units,
    root: Root,
    bones: Vec<RawBone>,
    hierarchy: &[Children<'_>],
    warnings: &mut Warnings,
) -> Result<File> {
    if units.metres.is_none() {
        warnings.line(root.line, "no length unit is given; one unit is taken as 1 inch");
    }
    if units.radians.is_none() {
        warnings.line(root.line, "no angle unit is given; angles are taken as degrees");
    }
    let tree = tree(&bones, hierarchy)?;
    let order = depth_first(&tree, &bones)?;
    let mut joint_of_node = vec![0; tree.parent.len()];
    let mut joints = vec![root_joint(&root, units)];
    for node in order.into_iter().skip(1) {
        let parent = tree.parent[node].map_or(0, |p| joint_of_node[p]);
        joint_of_node[node] = joints.len();
        let offset = joints[parent].tip;
        joints.push(joint(&bones[node - 1], parent, offset, units, warnings)?);
    }
    let skeleton = Skeleton::new(name, joints)
        .map_err(|source| Error::Model { place: Place::Line(root.line), source })?;
    let metres_per_unit = units.factor(ChannelKind::Translation);
    Ok(File { skeleton: Arc::new(skeleton), metres_per_unit })
}

fn tree(bones: &[RawBone], hierarchy: &[Children<'_>]) -> Result<Tree> {
    let mut node_of = HashMap::<&[u8], usize>::from([(b"root".as_slice(), 0)]);
    for (index, bone) in bones.iter().enumerate() {
        if node_of.insert(bone.name.as_bytes(), index + 1).is_some() {
            return Err(Error::at_line(
                bone.line,
                format!("a second bone named {}", quote(bone.name.as_bytes())),
                "names to be unique, and root to be the root's",
            ));
        }
    }
    let mut tree = Tree { parent: vec![None; bones.len() + 1], children: vec![Vec::new(); bones.len() + 1] };
    for entry in hierarchy {
        let node = |name: &[u8]| {
            node_of.get(name).copied().ok_or_else(|| {
                Error::at_line(entry.line, format!("bone {}", quote(name)), "a bone of the :bonedata section")
            })
        };
        let parent = node(entry.parent)?;
        for name in &entry.children {
            let child = node(name)?;
            if child == 0 {
                return Err(Error::at_line(
                    entry.line,
                    "the root as a child",
                    "a tree that starts at the root",
                ));
            }
            if tree.parent[child].is_some() {
                return Err(Error::at_line(
                    entry.line,
                    format!("a second parent of bone {}", quote(name)),
                    "one parent a bone",
                ));
            }
            tree.parent[child] = Some(parent);
            tree.children[parent].push(child);
        }
    }
    Ok(tree)
}

/// Nodes from the root on, each before its children.
fn depth_first(tree: &Tree, bones: &[RawBone]) -> Result<Vec<usize>> {
    let mut order = Vec::with_capacity(tree.parent.len());
    let mut reached = vec![false; tree.parent.len()];
    let mut stack = vec![0];
    while let Some(node) = stack.pop() {
        reached[node] = true;
        order.push(node);
        stack.extend(tree.children[node].iter().rev());
    }
    match reached.iter().position(|r| !r) {
        None => Ok(order),
        Some(node) => {
            let bone = &bones[node - 1];
            let name = quote(bone.name.as_bytes());
            let found = if tree.parent[node].is_none() {
                format!("bone {name} without a parent")
            } else {
                format!("bone {name} on or below a cycle of the hierarchy")
            };
            Err(Error::at_line(bone.line, found, "every bone to hang from the root"))
        }
    }
}

fn root_joint(root: &Root, units: Units) -> Joint {
    let mut joint = Joint::root("root", root.channels.clone());
    let file_order: Vec<_> = joint.rotation_order.clone();
    let axis_order = root.axis_order.unwrap_or_else(|| completed(&file_order));
    joint.rotation_order = axis_order.iter().rev().copied().filter(|a| file_order.contains(a)).collect();
    joint.offset = root.position * units.factor(ChannelKind::Translation);
    joint.axes = axes(root.orientation, axis_order, units);
    joint
}

/// The axes given, then those that are missing, so that all three are there.
pub(super) fn completed(axes: &[Axis]) -> [Axis; 3] {
    let mut all = axes.to_vec();
    for axis in [Axis::X, Axis::Y, Axis::Z] {
        if !all.contains(&axis) {
            all.push(axis);
        }
    }
    [all[0], all[1], all[2]]
}

fn axes(angles: [f64; 3], order: [Axis; 3], units: Units) -> Rotation3<f64> {
    // the numbers are always those of x, y, z; the order says which is applied first, that is rightmost
    let radians = units.factor(ChannelKind::Rotation);
    let leftmost_first = [order[2], order[1], order[0]];
    euler::compose(&leftmost_first, &leftmost_first.map(|a| angles[a.index()] * radians))
}

fn joint(
    bone: &RawBone,
    parent: usize,
    offset: Vector3<f64>,
    units: Units,
    warnings: &mut Warnings,
) -> Result<Joint> {
    let channels: Vec<_> = bone
        .channels
        .iter()
        .map(|c| {
            let factor = units.factor(c.kind);
            Channel { limits: c.limits.map(|(low, high)| (low * factor, high * factor)), ..*c }
        })
        .collect();
    let mut joint = Joint::child(bone.name.clone(), parent, offset, channels);
    joint.rotation_order.reverse();
    let by_axis_order: Vec<_> =
        bone.axis_order.iter().rev().copied().filter(|a| joint.rotation_order.contains(a)).collect();
    if by_axis_order != joint.rotation_order {
        warnings.line(
            bone.line,
            format!("dof and axis of bone {} are in different orders; the order of dof is taken", bone.name),
        );
    }
    let norm = bone.direction.norm();
    if bone.length != 0.0 && (norm - 1.0).abs() > 0.01 {
        warnings.line(
            bone.line,
            format!("direction of bone {} has length {norm:.4}, expected 1; it is taken as it is", bone.name),
        );
    }
    joint.tip = bone.direction * (bone.length * units.factor(ChannelKind::Translation));
    joint.axes = axes(bone.axis, bone.axis_order, units);
    let translates = joint.channels.iter().any(|c| c.kind == ChannelKind::Translation);
    if translates && bone.axis != [0.0; 3] {
        return Err(Error::at_line(
            bone.line,
            format!("bone {} with translations and an axis that is not 0", quote(bone.name.as_bytes())),
            "axis 0 0 0 where a bone translates",
        ));
    }
    Ok(joint)
}
