//! Left and right exchanged.

use std::sync::Arc;

use kinematics::{angles_from_rotation, rotation_from_angles};
use model::{Axis, Channel, ChannelKind, Joint, Motion, Skeleton};
use nalgebra::{Matrix3, Vector3};

use crate::{Error, Result};

/// How far a mirrored rotation axis may be from the axis of the other side: the cosine between them, at least.
const MIN_AXIS_COSINE: f64 = 0.99;

/// The motion seen in a mirror: reflected in the plane x = 0, with what the left side did done by the right.
///
/// Joints of the two sides are found by their names: `lfemur` and `rfemur`, `LeftArm` and `RightArm`, `arm_l` and
/// `arm_r`. The skeleton is mirrored too (offsets and ends of bones; channels and rotation axes stay those of the same
/// joint), so a performer whose sides differ stays one, mirrored. With M the reflection, A the rotation axes of a
/// joint and R the product of its channels, the joint of the other side gets `B R Bᵀ`, `B = A'ᵀ M A`.
///
/// Joints with three rotations are mirrored exactly, whatever their axes. For one or two rotations that is so if the
/// axes of both sides are mirror images, as those of the CMU database are; up to 8° of difference between them are
/// accepted and left in.
///
/// # Errors
/// [`Error::Mirror`] if the sides have other channels, hang from joints that are not a pair, or have axes that are not
/// mirror images.
pub fn mirror(motion: &Motion) -> Result<Motion> {
    let mirror = Mirror::new(motion.skeleton())?;
    let dofs = motion.skeleton().num_dofs();
    let mut values = vec![0.0; motion.values().len()];
    let mut previous = vec![0.0; dofs];
    for (pose, out) in motion.poses().zip(values.chunks_exact_mut(dofs.max(1))) {
        mirror.pose(pose, &previous, out);
        previous.copy_from_slice(out);
    }
    let made = Motion::new(mirror.skeleton.clone(), motion.frame_rate(), values);
    made.map_err(|e| Error::Mirror { joint: motion.skeleton().name().to_owned(), reason: e.to_string() })
}

/// What has to be done to each pose of a skeleton.
struct Mirror {
    skeleton: Arc<Skeleton>,
    joints: Vec<Step>,
}

/// One joint of the mirrored pose.
struct Step {
    /// DOFs of the joint that is written and of the one it comes from
    to: usize,
    from: usize,
    channels: Vec<Channel>,
    rotation: Rotation,
}

enum Rotation {
    /// `B R Bᵀ`, and the slot of each axis of the order
    Free { order: [Axis; 3], slots: [usize; 3], b: Matrix3<f64> },
    /// sign of each channel that rotates
    Hinges(Vec<f64>),
}

impl Mirror {
    fn new(skeleton: &Skeleton) -> Result<Self> {
        let partners = partners(skeleton)?;
        let flip = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        let all = skeleton.joints();
        let mut mirrored = Vec::with_capacity(all.len());
        let mut joints = Vec::with_capacity(all.len());
        for (j, &partner) in partners.iter().enumerate() {
            let (to, from) = (&all[j], &all[partner]);
            mirrored.push(Joint { offset: flip * from.offset, tip: flip * from.tip, ..to.clone() });
            let b = to.axes.matrix().transpose() * flip * from.axes.matrix();
            joints.push(Step {
                to: skeleton.dofs(j).start,
                from: skeleton.dofs(partner).start,
                channels: to.channels.clone(),
                rotation: rotation(to, &b)?,
            });
        }
        let skeleton = Skeleton::new(skeleton.name(), mirrored)
            .map_err(|e| Error::Mirror { joint: skeleton.name().to_owned(), reason: e.to_string() })?;
        Ok(Self { skeleton: skeleton.into(), joints })
    }

