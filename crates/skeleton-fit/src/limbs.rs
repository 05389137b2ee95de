use kinematics::{Kinematics, Parametrisation, State};
use model::{Joint, Skeleton};

use crate::Result;

/// A part of the body whose bones are scaled together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limb {
    /// from the collar bones to the finger tips
    Arms,
    /// from the hip bones to the toes
    Legs,
    /// everything else: spine, neck and head
    Trunk,
}

/// All limbs, in the order in which their numbers stand.
pub const LIMBS: [Limb; 3] = [Limb::Arms, Limb::Legs, Limb::Trunk];

/// Which limb every bone of a skeleton belongs to. Found from the shape of the tree in the rest pose, not from names:
/// legs hang from the root and reach far below it, arms branch off the trunk where the neck does not.
#[derive(Debug, Clone, PartialEq)]
pub struct Limbs {
    by_joint: Vec<Limb>,
}

impl Limbs {
    /// The limbs of `skeleton`. What cannot be told apart is trunk.
    pub fn from_skeleton(skeleton: &Skeleton) -> Self {
        let tree = Tree::new(skeleton);
        let mut by_joint = vec![Limb::Trunk; skeleton.num_joints()];
        let Some(pelvis) = tree.first_branch(0) else { return Self { by_joint } };
        let height = tree.state.positions[pelvis].y;
        let drop = |j: usize| height - tree.lowest(j);
        let deepest = tree.children(pelvis).map(drop).fold(0.0, f64::max);
        for child in tree.children(pelvis) {
            if drop(child) > 0.5 * deepest && deepest > 0.0 {
                tree.mark(child, Limb::Legs, &mut by_joint);
                continue;
            }
            let Some(chest) = tree.first_branch(child) else { continue };
            let head = tree.children(chest).max_by(|a, b| tree.highest(*a).total_cmp(&tree.highest(*b)));
            for arm in tree.children(chest).filter(|j| Some(*j) != head) {
                tree.mark(arm, Limb::Arms, &mut by_joint);
            }
        }
        Self { by_joint }
    }

    /// The limb to which the bone of a joint belongs: what lies between the joint and its tip or its children.
    pub fn limb(&self, joint: usize) -> Limb {
        self.by_joint[joint]
    }

    /// The limb that the offset of a joint from its parent belongs to; `None` for the root.
    pub fn offset_limb(&self, joint: &Joint) -> Option<Limb> {
        joint.parent.map(|parent| self.by_joint[parent])
    }

    /// Sum of the bone lengths of every limb, metres; offsets between joints, and tips of joints without children.
    pub fn lengths(&self, skeleton: &Skeleton) -> [f64; 3] {
        let mut lengths = [0.0; 3];
        let mut is_parent = vec![false; skeleton.num_joints()];
        for joint in skeleton.joints() {
            if let Some(parent) = joint.parent {
                is_parent[parent] = true;
                lengths[self.by_joint[parent] as usize] += joint.offset.norm();
            }
        }
        for (j, joint) in skeleton.joints().iter().enumerate().filter(|(j, _)| !is_parent[*j]) {
            lengths[self.by_joint[j] as usize] += joint.tip.norm();
        }
        lengths
    }

    /// `skeleton` with the bones of every limb `scales` times as long.
    ///
    /// # Errors
    /// If a scale is not finite.
    pub fn scaled(&self, skeleton: &Skeleton, scales: [f64; 3]) -> Result<Skeleton> {
        let joints = skeleton.joints().iter().enumerate().map(|(j, joint)| {
            let mut joint = joint.clone();
            if let Some(limb) = self.offset_limb(&joint) {
                joint.offset *= scales[limb as usize];
            }
            joint.tip *= scales[self.by_joint[j] as usize];
            joint
        });
        Ok(Skeleton::new(skeleton.name(), joints.collect())?)
    }
}

/// The joints in the rest pose.
struct Tree<'a> {
    skeleton: &'a Skeleton,
    state: State,
}

