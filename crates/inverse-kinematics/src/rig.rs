//! A morphable body's skeleton as a chain, so that the whole body is solved by the same code as a limb.

use body::{BodyModel, DofKind, Limb, ROOT_DOFS, Shape};
use kinematics::{
    ControlPoint, Parametrisation, angles_from_rotation, control_points, rotation_exp, rotation_from_angles,
    rotation_log,
};
use model::{Axis, Channel, Joint, Skeleton};
use nalgebra::{Rotation3, Unit, Vector3};

use crate::{Chain, Result, SupportWidth, flesh};

/// Order of the root's rotations: its pole is at 90° of tilt about x.
const ORDER: [Axis; 3] = [Axis::Y, Axis::X, Axis::Z];

/// The chain of a body and what its coordinates are in the body's pose.
///
/// The first six coordinates are the root's translation (metres) and its rotations about y, x, z; then come the rig's
/// angles, joint by joint, with the rig's limits. The points are the rig's joints, in its order, and behind them the middles
/// of the flesh along arms and legs, through which the segments of these run; the other segments are bones.
#[derive(Debug, Clone)]
pub struct RigChain {
    /// the chain
    pub chain: Chain,
    /// place of the root at rest, metres
    root: Vector3<f64>,
    /// the rig's DOF of each coordinate from the seventh on
    rig_dofs: Vec<usize>,
    /// coordinates that turn a limb's upper bone about itself
    twists: Vec<usize>,
}

/// Half width of the flesh that the slopes of image supports are made for.
pub const WIDTH: SupportWidth = SupportWidth { inside_m: 0.06, outside_m: 0.3 };
/// Half width of trunk and head, metres: what is deeper inside says nothing of where they are.
const TRUNK_M: f64 = 0.1;

impl RigChain {
    /// The chain of one shape of a model.
    ///
    /// # Errors
    /// If the rig's joints are none that a skeleton can have.
    pub fn new(model: &BodyModel, shape: &Shape) -> Result<Self> {
        Self::with_points(model, shape, &[])
    }

