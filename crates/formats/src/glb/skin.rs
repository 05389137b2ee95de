//! Skeleton, skin weights and animation of a GLB.

use nalgebra::Vector3;
use serde_json::{Value, json};

use super::{Animation, Joint, SkinnedMesh, buffer::Buffer, count};
use crate::{Error, Result};

type Influences = (Vec<[u8; 4]>, Vec<[f32; 4]>);

/// Joints and weights of the vertices as the format wants them: a sum of 1, each joint once, joint 0 where the weight is 0.
pub(super) fn attributes(body: &SkinnedMesh) -> Result<Influences> {
    let vertices = body.mesh.vertices.len();
    count("joint indices", body.joint_indices.len(), vertices)?;
    count("weights", body.weights.len(), vertices)?;
    let mut influences = (Vec::with_capacity(vertices), Vec::with_capacity(vertices));
    for (vertex, (given, weights)) in body.joint_indices.iter().zip(&body.weights).enumerate() {
        let (mut joints, mut sums) = ([0; 4], [0_f32; 4]);
        let mut used = 0;
        for (&joint, &weight) in given.iter().zip(weights) {
            if !(weight >= 0.0 && weight.is_finite()) || usize::from(joint) >= body.joints.len() {
                let found = format!("weight {weight} of joint {joint} at vertex {vertex}");
                let expected = format!("weights from 0 and joints below {}", body.joints.len());
                return Err(Error::whole_file(found, expected));
            }
            if weight == 0.0 {
                continue;
            }
            let at = joints[..used].iter().position(|other| *other == joint).unwrap_or(used);
            joints[at] = joint;
            sums[at] += weight;
            used = used.max(at + 1);
        }
        let sum: f32 = sums.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return Err(Error::whole_file(
                format!("vertex {vertex} without weights"),
                "at least one joint that moves it",
            ));
        }
        influences.0.push(joints);
        influences.1.push(sums.map(|weight| weight / sum));
    }
    Ok(influences)
}

/// The nodes of the joints, of which the first is node 1.
pub(super) fn nodes(joints: &[Joint]) -> Result<Vec<Value>> {
    let mut children = vec![Vec::new(); joints.len()];
    for (index, joint) in joints.iter().enumerate() {
        match joint.parent {
            None if index == 0 => {}
            Some(parent) if parent < index => children[parent].push(index + 1),
            parent => {
                let found = format!("joint {index} ({}) with parent {parent:?}", joint.name);
                return Err(Error::whole_file(found, "an earlier joint; only joint 0 is the root"));
            }
        }
    }
    if joints.is_empty() {
        return Err(Error::whole_file("no joint", "at least a root"));
    }
    let node = |(joint, children): (&Joint, Vec<usize>)| {
        let above = joint.parent.map_or_else(Vector3::zeros, |parent| joints[parent].rest_position);
        let offset = joint.rest_position - above;
        let mut node = json!({ "name": joint.name, "translation": [offset.x, offset.y, offset.z] });
        // the format forbids empty lists
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        node
    };
    Ok(joints.iter().zip(children).map(node).collect())
}

/// The animation: rotations of all joints and the place of the root, linear between frames.
pub(super) fn animation(buffer: &mut Buffer, joints: usize, animation: &Animation) -> Result<Value> {
    let Animation { times, rotations, translations } = animation;
    let frames = times.len();
    count("translations of the root", translations.len(), frames)?;
    count("rotations", rotations.len(), frames.saturating_mul(joints))?;
    let in_single: Vec<f32> = times.iter().map(|time| *time as f32).collect();
    let is_rising = in_single.windows(2).all(|pair| pair[0] < pair[1]);
    if frames == 0 || !is_rising || !(in_single[0] >= 0.0 && in_single[frames - 1].is_finite()) {
        return Err(Error::whole_file(
            format!("{frames} times that do not rise from 0 or more"),
            "rising times",
        ));
    }
    let input = buffer.times(&in_single);
    let place = buffer.places(translations);
    let mut samplers = vec![json!({ "input": input, "output": place, "interpolation": "LINEAR" })];
    let mut channels = vec![json!({ "sampler": 0, "target": { "node": 1, "path": "translation" } })];
    for joint in 0..joints {
        // q and -q are the same rotation, but the way between frames must be the short one
        let mut last = [0.0_f64; 4];
        let joint_rotations = rotations.iter().skip(joint).step_by(joints).map(|rotation| {
            let c = rotation.coords;
            let is_far = c.iter().zip(last).map(|(a, b)| a * b).sum::<f64>() < 0.0;
            last = [c.x, c.y, c.z, c.w].map(|number| if is_far { -number } else { number });
            last.map(|number| number as f32)
        });
        let joint_rotations: Vec<_> = joint_rotations.collect();
        let output = buffer.rotations(&joint_rotations);
        channels
            .push(json!({ "sampler": samplers.len(), "target": { "node": joint + 1, "path": "rotation" } }));
        samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
    }
    Ok(json!({ "name": "motion", "samplers": samplers, "channels": channels }))
}
