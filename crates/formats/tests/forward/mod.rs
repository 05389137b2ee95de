//! Forward kinematics as the model's `Joint` states it, for comparing what was written with what was read.

use model::{ChannelKind, Skeleton};
use nalgebra::{Rotation3, Vector3};

/// Position of every joint and of its tip, metres in the world, in the order of the joints.
pub fn positions(skeleton: &Skeleton, pose: &[f64]) -> Vec<[Vector3<f64>; 2]> {
    let mut rotations = Vec::<Rotation3<f64>>::new();
    let mut starts = Vec::<Vector3<f64>>::new();
    for (index, joint) in skeleton.joints().iter().enumerate() {
        let values = &pose[skeleton.dofs(index)];
        let mut offset = joint.offset;
        let mut rotation = joint.axes;
        for (channel, value) in joint.channels.iter().zip(values) {
            if channel.kind == ChannelKind::Translation {
                offset += channel.axis.unit().into_inner() * *value;
            }
        }
        for axis in &joint.rotation_order {
            let place = joint
                .channels
                .iter()
                .position(|c| c.kind == ChannelKind::Rotation && c.axis == *axis)
                .unwrap();
            rotation *= Rotation3::from_axis_angle(&axis.unit(), values[place]);
        }
        rotation *= joint.axes.inverse();
        let (world, start) =
            joint.parent.map_or((Rotation3::identity(), Vector3::zeros()), |p| (rotations[p], starts[p]));
        starts.push(start + world * offset);
        rotations.push(world * rotation);
    }
    let tips = skeleton.joints().iter().map(|j| j.tip);
    starts
        .iter()
        .zip(rotations)
        .zip(tips)
        .map(|((start, rotation), tip)| [*start, start + rotation * tip])
        .collect()
}