    /// `pose`, `out`: channel values, metres and radians, shape `[dofs]`; angles are taken nearest to `previous`.
    fn pose(&self, pose: &[f64], previous: &[f64], out: &mut [f64]) {
        for step in &self.joints {
            let count = step.channels.len();
            let from = &pose[step.from..step.from + count];
            let near = &previous[step.to..step.to + count];
            let out = &mut out[step.to..step.to + count];
            for ((channel, value), out) in step.channels.iter().zip(from).zip(out.iter_mut()) {
                let is_across = channel.kind == ChannelKind::Translation && channel.axis == Axis::X;
                *out = if is_across { -value } else { *value };
            }
            match &step.rotation {
                Rotation::Hinges(signs) => {
                    for (out, sign) in out.iter_mut().zip(signs) {
                        *out *= sign;
                    }
                }
                Rotation::Free { order, slots, b } => {
                    let rotation = rotation_from_angles(order, &slots.map(|s| from[s]));
                    let rotation = b * rotation * b.transpose();
                    let angles = angles_from_rotation(*order, &rotation, slots.map(|s| near[s]));
                    for (slot, angle) in slots.iter().zip(angles) {
                        out[*slot] = angle;
                    }
                }
            }
        }
    }
}

fn rotation(joint: &Joint, b: &Matrix3<f64>) -> Result<Rotation> {
    let slot = |axis: Axis| {
        joint.channels.iter().position(|c| c.kind == ChannelKind::Rotation && c.axis == axis).unwrap_or(0)
    };
    if let [x, y, z] = joint.rotation_order[..] {
        let order = [x, y, z];
        return Ok(Rotation::Free { order, slots: order.map(slot), b: *b });
    }
    let sign = |channel: &Channel| {
        if channel.kind == ChannelKind::Translation {
            return Ok(1.0);
        }
        let i = channel.axis.index();
        // A reflection turns the sense of rotation about: R(a, θ) becomes R(B a, −θ).
        let cosine = b[(i, i)];
        if cosine.abs() < MIN_AXIS_COSINE {
            let angle = cosine.abs().acos().to_degrees();
            let reason = format!(
                "its axis {channel} is {angle:.0}° from the mirror image of the other side's, expected 0°"
            );
            return Err(Error::Mirror { joint: joint.name.clone(), reason });
        }
        Ok(-cosine.signum())
    };
    Ok(Rotation::Hinges(joint.channels.iter().map(sign).collect::<Result<_>>()?))
}

/// The joint of the other side for every joint; itself in the middle.
fn partners(skeleton: &Skeleton) -> Result<Vec<usize>> {
    let joints = skeleton.joints();
    let partners: Vec<usize> = joints
        .iter()
        .enumerate()
        .map(|(j, joint)| other_sides(&joint.name).iter().find_map(|n| skeleton.joint_index(n)).unwrap_or(j))
        .collect();
    for (j, joint) in joints.iter().enumerate() {
        let partner = &joints[partners[j]];
        let wrong = |reason: String| Err(Error::Mirror { joint: joint.name.clone(), reason });
        if partners[partners[j]] != j || joint.parent.map(|p| partners[p]) != partner.parent {
            return wrong(format!("it and {} do not hang from joints that are a pair", partner.name));
        }
        let channels = |j: &Joint| j.channels.iter().map(Channel::to_string).collect::<Vec<_>>().join(" ");
        if channels(joint) != channels(partner) || joint.rotation_order != partner.rotation_order {
            let (found, expected) = (channels(joint), channels(partner));
            return wrong(format!("it has channels {found}, {} has {expected}", partner.name));
        }
    }
    Ok(partners)
}

/// Names that the joint of the other side may have, likeliest first.
fn other_sides(name: &str) -> Vec<String> {
    const WORDS: [(&str, &str); 3] = [("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT")];
    const LETTERS: [(char, char); 2] = [('l', 'r'), ('L', 'R')];
    let mut names = Vec::new();
    for (left, right) in WORDS {
        if name.contains(left) {
            names.push(name.replacen(left, right, 1));
        } else if name.contains(right) {
            names.push(name.replacen(right, left, 1));
        }
    }
    for (left, right) in LETTERS.into_iter().chain(LETTERS.map(|(l, r)| (r, l))) {
        if let Some(rest) = name.strip_prefix(left) {
            names.push(format!("{right}{rest}"));
        }
        if let Some(rest) = name.strip_suffix(left).filter(|rest| rest.ends_with(['_', '.', '-'])) {
            names.push(format!("{rest}{right}"));
        }
    }
    names
}
