use std::collections::BTreeMap;
use std::sync::Arc;

use kinematics::{rotation_exp, rotation_log};
use model::{Axis, Channel, ChannelKind, Joint, Skeleton};
use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::components::principal;
use crate::random::{Purpose, RandomStream};
use crate::{Error, Result};

/// Components of body size that are kept.
const MOST_COMPONENTS: usize = 4;
/// Shortest bone that is told from none, metres.
const SHORTEST_M: f64 = 1e-4;

/// Bone lengths of people: the joints of the CMU skeleton, mean directions, mean logarithms of lengths, and how the
/// lengths vary together. No skeleton in it is a recorded person's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Body {
    joints: Vec<JointShape>,
    /// each component at one deviation, change of the logarithm of every joint's length, shape `[components][joints]`
    components: Vec<Vec<f64>>,
    /// number of skeletons learned from
    pub subjects: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointShape {
    name: String,
    parent: Option<usize>,
    /// rotation vector of `Joint::axes`, radians
    axes: [f64; 3],
    channels: Vec<ChannelShape>,
    /// axes of the rotations, leftmost first: 0, 1, 2
    rotation_order: Vec<usize>,
    /// unit vector along the bone
    direction: [f64; 3],
    /// logarithm of the bone's length in metres; `None` without a bone
    log_length: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelShape {
    is_translation: bool,
    axis: usize,
    limits: Option<(f64, f64)>,
}

impl Body {
    /// Learns from one skeleton per subject, all of one structure, in the order of the subjects' names.
    pub fn learn(skeletons: &BTreeMap<String, Arc<Skeleton>>) -> Result<Self> {
        let Some(first) = skeletons.values().next() else { return Err(Error::NoMotions) };
        let mut joints: Vec<JointShape> = first.joints().iter().map(shape).collect();
        for (subject, skeleton) in skeletons {
            check(skeleton, first).map_err(|reason| Error::Skeleton { motion: subject.clone(), reason })?;
            for (shape, joint) in joints.iter_mut().zip(skeleton.joints()) {
                widen_limits(shape, joint);
            }
        }
        let n = skeletons.len() as f64;
        let mut logs = vec![vec![0.0; joints.len()]; skeletons.len()];
        for (j, shape) in joints.iter_mut().enumerate() {
            let tips: Vec<Vector3<f64>> = skeletons.values().map(|s| s.joints()[j].tip).collect();
            let direction: Vector3<f64> = tips.iter().filter_map(|t| t.try_normalize(SHORTEST_M)).sum();
            let Some(direction) = direction.try_normalize(1e-6) else { continue };
            let lengths = tips.iter().map(|t| t.norm().max(SHORTEST_M).ln());
            let mean = lengths.clone().sum::<f64>() / n;
            shape.direction = direction.into();
            shape.log_length = Some(mean);
            logs.iter_mut().zip(lengths).for_each(|(row, l)| row[j] = l - mean);
        }
        let most = MOST_COMPONENTS.min(skeletons.len() / 3);
        let components = principal(&logs, &vec![1.0; logs.len()], &vec![1.0; joints.len()], most);
        Ok(Self { joints, components, subjects: skeletons.len() })
    }

    /// A skeleton drawn by seed.
    pub fn draw(&self, subject: u64) -> Result<Arc<Skeleton>> {
        let mut random = RandomStream::new(Purpose::Body, [0, subject, 0]);
        let scores: Vec<f64> = self.components.iter().map(|_| random.normal_within(2.0)).collect();
        self.with_scores(&format!("synthetic {subject}"), &scores)
    }

    /// The skeleton of mean lengths.
    pub fn mean(&self) -> Result<Arc<Skeleton>> {
        self.with_scores("synthetic mean", &vec![0.0; self.components.len()])
    }

    fn with_scores(&self, name: &str, scores: &[f64]) -> Result<Arc<Skeleton>> {
        let mut joints: Vec<Joint> = Vec::with_capacity(self.joints.len());
        for (j, shape) in self.joints.iter().enumerate() {
            let tip = match shape.log_length {
                Some(mean) => {
                    let change: f64 = self.components.iter().zip(scores).map(|(c, z)| c[j] * z).sum();
                    Vector3::from(shape.direction) * rounded((mean + change).exp())
                }
                None => Vector3::zeros(),
            };
            let offset = shape.parent.and_then(|p| joints.get(p)).map_or(Vector3::zeros(), |p| p.tip);
            joints.push(shape.joint(offset, tip));
        }
        Ok(Arc::new(Skeleton::new(name, joints)?))
    }

    /// Whether the numbers of a file make sense.
    pub fn check(&self) -> std::result::Result<(), String> {
        let sane = |v: &f64| v.abs() < 10.0;
        for (j, shape) in self.joints.iter().enumerate() {
            let numbers = shape.axes.iter().chain(&shape.direction).chain(&shape.log_length);
            let axes = shape.channels.iter().map(|c| c.axis).chain(shape.rotation_order.iter().copied());
            if !numbers.into_iter().all(sane) || !axes.into_iter().all(|a| a < 3) {
                return Err(format!("joint {j} of the body has a number out of range"));
            }
        }
        let fits = |c: &Vec<f64>| c.len() == self.joints.len() && c.iter().all(|v| v.abs() < 1.0);
        if self.components.len() > 64 || !self.components.iter().all(fits) {
            return Err(format!("components of the body do not fit its {} joints", self.joints.len()));
        }
        Ok(())
    }
}

impl JointShape {
    fn joint(&self, offset: Vector3<f64>, tip: Vector3<f64>) -> Joint {
        let axis = |a: usize| [Axis::X, Axis::Y, Axis::Z][a.min(2)];
        let channel = |c: &ChannelShape| Channel {
            kind: if c.is_translation { ChannelKind::Translation } else { ChannelKind::Rotation },
            axis: axis(c.axis),
            limits: c.limits,
        };
        Joint {
            name: self.name.clone(),
            parent: self.parent,
            offset,
            tip,
            axes: Rotation3::from_matrix_unchecked(rotation_exp(&Vector3::from(self.axes))),
            channels: self.channels.iter().map(channel).collect(),
            rotation_order: self.rotation_order.iter().map(|&a| axis(a)).collect(),
        }
    }
}

fn shape(joint: &Joint) -> JointShape {
    let channel = |c: &Channel| ChannelShape {
        is_translation: c.kind == ChannelKind::Translation,
        axis: c.axis.index(),
        limits: c.limits.filter(|(low, high)| low.is_finite() && high.is_finite()),
    };
    JointShape {
        name: joint.name.clone(),
        parent: joint.parent,
        axes: rotation_log(joint.axes.matrix()).into(),
        channels: joint.channels.iter().map(channel).collect(),
        rotation_order: joint.rotation_order.iter().map(|a| a.index()).collect(),
        direction: [0.0; 3],
        log_length: None,
    }
}

fn widen_limits(shape: &mut JointShape, joint: &Joint) {
    for (channel, other) in shape.channels.iter_mut().zip(&joint.channels) {
        if let (Some((low, high)), Some((l, h))) = (&mut channel.limits, other.limits) {
            *low = low.min(if l.is_finite() { l } else { *low });
            *high = high.max(if h.is_finite() { h } else { *high });
        }
    }
}

fn check(skeleton: &Skeleton, first: &Skeleton) -> std::result::Result<(), String> {
    if !skeleton.same_structure(first) {
        return Err(format!("skeleton {} is not of the structure of the others", skeleton.name()));
    }
    for (joint, other) in skeleton.joints().iter().zip(first.joints()) {
        let parent_tip = joint.parent.map_or(Vector3::zeros(), |p| skeleton.joints()[p].tip);
        if (joint.offset - parent_tip).norm() > 1e-6 {
            return Err(format!("joint {} is not at the end of its parent's bone", joint.name));
        }
        if (joint.axes.matrix() - other.axes.matrix()).norm() > 1e-3 {
            return Err(format!("joint {} has other axes than in the first skeleton", joint.name));
        }
    }
    Ok(())
}

/// To a micrometre, so that the last bit of a platform's `exp` does not show.
fn rounded(length_m: f64) -> f64 {
    (length_m * 1e6).round() / 1e6
}