    /// As [`new`](Self::new), with more points right behind the joints: their joints are the rig's, their offsets in metres
    /// along the axes of the rest pose.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_points(model: &BodyModel, shape: &Shape, more: &[ControlPoint]) -> Result<Self> {
        let rig = model.rig();
        let mut joints = Vec::<Joint>::new();
        // where what hangs from a rig's joint hangs in the skeleton
        let mut last = Vec::new();
        let mut limits = vec![[f64::NEG_INFINITY, f64::INFINITY]; ROOT_DOFS];
        let mut rig_dofs = Vec::new();
        for (index, joint) in rig.joints().iter().enumerate() {
            match joint.parent {
                None => {
                    let translations = [Axis::X, Axis::Y, Axis::Z].map(Channel::translation);
                    let rotations = ORDER.map(Channel::rotation);
                    joints
                        .push(Joint::root(&joint.name, translations.into_iter().chain(rotations).collect()));
                }
                Some(parent) => {
                    let offset = shape.joints[index] - shape.joints[parent];
                    joints.push(Joint::child(&joint.name, last[parent], offset, Vec::new()));
                }
            }
            for (d, dof) in rig.dofs().iter().enumerate() {
                if dof.joint != index || d < ROOT_DOFS || dof.kind == DofKind::Translation {
                    continue;
                }
                let parent = joints.len() - 1;
                let channel = vec![Channel::rotation(Axis::X)];
                let mut turned =
                    Joint::child(format!("turn:{}", dof.name), parent, Vector3::zeros(), channel);
                turned.axes = Rotation3::rotation_between(&Vector3::x(), &dof.axis).unwrap_or_else(|| {
                    Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::y()), std::f64::consts::PI)
                });
                joints.push(turned);
                limits.push(dof.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]));
                rig_dofs.push(d);
            }
            last.push(joints.len() - 1);
        }
        let skeleton = Skeleton::new("rig", joints)?;
        let names: Vec<_> = rig.joints().iter().map(|joint| joint.name.as_str()).collect();
        let mut points = control_points(&skeleton, &names)?;
        let on_chain = |point: &ControlPoint| ControlPoint { joint: last[point.joint], ..point.clone() };
        points.extend(more.iter().map(on_chain));
        let Drawn { segments, widths } = draw(model, shape, &last, &mut points);
        let chain = Chain::new(&skeleton, Parametrisation::channels(&skeleton), points)?
            .with_segments(segments)?
            .with_widths(widths)?
            .with_limits(limits)?;
        let limbs = Limb::for_joints(rig);
        let is_twist = |&place: &usize| {
            let dof = &rig.dofs()[rig_dofs[place]];
            let same_joint = |&&d: &&usize| rig.dofs()[d].joint == dof.joint;
            let is_last = rig_dofs[place + 1..].iter().find(same_joint).is_none();
            // the last of several rotations of an upper arm or thigh
            is_last && rig_dofs[..place].iter().any(|d| same_joint(&d)) && limbs[dof.joint] != Limb::Torso
        };
        let twists = (0..rig_dofs.len()).filter(is_twist).map(|place| place + ROOT_DOFS).collect();
        Ok(Self { chain, root: shape.joints[0], rig_dofs, twists })
    }

    /// Coordinates that turn a limb's upper bone about itself, and with it the elbow or knee about the line from shoulder to
    /// wrist or hip to ankle.
    pub fn twists(&self) -> &[usize] {
        &self.twists
    }

    /// The body's pose (root translation, rotation vector, angles; shape `[dofs of the rig]`) of coordinates.
    pub fn pose(&self, x: &[f64], pose: &mut [f64]) {
        let rotation = rotation_from_angles(&ORDER, &[x[3], x[4], x[5]]);
        for axis in 0..3 {
            pose[axis] = x[axis] - self.root[axis];
        }
        pose[3..6].copy_from_slice(rotation_log(&rotation).as_slice());
        for (&dof, &value) in self.rig_dofs.iter().zip(&x[ROOT_DOFS..]) {
            pose[dof] = value;
        }
    }

    /// The coordinates of a body's pose: the inverse of [`pose`](Self::pose).
    pub fn coordinates(&self, pose: &[f64], x: &mut [f64]) {
        for axis in 0..3 {
            x[axis] = pose[axis] + self.root[axis];
        }
        let rotation = rotation_exp(&Vector3::new(pose[3], pose[4], pose[5]));
        x[3..6].copy_from_slice(&angles_from_rotation(ORDER, &rotation, [0.0; 3]));
        for (&dof, value) in self.rig_dofs.iter().zip(&mut x[ROOT_DOFS..]) {
            *value = pose[dof];
        }
    }
}

/// What images show of the body.
struct Drawn {
    segments: Vec<[usize; 2]>,
    /// of the image support, relative to [`WIDTH`], shape `[points]`
    widths: Vec<f64>,
}

/// Segments through the middle of the flesh of arms and legs, and along the other bones; adds the points that they need.
/// `last`: the skeleton's joint that carries each joint's bone.
fn draw(model: &BodyModel, shape: &Shape, last: &[usize], points: &mut Vec<ControlPoint>) -> Drawn {
    let joints = model.rig().joints();
    let limbs = Limb::for_joints(model.rig());
    let is_trunk = |joint: usize| matches!(limbs[joint], Limb::Torso | Limb::Head);
    let mut segments = Vec::new();
    let mut widths: Vec<f64> = vec![TRUNK_M / WIDTH.inside_m; points.len()];
    // where the flesh of the bone before ends
    let mut ends = vec![None; joints.len()];
    for (index, joint) in joints.iter().enumerate() {
        let Some(parent) = joint.parent else { continue };
        if is_trunk(parent) {
            if is_trunk(index) {
                segments.push([parent, index]);
            }
            continue;
        }
        // feet, which the rig does not bend, are seldom where they are drawn
        if model.rig().dofs().iter().all(|dof| dof.joint != parent) {
            continue;
        }
        let bone = shape.joints[index] - shape.joints[parent];
        let mut before: Option<usize> = ends[parent];
        for flesh in flesh::along(model, shape, parent, &bone) {
            let point = points.len();
            let name = format!("flesh:{}:{point}", joints[parent].name);
            points.push(ControlPoint { name, joint: last[parent], offset: flesh.middle });
            widths.push((flesh.half_width_m / WIDTH.inside_m).max(0.3));
            segments.extend(before.map(|before| [before, point]));
            before = Some(point);
        }
        ends[index] = before;
    }
    Drawn { segments, widths }
}
