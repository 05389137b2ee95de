use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::{Axis, Channel, ChannelKind, Error, Joint, Skeleton};

/// A skeleton as it is written to headers and artefacts: metres and radians, parents first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkeletonRecord {
    name: String,
    joints: Vec<JointRecord>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct JointRecord {
    name: String,
    parent: Option<usize>,
    offset: [f64; 3],
    tip: [f64; 3],
    /// row-major
    axes: [[f64; 3]; 3],
    channels: Vec<ChannelRecord>,
    rotation_order: Vec<Axis>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct ChannelRecord {
    kind: ChannelKind,
    axis: Axis,
    /// infinite limits are `null`
    limits: Option<(Option<f64>, Option<f64>)>,
}

impl From<Skeleton> for SkeletonRecord {
    fn from(skeleton: Skeleton) -> Self {
        Self::from(&skeleton)
    }
}

impl From<&Skeleton> for SkeletonRecord {
    fn from(skeleton: &Skeleton) -> Self {
        let finite = |v: f64| v.is_finite().then_some(v);
        let joints = skeleton.joints().iter().map(|joint| JointRecord {
            name: joint.name.clone(),
            parent: joint.parent,
            offset: joint.offset.into(),
            tip: joint.tip.into(),
            axes: joint.axes.matrix().transpose().into(),
            channels: joint
                .channels
                .iter()
                .map(|c| ChannelRecord {
                    kind: c.kind,
                    axis: c.axis,
                    limits: c.limits.map(|(low, high)| (finite(low), finite(high))),
                })
                .collect(),
            rotation_order: joint.rotation_order.clone(),
        });
        Self { name: skeleton.name().to_owned(), joints: joints.collect() }
    }
}

impl TryFrom<SkeletonRecord> for Skeleton {
    type Error = Error;

    fn try_from(record: SkeletonRecord) -> Result<Self, Error> {
        let joints = record.joints.into_iter().map(|joint| Joint {
            name: joint.name,
            parent: joint.parent,
            offset: Vector3::from(joint.offset),
            tip: Vector3::from(joint.tip),
            axes: Rotation3::from_matrix_unchecked(Matrix3::from(joint.axes).transpose()),
            channels: joint
                .channels
                .into_iter()
                .map(|c| Channel {
                    kind: c.kind,
                    axis: c.axis,
                    limits: c
                        .limits
                        .map(|(low, high)| (low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY))),
                })
                .collect(),
            rotation_order: joint.rotation_order,
        });
        Self::new(record.name, joints.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_skeleton_survives_its_record() {
        let mut root = Joint::root("root", vec![Channel::translation(Axis::Y), Channel::rotation(Axis::Z)]);
        root.axes = Rotation3::from_euler_angles(0.1, 0.2, 0.3);
        root.channels[1].limits = Some((f64::NEG_INFINITY, 0.25));
        let skeleton = Skeleton::new("s", vec![root]).unwrap();
        let back = Skeleton::try_from(SkeletonRecord::from(&skeleton)).unwrap();
        assert_eq!(back, skeleton);
    }
}
