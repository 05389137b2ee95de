use crate::Rig;

/// A part of the body that moves as a whole: what is told apart when a pose is judged part by part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Limb {
    /// pelvis, spine, chest and collar bones
    Torso,
    /// neck and head
    Head,
    /// left upper arm
    LeftUpperArm,
    /// left forearm and hand
    LeftLowerArm,
    /// right upper arm
    RightUpperArm,
    /// right forearm and hand
    RightLowerArm,
    /// left thigh
    LeftUpperLeg,
    /// left shin and foot
    LeftLowerLeg,
    /// right thigh
    RightUpperLeg,
    /// right shin and foot
    RightLowerLeg,
}

impl Limb {
    /// All of them, parents first.
    pub const ALL: [Self; 10] = [
        Self::Torso,
        Self::Head,
        Self::LeftUpperArm,
        Self::LeftLowerArm,
        Self::RightUpperArm,
        Self::RightLowerArm,
        Self::LeftUpperLeg,
        Self::LeftLowerLeg,
        Self::RightUpperLeg,
        Self::RightLowerLeg,
    ];

    /// As people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Torso => "torso",
            Self::Head => "head",
            Self::LeftUpperArm => "left upper arm",
            Self::LeftLowerArm => "left lower arm",
            Self::RightUpperArm => "right upper arm",
            Self::RightLowerArm => "right lower arm",
            Self::LeftUpperLeg => "left upper leg",
            Self::LeftLowerLeg => "left lower leg",
            Self::RightUpperLeg => "right upper leg",
            Self::RightLowerLeg => "right lower leg",
        }
    }

    /// The limb that this one hangs from.
    pub fn parent(self) -> Option<Self> {
        match self {
            Self::Torso => None,
            Self::LeftLowerArm => Some(Self::LeftUpperArm),
            Self::RightLowerArm => Some(Self::RightUpperArm),
            Self::LeftLowerLeg => Some(Self::LeftUpperLeg),
            Self::RightLowerLeg => Some(Self::RightUpperLeg),
            _ => Some(Self::Torso),
        }
    }

    /// Limb of every joint's bone, shape `[joints]`. A joint whose name says nothing belongs to its parent's.
    pub fn for_joints(rig: &Rig) -> Vec<Self> {
        let mut limbs: Vec<Self> = Vec::new();
        for joint in rig.joints() {
            let inherited = joint.parent.map_or(Self::Torso, |parent| limbs[parent]);
            limbs.push(match joint.name.as_str() {
                "neck" | "head" => Self::Head,
                "l_shoulder" => Self::LeftUpperArm,
                "l_elbow" => Self::LeftLowerArm,
                "r_shoulder" => Self::RightUpperArm,
                "r_elbow" => Self::RightLowerArm,
                "l_hip" => Self::LeftUpperLeg,
                "l_knee" => Self::LeftLowerLeg,
                "r_hip" => Self::RightUpperLeg,
                "r_knee" => Self::RightLowerLeg,
                _ => inherited,
            });
        }
        limbs
    }
}
