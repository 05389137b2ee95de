use kinematics::{ControlPoint, Kinematics};
use model::Skeleton;
use motion_db::{MotionDatabase, SkeletonSize};
use nalgebra::Vector3;

use crate::{LIMBS, Limb, Limbs};

/// Frames of a span that are compared, counted from its first: 0.2 s tell how the points move.
pub const SPAN: [usize; 3] = [0, 6, 12];
/// Frames from the first to the last of a span.
pub const SPAN_FRAMES: usize = SPAN[SPAN.len() - 1];
/// Most spans of a database that are looked at.
const MAX_SPANS: usize = 6_000;

/// Where control points are in poses of a database, as a function of the scales of the limbs:
///
/// ```text
/// p = constant + Σ_limb scale_limb · parts_limb
/// ```
///
/// which is exact: bones turn, and only their lengths are scaled. The root's translation is scaled with the legs, as
/// everywhere between performers.
#[derive(Debug, Clone)]
pub struct Shapes {
    points: usize,
    /// the root's offset, metres, in which all points share
    constant: Vector3<f64>,
    /// parts of each limb, metres, shape `[spans, SPAN.len(), points, 3]`
    parts: Vec<[[f32; 3]; 3]>,
}

impl Shapes {
    /// Of `points` (on `skeleton`) over spans of `database`, evenly spread where there are more than 6,000.
    pub fn new(
        database: &MotionDatabase,
        skeleton: &Skeleton,
        limbs: &Limbs,
        points: &[ControlPoint],
    ) -> Self {
        let stride = database.num_poses().div_ceil(MAX_SPANS).max(1);
        let kinematics = database.kinematics(skeleton);
        let leg_parts = leg_parts(skeleton, limbs, database.leg_length());
        let mut parts_of_all = Vec::new();
        let mut pose = vec![0.0; database.num_dofs()];
        let mut chain = Chain::new(skeleton, limbs, &kinematics);
        for clip in database.clips() {
            let starts = (0..clip.num_poses.saturating_sub(SPAN_FRAMES)).step_by(stride);
            for frame in starts.flat_map(|start| SPAN.map(|offset| start + offset)) {
                database.copy_pose(clip.first_pose + frame, &mut pose);
                let root = Vector3::new(pose[0], pose[1], pose[2]);
                pose[..3].fill(0.0);
                chain.update(&kinematics, &pose);
                for point in points {
                    let mut parts = chain.parts(point);
                    for (part, share) in parts.iter_mut().zip(leg_parts) {
                        *part += root * share;
                    }
                    parts_of_all.push(parts.map(|p| [p.x as f32, p.y as f32, p.z as f32]));
                }
            }
        }
        Self { points: points.len(), constant: skeleton.joints()[0].offset, parts: parts_of_all }
    }

    /// Number of spans.
    pub fn num_spans(&self) -> usize {
        self.parts.len() / (SPAN.len() * self.points)
    }

    /// Parts of the points of a span, in the order of [`SPAN`] and then of the points.
    pub fn parts(&self, span: usize) -> &[[[f32; 3]; 3]] {
        let count = SPAN.len() * self.points;
        &self.parts[span * count..(span + 1) * count]
    }

    /// The part that no scale changes, metres.
    pub fn constant(&self) -> Vector3<f64> {
        self.constant
    }
}

/// Position from the parts, metres.
pub fn position(constant: &Vector3<f64>, parts: &[[f32; 3]; 3], scales: &[f64; 3]) -> Vector3<f64> {
    let mut p = *constant;
    for (part, scale) in parts.iter().zip(scales) {
        p += Vector3::from(part.map(f64::from)) * *scale;
    }
    p
}

