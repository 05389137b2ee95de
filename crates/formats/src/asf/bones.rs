//! The bones that an Acclaim file needs to say what a skeleton is.
//!
//! In Acclaim every child starts at its parent's tip, and the children of the root start at the root. A skeleton
//! from elsewhere may have children at several places of a joint; *connectors*, fixed bones without DOFs, then
//! lead from the tip to the child. A joint that both translates and has axes of its own is written as two bones,
//! of which the first only translates.

use model::{Axis, Channel, ChannelKind, Joint, Skeleton};
use nalgebra::{Rotation3, Vector3};

use super::CMU_METRES_PER_UNIT;
use crate::text::Names;

/// One column of an AMC file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column {
    /// index into a pose
    pub(crate) dof: usize,
    pub(crate) channel: Channel,
}

/// A bone to write.
#[derive(Debug)]
pub(crate) struct Bone {
    /// unique and without blanks
    pub(crate) name: String,
    /// index of the parent among the bones, `None` for the root
    pub(crate) parent: Option<usize>,
    /// from start to end, metres
    pub(crate) vector: Vector3<f64>,
    pub(crate) axes: Rotation3<f64>,
    /// order in which the rotations are applied (rightmost of the product first)
    pub(crate) axis_order: [Axis; 3],
    pub(crate) columns: Vec<Column>,
}

impl Bone {
    fn fixed(name: String, parent: usize, vector: Vector3<f64>) -> Self {
        Self {
            name,
            parent: Some(parent),
            vector,
            axes: Rotation3::identity(),
            axis_order: [Axis::X, Axis::Y, Axis::Z],
            columns: Vec::new(),
        }
    }

    /// Metres or radians to CMU's unit of length or degrees.
    pub(crate) fn to_file(kind: ChannelKind, value: f64) -> f64 {
        match kind {
            ChannelKind::Translation => value / CMU_METRES_PER_UNIT,
            ChannelKind::Rotation => value.to_degrees(),
        }
    }
}

/// Differences of position that are not worth a connector, metres.
const SAME_PLACE_M: f64 = 1e-9;

/// The bones of a skeleton, parents first; the first is the root.
pub(crate) fn bones(skeleton: &Skeleton) -> Vec<Bone> {
    let joints = skeleton.joints();
    let mut first_child = vec![None; joints.len()];
    for (index, joint) in joints.iter().enumerate().rev() {
        if let Some(parent) = joint.parent {
            first_child[parent] = Some(index);
        }
    }
    // joints keep their names where they can; only then come the names of what is added
    let mut taken = Names::reserved(&["root", "begin", "end"]);
    let names: Vec<_> = joints.iter().skip(1).map(|j| taken.unique_word(&j.name, MARKS)).collect();

    let mut bones = vec![root(skeleton)];
    let mut bone_of = vec![0; joints.len()];
    for (index, joint) in joints.iter().enumerate().skip(1) {
        let name = &names[index - 1];
        let mut parent = bone_of[joint.parent.unwrap_or(0)];
        // the root's tip is where it starts; its own vector is its position
        let parent_tip = if parent == 0 { Vector3::zeros() } else { bones[parent].vector };
        let gap = joint.offset - parent_tip;
        if gap.norm() > SAME_PLACE_M {
            bones.push(Bone::fixed(taken.unique(&format!("{name}_connector")), parent, gap));
            parent = bones.len() - 1;
        }
        let (mut columns, axis_order) = columns(joint, skeleton.dofs(index).start);
        let (translations, rotations): (Vec<_>, Vec<_>) =
            columns.iter().partition(|c| c.channel.kind == ChannelKind::Translation);
        if !translations.is_empty() && joint.axes.angle() > 0.0 {
            let mut slide = Bone::fixed(taken.unique(&format!("{name}_slide")), parent, Vector3::zeros());
            slide.columns = translations;
            bones.push(slide);
            parent = bones.len() - 1;
            columns = rotations;
        }
        let vector = match first_child[index] {
            Some(child) if joint.tip.norm() == 0.0 => joints[child].offset,
            _ => joint.tip,
        };
        bone_of[index] = bones.len();
        bones.push(Bone {
            name: name.clone(),
            parent: Some(parent),
            vector,
            axes: joint.axes,
            axis_order,
            columns,
        });
    }
    bones
}

/// Characters with a meaning of their own in the format.
const MARKS: &[char] = &['#', ':', '('];

fn root(skeleton: &Skeleton) -> Bone {
    let joint = &skeleton.joints()[0];
    let leftmost_last: Vec<_> = joint.rotation_order.iter().rev().copied().collect();
    let columns =
        joint.channels.iter().enumerate().map(|(dof, channel)| Column { dof, channel: *channel }).collect();
    Bone {
        name: "root".into(),
        parent: None,
        vector: joint.offset,
        axes: joint.axes,
        axis_order: super::tree::completed(&leftmost_last),
        columns,
    }
}

/// Columns of a bone: the order of its rotations is the order in which they are applied. Acclaim joints keep theirs.
fn columns(joint: &Joint, first_dof: usize) -> (Vec<Column>, [Axis; 3]) {
    let mut rotations = joint.rotation_order.iter().rev().filter_map(|axis| {
        joint.channels.iter().position(|c| c.kind == ChannelKind::Rotation && c.axis == *axis)
    });
    let columns = joint
        .channels
        .iter()
        .enumerate()
        .filter_map(|(index, channel)| match channel.kind {
            ChannelKind::Translation => Some(index),
            ChannelKind::Rotation => rotations.next(),
        })
        .map(|index| Column { dof: first_dof + index, channel: joint.channels[index] })
        .collect();
    let applied: Vec<_> = joint.rotation_order.iter().rev().copied().collect();
    (columns, super::tree::completed(&applied))
}
