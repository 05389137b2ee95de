//! Whether the standard deviations that a reconstruction states are those of its errors.

use kinematics::Parametrisation;
use model::{Motion, Skeleton};
use serde::{Deserialize, Serialize};

/// Share of a Gaussian's draws within one standard deviation of its mean.
pub const WITHIN_ONE: f64 = 0.682_689_492;
/// Share of a Gaussian's draws within two standard deviations of its mean.
pub const WITHIN_TWO: f64 = 0.954_499_736;

/// A part of the body whose coordinates are looked at together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DofGroup {
    /// where the root is
    RootPosition,
    /// heading and tilt of the root
    RootRotation,
    /// back, neck and head
    Trunk,
    /// shoulders, arms and forearms
    Arms,
    /// hands and fingers
    Hands,
    /// hips, thighs and shins
    Legs,
    /// feet and toes
    Feet,
    /// joints of other names
    Others,
}

impl DofGroup {
    /// All of them, in order.
    pub const ALL: [Self; 8] = [
        Self::RootPosition,
        Self::RootRotation,
        Self::Trunk,
        Self::Arms,
        Self::Hands,
        Self::Legs,
        Self::Feet,
        Self::Others,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::RootPosition => "root position",
            Self::RootRotation => "root rotation",
            Self::Trunk => "back, neck, head",
            Self::Arms => "shoulders, arms",
            Self::Hands => "hands, fingers",
            Self::Legs => "hips, legs",
            Self::Feet => "feet, toes",
            Self::Others => "other joints",
        }
    }

    /// Group of each coordinate of a skeleton, shape `[dofs]`: by the names of the joints (CMU's and those of common BVH rigs).
    pub fn for_skeleton(skeleton: &Skeleton, parametrisation: &Parametrisation) -> Vec<Self> {
        let mut groups = Vec::with_capacity(skeleton.num_dofs());
        for (j, joint) in skeleton.joints().iter().enumerate() {
            for dof in skeleton.dofs(j) {
                groups.push(match (j, parametrisation.is_angle(dof)) {
                    (0, false) => Self::RootPosition,
                    (0, true) => Self::RootRotation,
                    _ => Self::for_joint(&joint.name),
                });
            }
        }
        groups
    }

    fn for_joint(name: &str) -> Self {
        const WORDS: [(DofGroup, &[&str]); 5] = [
            (DofGroup::Hands, &["hand", "finger", "thumb", "wrist", "index", "pinky", "middle", "ring"]),
            (DofGroup::Feet, &["foot", "toe", "ankle"]),
            (DofGroup::Legs, &["hip", "leg", "femur", "tibia", "knee", "thigh", "shin"]),
            (DofGroup::Arms, &["arm", "clavicle", "collar", "shoulder", "humerus", "radius", "elbow"]),
            (DofGroup::Trunk, &["back", "spine", "thorax", "chest", "neck", "head", "abdomen"]),
        ];
        let name = name.to_ascii_lowercase();
        let found = WORDS.iter().find(|(_, words)| words.iter().any(|word| name.contains(word)));
        found.map_or(Self::Others, |(group, _)| *group)
    }
}

/// How many errors were compared with their standard deviations, and how many were within.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// coordinates × frames
    pub total: usize,
    /// truths within one standard deviation
    pub within_one: usize,
    /// truths within two
    pub within_two: usize,
}

impl Count {
    /// Share within one standard deviation: 0.683 if errors are Gaussian and the deviations right; more if they are too large.
    pub fn share_within_one(&self) -> f64 {
        self.within_one as f64 / self.total.max(1) as f64
    }

    /// Share within two standard deviations: 0.954 if all is well.
    pub fn share_within_two(&self) -> f64 {
        self.within_two as f64 / self.total.max(1) as f64
    }

    fn add(&mut self, other: &Self) {
        self.total += other.total;
        self.within_one += other.within_one;
        self.within_two += other.within_two;
    }
}

/// Counts by group of coordinates, in the order of [`DofGroup::ALL`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Calibration {
    /// shape `[8]`
    pub groups: [Count; DofGroup::ALL.len()],
}

impl Calibration {
    /// Over all joint angles, the root left out (as in the errors).
    pub fn joint_angles(&self) -> Count {
        let mut all = Count::default();
        for (group, count) in DofGroup::ALL.iter().zip(&self.groups) {
            if !matches!(group, DofGroup::RootPosition | DofGroup::RootRotation) {
                all.add(count);
            }
        }
        all
    }

    /// Adds the counts of another trial.
    pub fn add(&mut self, other: &Self) {
        for (a, b) in self.groups.iter_mut().zip(&other.groups) {
            a.add(b);
        }
    }

