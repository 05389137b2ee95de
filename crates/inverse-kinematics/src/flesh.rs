//! Where the middle of the flesh is along a body's bones, and how wide it is there.

use body::{BodyModel, Shape};
use nalgebra::Vector3;

/// Shares of a bone at which the flesh is looked at.
const SHARES: [f64; 3] = [0.25, 0.5, 0.75];
/// Vertices within this share of the bone's length count.
const SLICE: f64 = 0.1;

/// The middle of the flesh somewhere along a bone: what images show, since bones do not run through it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flesh {
    /// from the bone's joint at rest, metres
    pub middle: Vector3<f64>,
    /// mean of its half widths across the bone, metres
    pub half_width_m: f64,
}

/// The flesh along a bone of the body at rest, from `joint`, at a quarter, half and three quarters of it.
pub fn along(model: &BodyModel, shape: &Shape, joint: usize, bone: &Vector3<f64>) -> Vec<Flesh> {
    let at = |share: f64| {
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for (vertex, position) in shape.vertices.iter().enumerate() {
            let own = model.skin().influences(vertex).filter(|(influencing, _)| *influencing == joint);
            let weight: f64 = own.map(|(_, weight)| weight).sum();
            let from_joint = position - shape.joints[joint];
            let along = from_joint.dot(bone) / bone.norm_squared();
            if weight > 0.5 && (along - share).abs() < SLICE {
                let off_bone = from_joint - bone * along;
                low = low.inf(&off_bone);
                high = high.sup(&off_bone);
            }
        }
        if low.x > high.x {
            return Flesh { middle: bone * share, half_width_m: 0.0 };
        }
        // of the three extents the one along the bone is about nothing
        let half_width_m = (high - low).sum() / 4.0;
        Flesh { middle: bone * share + (low + high) * 0.5, half_width_m }
    };
    SHARES.into_iter().map(at).collect()
}
