use model::{Axis, ChannelKind, Joint, Motion, Skeleton};
use nalgebra::{Rotation3, Vector3};

use crate::{
    euler,
    text::{Names, push_number},
};

/// Centimetres in a metre.
const UNITS_PER_METRE: f64 = 100.0;

/// Writes a motion in centimetres and degrees.
///
/// Every joint has three rotation channels; a joint that has axes of its own (Acclaim) gets the Euler angles of its
/// rotation, Z Y X, without jumps from frame to frame. The root, and joints that translate, have three position
/// channels too, which replace the `OFFSET`. Blanks in names become `_`.
pub fn write(motion: &Motion) -> String {
    let skeleton = motion.skeleton();
    let children = children(skeleton);
    let columns = columns(skeleton, &children);
    let mut out = String::from("HIERARCHY\n");
    push_hierarchy(&mut out, skeleton, &children, &columns);
    let period = 1.0 / motion.frame_rate();
    out.push_str(&format!("MOTION\nFrames: {}\nFrame Time: {period}\n", motion.num_frames()));
    let mut before = vec![[0.0; 3]; columns.len()];
    for pose in motion.poses() {
        for (index, (joint, before)) in columns.iter().zip(&mut before).enumerate() {
            if joint.translates {
                for value in joint.position(pose).iter() {
                    push_number(&mut out, value * UNITS_PER_METRE);
                    out.push(' ');
                }
            }
            *before = joint.angles(pose, *before);
            for (place, angle) in before.iter().enumerate() {
                push_number(&mut out, angle.to_degrees());
                out.push(if index + 1 == columns.len() && place == 2 { '\n' } else { ' ' });
            }
        }
    }
    out
}

/// The channels of one joint in the file.
struct Columns<'s> {
    joint: &'s Joint,
    first_dof: usize,
    translates: bool,
    /// leftmost first
    order: [Axis; 3],
    /// DOF of each axis of `order` where the channels are those of the joint; else angles are worked out
    direct: Option<[Option<usize>; 3]>,
}

const ORDERS: [[Axis; 3]; 6] = {
    use Axis::{X, Y, Z};
    [[Z, Y, X], [Z, X, Y], [Y, X, Z], [Y, Z, X], [X, Y, Z], [X, Z, Y]]
};

impl<'s> Columns<'s> {
    fn new(skeleton: &'s Skeleton, index: usize) -> Self {
        let joint = &skeleton.joints()[index];
        let first_dof = skeleton.dofs(index).start;
        let translates = index == 0 || joint.channels.iter().any(|c| c.kind == ChannelKind::Translation);
        let has_own_axes = joint.axes != Rotation3::identity() && !joint.rotation_order.is_empty();
        let order = match ORDERS.into_iter().find(|order| is_within(&joint.rotation_order, order)) {
            Some(order) if !has_own_axes => order,
            _ => ORDERS[0],
        };
        let dof = |axis| {
            let is_it = |c: &model::Channel| c.kind == ChannelKind::Rotation && c.axis == axis;
            joint.channels.iter().position(is_it).map(|place| first_dof + place)
        };
        let direct = (!has_own_axes).then(|| order.map(dof));
        Self { joint, first_dof, translates, order, direct }
    }

    /// Metres in the parent.
    fn position(&self, pose: &[f64]) -> Vector3<f64> {
        let mut position = self.joint.offset;
        for (channel, value) in self.joint.channels.iter().zip(&pose[self.first_dof..]) {
            if channel.kind == ChannelKind::Translation {
                position[channel.axis.index()] += value;
            }
        }
        position
    }