impl<'a> Tree<'a> {
    fn new(skeleton: &'a Skeleton) -> Self {
        let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
        let mut state = kinematics.state();
        kinematics.update(&vec![0.0; skeleton.num_dofs()], &mut state);
        Self { skeleton, state }
    }

    fn children(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        let joints = self.skeleton.joints().iter().enumerate();
        joints.filter(move |(_, j)| j.parent == Some(joint)).map(|(j, _)| j)
    }

    /// `joint` or the first below it with at least two children.
    fn first_branch(&self, joint: usize) -> Option<usize> {
        let mut at = joint;
        loop {
            let mut children = self.children(at);
            match (children.next(), children.next()) {
                (Some(_), Some(_)) => return Some(at),
                (Some(only), None) => at = only,
                _ => return None,
            }
        }
    }

    /// The joints from `joint` down.
    fn below(&self, joint: usize) -> Vec<usize> {
        let mut found = vec![joint];
        let mut next = 0;
        while let Some(&at) = found.get(next) {
            found.extend(self.children(at));
            next += 1;
        }
        found
    }

    fn heights(&self, joint: usize) -> impl Iterator<Item = f64> + '_ {
        self.below(joint).into_iter().flat_map(|j| {
            let tip = self.state.point(j, &self.skeleton.joints()[j].tip).y;
            [self.state.positions[j].y, tip]
        })
    }

    fn lowest(&self, joint: usize) -> f64 {
        self.heights(joint).fold(f64::INFINITY, f64::min)
    }

    fn highest(&self, joint: usize) -> f64 {
        self.heights(joint).fold(f64::NEG_INFINITY, f64::max)
    }

    fn mark(&self, joint: usize, limb: Limb, by_joint: &mut [Limb]) {
        for j in self.below(joint) {
            by_joint[j] = limb;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sample_motion::{Action, DrawOptions, Model};

    fn drawn() -> Skeleton {
        let options = DrawOptions { frames: 2, subject: 1 };
        Model::bundled().draw(Action::Walk, 1, &options).unwrap().skeleton().as_ref().clone()
    }

    #[test]
    fn limbs_are_told_apart_by_the_shape_of_the_tree() {
        let skeleton = drawn();
        let limbs = Limbs::from_skeleton(&skeleton);
        let limb = |name| limbs.limb(skeleton.joint_index(name).unwrap());
        for leg in ["lhipjoint", "lfemur", "rtibia", "rtoes"] {
            assert_eq!(limb(leg), Limb::Legs, "{leg}");
        }
        for arm in ["lclavicle", "rhumerus", "lhand", "rthumb"] {
            assert_eq!(limb(arm), Limb::Arms, "{arm}");
        }
        for trunk in ["root", "lowerback", "thorax", "lowerneck", "head"] {
            assert_eq!(limb(trunk), Limb::Trunk, "{trunk}");
        }
    }

    #[test]
    fn a_limb_is_scaled_alone() {
        let skeleton = drawn();
        let limbs = Limbs::from_skeleton(&skeleton);
        let before = limbs.lengths(&skeleton);
        let after = limbs.lengths(&limbs.scaled(&skeleton, [1.1, 0.9, 1.0]).unwrap());
        for ((after, before), scale) in after.iter().zip(before).zip([1.1, 0.9, 1.0]) {
            assert!((after - scale * before).abs() < 1e-9);
        }
    }

    #[test]
    fn a_chain_without_branches_is_all_trunk() {
        let root = Joint::root("root", vec![]);
        let tail = Joint::child("tail", 0, nalgebra::Vector3::y(), vec![]);
        let skeleton = Skeleton::new("worm", vec![root, tail]).unwrap();
        let limbs = Limbs::from_skeleton(&skeleton);
        assert_eq!((limbs.limb(0), limbs.limb(1)), (Limb::Trunk, Limb::Trunk));
        assert_eq!(limbs.lengths(&skeleton), [0.0, 0.0, 1.0]);
    }
}