/// How much of the root's translation each limb's scale brings: the legs' parts of the leg length, relative to that to
/// which the database's translations are scaled.
fn leg_parts(skeleton: &Skeleton, limbs: &Limbs, database_leg: f64) -> [f64; 3] {
    let rest = Kinematics::new(skeleton, kinematics::Parametrisation::channels(skeleton));
    let mut chain = Chain::new(skeleton, limbs, &rest);
    chain.update(&rest, &vec![0.0; skeleton.num_dofs()]);
    let ends = skeleton.joints().iter().enumerate().flat_map(|(joint, j)| {
        [Vector3::zeros(), j.tip].map(|offset| ControlPoint { name: String::new(), joint, offset })
    });
    let parts = ends.map(|end| chain.parts(&end));
    let lowest =
        parts.min_by(|a, b| a.iter().sum::<Vector3<f64>>().y.total_cmp(&b.iter().sum::<Vector3<f64>>().y));
    let lowest = lowest.unwrap_or_default().map(|part| -part.y / database_leg);
    if lowest.iter().sum::<f64>() > 1e-3 {
        return lowest;
    }
    let mut legs = [0.0; 3];
    legs[Limb::Legs as usize] = SkeletonSize::leg_length(skeleton) / database_leg;
    legs
}

/// The way from the root to every joint, split by limb.
struct Chain<'a> {
    skeleton: &'a Skeleton,
    limbs: &'a Limbs,
    state: kinematics::State,
    /// shape `[joints]`
    to_joint: Vec<[Vector3<f64>; 3]>,
}

impl<'a> Chain<'a> {
    fn new(skeleton: &'a Skeleton, limbs: &'a Limbs, kinematics: &Kinematics) -> Self {
        let to_joint = vec![[Vector3::zeros(); LIMBS.len()]; skeleton.num_joints()];
        Self { skeleton, limbs, state: kinematics.state(), to_joint }
    }

    fn update(&mut self, kinematics: &Kinematics, x: &[f64]) {
        kinematics.update(x, &mut self.state);
        for (j, joint) in self.skeleton.joints().iter().enumerate() {
            let Some(parent) = joint.parent else { continue };
            self.to_joint[j] = self.to_joint[parent];
            let way = self.state.positions[j] - self.state.positions[parent];
            self.to_joint[j][self.limbs.limb(parent) as usize] += way;
        }
    }

    fn parts(&self, point: &ControlPoint) -> [Vector3<f64>; 3] {
        let mut parts = self.to_joint[point.joint];
        let limb = self.limbs.limb(point.joint);
        parts[limb as usize] += self.state.rotations[point.joint] * point.offset;
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Population;
    use kinematics::{PointSet, control_points};
    use motion_db::Clip;
    use sample_motion::{Action, DrawOptions, Model};

    #[test]
    fn points_from_parts_are_those_of_forward_kinematics_on_the_scaled_skeleton() {
        let motion = Model::bundled().draw(Action::Walk, 1, &DrawOptions { frames: 60, subject: 1 }).unwrap();
        let clip = Clip { name: "a".into(), subject: "1".into(), action: "walk".into(), motion };
        let database = MotionDatabase::build(&[clip]).unwrap();
        let population = Population::from_database(&database).unwrap();
        let limbs = &population.limbs;
        let scales = [1.2, 0.9, 1.05];
        let scaled = limbs.scaled(&population.mean, scales).unwrap();
        let names = ["left_wrist", "right_ankle", "head", "root"];
        let points = control_points(&population.mean, &names).unwrap();
        let shapes = Shapes::new(&database, &population.mean, limbs, &points);
        let kinematics = database.kinematics(&scaled);
        let set = PointSet::new(&kinematics, control_points(&scaled, &names).unwrap());
        let (mut state, mut expected) = (kinematics.state(), vec![Vector3::zeros(); 4]);
        let mut pose = vec![0.0; database.num_dofs()];
        database.copy_pose(5, &mut pose);
        let size = SkeletonSize::leg_length(&scaled) / database.leg_length();
        pose[..3].iter_mut().for_each(|v| *v *= size);
        set.positions(&kinematics, &pose, &mut state, &mut expected);
        for (parts, expected) in shapes.parts(5).iter().zip(expected) {
            let found = position(&shapes.constant(), parts, &scales);
            assert!((found - expected).norm() < 1e-6, "{found} {expected}");
        }
    }
}