    /// Compares found coordinates with true ones. `truth`: poses in the file's channels; `found` and `sigmas`: coordinates of
    /// `parametrisation` and their standard deviations, metres and radians, shape `[frames, dofs]`. A standard deviation that is not positive
    /// states nothing and is not counted.
    pub fn measure(truth: &Motion, parametrisation: &Parametrisation, found: &[f64], sigmas: &[f64]) -> Self {
        let skeleton = truth.skeleton();
        let dofs = skeleton.num_dofs();
        let groups = DofGroup::for_skeleton(skeleton, parametrisation);
        let mut calibration = Self::default();
        let mut coordinates = vec![0.0; dofs];
        for (pose, (x, sigmas)) in truth.poses().zip(found.chunks_exact(dofs).zip(sigmas.chunks_exact(dofs)))
        {
            parametrisation.coordinates_from_pose(skeleton, pose, x[kinematics::HEADING], &mut coordinates);
            parametrisation.unwrap_near(&mut coordinates, x);
            let stated = (0..dofs).filter(|&d| sigmas[d].is_finite() && sigmas[d] > 0.0);
            for d in stated {
                let off = (coordinates[d] - x[d]).abs() / sigmas[d];
                let count = &mut calibration.groups[groups[d] as usize];
                count.total += 1;
                count.within_one += usize::from(off <= 1.0);
                count.within_two += usize::from(off <= 2.0);
            }
        }
        calibration
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::References;
    use model::{Axis, Channel, Joint};

    fn body() -> Skeleton {
        let translations = [Axis::X, Axis::Y, Axis::Z].map(Channel::translation);
        let rotations = [Axis::X, Axis::Y, Axis::Z].map(Channel::rotation);
        let root = Joint::root("root", [translations, rotations].concat());
        let elbow = Joint::child("lelbow", 0, nalgebra::Vector3::y(), vec![Channel::rotation(Axis::X)]);
        let tail = Joint::child("tail", 0, nalgebra::Vector3::y(), vec![Channel::rotation(Axis::X)]);
        Skeleton::new("body", vec![root, elbow, tail]).unwrap()
    }

    #[test]
    fn joints_of_known_names_have_their_group() {
        let skeleton = body();
        let parametrisation = Parametrisation::smooth(&skeleton, &References::rest(&skeleton)).unwrap();
        let groups = DofGroup::for_skeleton(&skeleton, &parametrisation);
        let mut expected = vec![DofGroup::RootPosition; 3];
        expected.extend([DofGroup::RootRotation; 3]);
        expected.extend([DofGroup::Arms, DofGroup::Others]);
        assert_eq!(groups, expected);
        for (name, group) in [
            ("lhipjoint", DofGroup::Legs),
            ("rthumb", DofGroup::Hands),
            ("LeftUpLeg", DofGroup::Legs),
            ("LeftForeArm", DofGroup::Arms),
            ("upperneck", DofGroup::Trunk),
            ("ltoes", DofGroup::Feet),
        ] {
            assert_eq!(DofGroup::for_joint(name), group, "{name}");
        }
    }

    #[test]
    fn shares_are_those_of_a_case_counted_by_hand() {
        let skeleton = body();
        let parametrisation = Parametrisation::smooth(&skeleton, &References::rest(&skeleton)).unwrap();
        // Four frames, the elbow off by 0.5, 1.5, 2.5 and half a sigma beyond a whole turn.
        let frames = 4;
        let truth = Motion::new(skeleton.into(), 60.0, vec![0.0; 8 * frames]).unwrap();
        let (mut found, sigmas) =
            (vec![0.0; 8 * frames], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0].repeat(frames));
        for (frame, off) in [0.05, -0.15, 0.25, 0.05].into_iter().enumerate() {
            found[8 * frame + 6] = off;
        }
        found[8 * 3 + 6] += std::f64::consts::TAU;
        let calibration = Calibration::measure(&truth, &parametrisation, &found, &sigmas);
        let all = calibration.joint_angles();
        assert_eq!(all, Count { total: 4, within_one: 2, within_two: 3 });
        assert_eq!(calibration.groups[DofGroup::Arms as usize], all);
        assert_eq!((all.share_within_one(), all.share_within_two()), (0.5, 0.75));
        let mut twice = calibration;
        twice.add(&calibration);
        assert_eq!(twice.joint_angles(), Count { total: 8, within_one: 4, within_two: 6 });
    }

    #[test]
    fn deviations_that_are_not_stated_are_not_counted() {
        let skeleton = body();
        let parametrisation = Parametrisation::smooth(&skeleton, &References::rest(&skeleton)).unwrap();
        let truth = Motion::new(skeleton.into(), 60.0, vec![0.0; 8]).unwrap();
        let calibration = Calibration::measure(&truth, &parametrisation, &[0.0; 8], &[f64::NAN; 8]);
        assert_eq!(calibration, Calibration::default());
        assert_eq!(calibration.joint_angles().share_within_one(), 0.0);
    }
}
