use model::{Axis, Channel, ChannelKind, Skeleton};
use nalgebra::Rotation3;

use super::bones::{Bone, bones};
use crate::{euler, text::push_number};

/// Writes a skeleton in CMU's unit of length and degrees.
///
/// Joints keep their names (blanks become `_`), except the root, which Acclaim calls `root`. A joint whose children
/// don't all start at its tip gets fixed bones without DOFs, `…_connector`, that lead to them.
pub fn write(skeleton: &Skeleton) -> String {
    let bones = bones(skeleton);
    let mut out = String::from("# Acclaim skeleton\n:version 1.10\n:name ");
    let name = skeleton.name().replace(|c: char| c.is_control() || c == '#', " ");
    out.push_str(if name.trim().is_empty() { "skeleton" } else { name.trim() });
    out.push_str("\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n");
    let root = &bones[0];
    out.push_str(":root\n  order");
    for column in &root.columns {
        out.push(' ');
        out.push_str(&column.channel.to_string().to_uppercase());
    }
    out.push_str("\n  axis ");
    push_order(&mut out, root.axis_order);
    out.push_str("\n  position");
    for value in root.vector.iter() {
        push_length(&mut out, *value);
    }
    out.push_str("\n  orientation");
    push_axes(&mut out, root);
    out.push_str("\n:bonedata\n");
    for (id, bone) in bones.iter().enumerate().skip(1) {
        push_bone(&mut out, id, bone);
    }
    push_hierarchy(&mut out, &bones);
    out
}

fn push_bone(out: &mut String, id: usize, bone: &Bone) {
    out.push_str(&format!("  begin\n    id {id}\n    name {}\n    direction", bone.name));
    let length = bone.vector.norm();
    let direction = if length > 0.0 { bone.vector / length } else { nalgebra::Vector3::z() };
    for value in direction.iter() {
        out.push_str(&format!(" {value}"));
    }
    out.push_str("\n    length");
    push_length(out, length);
    out.push_str("\n    axis");
    push_axes(out, bone);
    out.push(' ');
    push_order(out, bone.axis_order);
    out.push('\n');
    if !bone.columns.is_empty() {
        out.push_str("    dof");
        for column in &bone.columns {
            out.push_str(&format!(" {}", column.channel));
        }
        out.push('\n');
        push_limits(out, bone);
    }
    out.push_str("  end\n");
}

fn push_limits(out: &mut String, bone: &Bone) {
    if bone.columns.iter().all(|c| c.channel.limits.is_none()) {
        return;
    }
    for (index, column) in bone.columns.iter().enumerate() {
        out.push_str(if index == 0 { "    limits (" } else { "           (" });
        let Channel { kind, limits, .. } = column.channel;
        let (low, high) = limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        push_number(out, Bone::to_file(kind, low));
        out.push(' ');
        push_number(out, Bone::to_file(kind, high));
        out.push_str(")\n");
    }
}

/// All digits: lengths add up along a chain.
fn push_length(out: &mut String, metres: f64) {
    out.push_str(&format!(" {}", Bone::to_file(ChannelKind::Translation, metres)));
}

fn push_axes(out: &mut String, bone: &Bone) {
    let [first, second, third] = bone.axis_order;
    let mut angles = [0.0; 3];
    if bone.axes != Rotation3::identity() {
        for (axis, angle) in
            [third, second, first].iter().zip(euler::decompose([third, second, first], &bone.axes))
        {
            angles[axis.index()] = angle.to_degrees();
        }
    }
    for angle in angles {
        out.push_str(&format!(" {angle}"));
    }
}

fn push_order(out: &mut String, order: [Axis; 3]) {
    out.extend(order.map(|axis| ['X', 'Y', 'Z'][axis.index()]));
}

fn push_hierarchy(out: &mut String, bones: &[Bone]) {
    let mut children = vec![Vec::new(); bones.len()];
    for (index, bone) in bones.iter().enumerate() {
        if let Some(parent) = bone.parent {
            children[parent].push(index);
        }
    }
    out.push_str(":hierarchy\n  begin\n");
    for (bone, children) in bones.iter().zip(children) {
        if !children.is_empty() {
            out.push_str(&format!("    {}", bone.name));
            for child in children {
                out.push_str(&format!(" {}", bones[child].name));
            }
            out.push('\n');
        }
    }
    out.push_str("  end\n");
}
