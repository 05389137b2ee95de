use kinematics::{Kinematics, Parametrisation};
use model::Skeleton;
use serde::{Deserialize, Serialize};

use crate::{LIMBS, Limb, Limbs};

/// A few lengths of a body, metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sizes {
    /// from the lowest to the highest joint or bone end in the rest pose
    pub height_m: f64,
    /// along the bones from collar bone to finger tip
    pub arm_m: f64,
    /// along the bones from hip bone to toe
    pub leg_m: f64,
}

impl Sizes {
    /// Of a skeleton. A limb that it does not have is 0 long.
    pub fn from_skeleton(skeleton: &Skeleton) -> Self {
        let limbs = Limbs::from_skeleton(skeleton);
        let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
        let mut state = kinematics.state();
        kinematics.update(&vec![0.0; skeleton.num_dofs()], &mut state);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut longest = [0.0f64; LIMBS.len()];
        let mut way = vec![0.0; skeleton.num_joints()];
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let limb = limbs.limb(j);
            if let Some(parent) = joint.parent.filter(|p| limbs.limb(*p) == limb) {
                way[j] = way[parent] + joint.offset.norm();
            }
            let tip = state.point(j, &joint.tip);
            low = low.min(state.positions[j].y).min(tip.y);
            high = high.max(state.positions[j].y).max(tip.y);
            let longest = &mut longest[limb as usize];
            *longest = longest.max(way[j] + joint.tip.norm());
        }
        Self {
            height_m: high - low,
            arm_m: longest[Limb::Arms as usize],
            leg_m: longest[Limb::Legs as usize],
        }
    }
}
