use crate::{Error, Result};

/// Most joints that move one vertex.
pub const INFLUENCES: usize = 4;
/// The stored weight of a vertex that one joint moves alone.
pub const WHOLE: u16 = u16::MAX;

/// Which joints move which vertex, and how much.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// joints of every vertex, those of the largest weights first; 0 where unused, shape `[vertices, 4]`
    joints: Vec<[u8; INFLUENCES]>,
    /// weights in 65535ths, of sum 65535, shape `[vertices, 4]`
    weights: Vec<[u16; INFLUENCES]>,
}

impl Skin {
    /// From joints and weights, shape `[vertices, 4]`; weights that are 0 are unused. They are rounded to 65535ths.
    ///
    /// # Errors
    /// [`Error::Skin`] names the first vertex whose joint isn't there or whose weights don't sum to 1.
    pub fn new(
        joints: &[[u8; INFLUENCES]],
        weights: &[[f32; INFLUENCES]],
        num_joints: usize,
    ) -> Result<Self> {
        if joints.len() != weights.len() {
            return Err(Error::Skin {
                what: format!("joints of {} vertices and weights of {}", joints.len(), weights.len()),
            });
        }
        let mut skin = Self { joints: Vec::new(), weights: Vec::new() };
        for (vertex, (&joints, &weights)) in joints.iter().zip(weights).enumerate() {
            let fail = |what: String| Err(Error::Skin { what: format!("vertex {vertex} {what}") });
            let sum: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
            if (sum - 1.0).abs() > 0.01 || weights.iter().any(|weight| *weight < 0.0 || weight.is_nan()) {
                return fail(format!("has weights {weights:?}, expected four that sum to 1"));
            }
            let mut pairs: [(u16, u8); INFLUENCES] = std::array::from_fn(|k| {
                let weight = (f64::from(weights[k]) / sum * f64::from(WHOLE)).round() as u16;
                (weight, if weight > 0 { joints[k] } else { 0 })
            });
            if let Some((_, joint)) = pairs.iter().find(|(_, joint)| usize::from(*joint) >= num_joints) {
                return fail(format!("follows joint {joint}, expected indices below {num_joints}"));
            }
            pairs.sort_by_key(|&(weight, joint)| (std::cmp::Reverse(weight), joint));
            let others: u16 = pairs[1..].iter().map(|(weight, _)| *weight).sum();
            pairs[0].0 = WHOLE - others;
            skin.joints.push(pairs.map(|(_, joint)| joint));
            skin.weights.push(pairs.map(|(weight, _)| weight));
        }
        Ok(skin)
    }

    /// From joints and weights in 65535ths as a file has them.
    pub(crate) fn from_parts(
        joints: &[[u8; INFLUENCES]],
        weights: &[[u16; INFLUENCES]],
        num_joints: usize,
    ) -> Result<Self> {
        for (vertex, (joints, weights)) in joints.iter().zip(weights).enumerate() {
            let fail = |what: String| Err(Error::Skin { what: format!("vertex {vertex} {what}") });
            let sum: u32 = weights.iter().map(|&weight| u32::from(weight)).sum();
            if sum != u32::from(WHOLE) || !weights.is_sorted_by(|a, b| a >= b) {
                return fail(format!("has weights {weights:?}, expected falling ones that sum to {WHOLE}"));
            }
            if let Some(joint) = joints.iter().find(|joint| usize::from(**joint) >= num_joints) {
                return fail(format!("follows joint {joint}, expected indices below {num_joints}"));
            }
        }
        Ok(Self { joints: joints.to_vec(), weights: weights.to_vec() })
    }

    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.joints.len()
    }

    /// Joints of every vertex, those of the largest weights first; 0 where unused, shape `[vertices, 4]`.
    pub fn joints(&self) -> &[[u8; INFLUENCES]] {
        &self.joints
    }

    /// Weights of every vertex in 65535ths; they sum to 65535, shape `[vertices, 4]`.
    pub fn weights(&self) -> &[[u16; INFLUENCES]] {
        &self.weights
    }

    /// The joints that move a vertex, and their weights, which sum to 1.
    pub fn influences(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let pairs = self.joints[vertex].into_iter().zip(self.weights[vertex]);
        pairs
            .filter(|(_, weight)| *weight > 0)
            .map(|(joint, weight)| (usize::from(joint), f64::from(weight) / f64::from(WHOLE)))
    }
}