    /// Radians, in the order of the channels, near those of the frame before.
    fn angles(&self, pose: &[f64], before: [f64; 3]) -> [f64; 3] {
        if let Some(dofs) = self.direct {
            return dofs.map(|dof| dof.map_or(0.0, |dof| pose[dof]));
        }
        let angles: Vec<_> = self
            .joint
            .rotation_order
            .iter()
            .map(|axis| {
                let is_it = |c: &model::Channel| c.kind == ChannelKind::Rotation && c.axis == *axis;
                let place = self.joint.channels.iter().position(is_it);
                place.map_or(0.0, |place| pose[self.first_dof + place])
            })
            .collect();
        let in_axes = euler::compose(&self.joint.rotation_order, &angles);
        let rotation = self.joint.axes * in_axes * self.joint.axes.inverse();
        euler::nearest(self.order, &rotation, before)
    }
}

/// Whether the axes come in this order, others left out.
fn is_within(axes: &[Axis], order: &[Axis; 3]) -> bool {
    order.iter().copied().filter(|a| axes.contains(a)).eq(axes.iter().copied())
}

fn children(skeleton: &Skeleton) -> Vec<Vec<usize>> {
    let mut children = vec![Vec::new(); skeleton.num_joints()];
    for (index, joint) in skeleton.joints().iter().enumerate() {
        if let Some(parent) = joint.parent {
            children[parent].push(index);
        }
    }
    children
}

/// What opens and closes while the tree is walked.
enum Step {
    Open(usize),
    Close,
}

/// Joints in the order in which the file names them.
fn walk(children: &[Vec<usize>], mut visit: impl FnMut(usize, Option<usize>)) {
    let mut depth = 0;
    let mut steps = vec![Step::Open(0)];
    while let Some(step) = steps.pop() {
        match step {
            Step::Open(joint) => {
                visit(depth, Some(joint));
                depth += 1;
                steps.push(Step::Close);
                steps.extend(children[joint].iter().rev().map(|child| Step::Open(*child)));
            }
            Step::Close => {
                depth -= 1;
                visit(depth, None);
            }
        }
    }
}

fn columns<'s>(skeleton: &'s Skeleton, children: &[Vec<usize>]) -> Vec<Columns<'s>> {
    let mut columns = Vec::with_capacity(skeleton.num_joints());
    walk(children, |_, joint| columns.extend(joint.map(|joint| Columns::new(skeleton, joint))));
    columns
}

fn push_hierarchy(out: &mut String, skeleton: &Skeleton, children: &[Vec<usize>], columns: &[Columns<'_>]) {
    let mut taken = Names::default();
    let mut columns = columns.iter();
    walk(children, |depth, joint| {
        // deeper than any real skeleton the indent stays, so that a long chain's file does not grow with its square
        let indent = "  ".repeat(depth.min(40));
        let Some((joint, columns)) = joint.and_then(|joint| Some((joint, columns.next()?))) else {
            out.push_str(&format!("{indent}}}\n"));
            return;
        };
        let keyword = if joint == 0 { "ROOT" } else { "JOINT" };
        let name = taken.unique_word(&columns.joint.name, &['{', '}']);
        out.push_str(&format!("{indent}{keyword} {name}\n{indent}{{\n{indent}  OFFSET"));
        push_vector(out, if joint == 0 { Vector3::zeros() } else { columns.joint.offset });
        let number = if columns.translates { 6 } else { 3 };
        out.push_str(&format!("{indent}  CHANNELS {number}"));
        if columns.translates {
            out.push_str(" Xposition Yposition Zposition");
        }
        for axis in columns.order {
            out.push_str(&format!(" {}rotation", ['X', 'Y', 'Z'][axis.index()]));
        }
        out.push('\n');
        if children[joint].is_empty() {
            out.push_str(&format!("{indent}  End Site\n{indent}  {{\n{indent}    OFFSET"));
            push_vector(out, skeleton.joints()[joint].tip);
            out.push_str(&format!("{indent}  }}\n"));
        }
    });
}

fn push_vector(out: &mut String, metres: Vector3<f64>) {
    for value in metres.iter() {
        out.push_str(&format!(" {}", value * UNITS_PER_METRE));
    }
    out.push('\n');
}
