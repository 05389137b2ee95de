use kinematics::{
    Kinematics, Parametrisation, can_flip, nearest_equivalent, nearest_flip, rotation_from_angles,
    unwrap_near,
};
use model::{ChannelKind, Joint, Motion, Skeleton};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Errors of a reconstructed motion against the true one.
///
/// Joint angles are the file's channels without the root's. Of the Euler triples that stand for the same rotation the
/// one nearest to the truth is compared, and angles are unwrapped to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// frames compared
    pub frames: usize,
    /// root mean square over frames and joint angles, degrees
    pub rms_deg: f64,
    /// mean absolute over frames and joint angles, degrees
    pub mae_deg: f64,
    /// mean angle between the true and the found rotation of a joint (root left out), degrees
    pub geodesic_deg: f64,
    /// mean distance of the joints and bone ends from their true positions, centimetres
    pub mpjpe_cm: f64,
    /// as `mpjpe_cm`, after the roots were brought to the same place, centimetres
    pub mpjpe_aligned_cm: f64,
}

/// Errors of one joint over a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointErrors {
    /// the joint
    pub joint: String,
    /// number of its rotation angles; 0 for a joint that does not turn, and for the root
    pub angles: usize,
    /// root mean square over frames and its angles, degrees
    pub rms_deg: f64,
    /// mean absolute over frames and its angles, degrees
    pub mae_deg: f64,
    /// mean angle between its true and its found rotation, degrees
    pub geodesic_deg: f64,
    /// mean distance from its true position, centimetres
    pub position_cm: f64,
}

/// Everything that a comparison of two motions says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// over all frames and joints
    pub errors: Errors,
    /// root mean square over the joint angles of each frame, degrees, shape `[frames]`
    pub frame_rms_deg: Vec<f64>,
    /// mean joint position error of each frame, centimetres, shape `[frames]`
    pub frame_mpjpe_cm: Vec<f64>,
    /// shape `[num_joints]`; the root's angles are not compared
    pub joints: Vec<JointErrors>,
}

/// The errors over all frames that both motions have: see [`compare_in_detail`].
pub fn compare(truth: &Motion, found: &Motion) -> Errors {
    compare_in_detail(truth, found).errors
}

/// Compares the frames that both motions have. They must be on the same skeleton and at the same frame rate.
pub fn compare_in_detail(truth: &Motion, found: &Motion) -> Comparison {
    let skeleton = truth.skeleton();
    let frames = truth.num_frames().min(found.num_frames());
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let (mut true_state, mut found_state) = (kinematics.state(), kinematics.state());
    let flips: Vec<bool> = (0..skeleton.num_joints()).map(|j| can_flip(skeleton, j)).collect();
    let landmarks: Vec<_> = landmarks(skeleton).collect();
    let mut all = Sums::default();
    let mut joints = vec![Sums::default(); skeleton.num_joints()];
    let mut frame_rms_deg = Vec::with_capacity(frames);
    let mut frame_mpjpe_cm = Vec::with_capacity(frames);
    for frame in 0..frames {
        let mut frame_sums = Sums::default();
        let (t, f) = (truth.pose(frame), found.pose(frame));
        for (j, joint) in skeleton.joints().iter().enumerate().skip(1) {
            let angles = Sums::for_joint(joint, flips[j], &t[skeleton.dofs(j)], &f[skeleton.dofs(j)]);
            frame_sums.add(&angles);
            joints[j].add(&angles);
        }
        kinematics.update(t, &mut true_state);
        kinematics.update(f, &mut found_state);
        let shift = true_state.positions[0] - found_state.positions[0];
        for (joint, point) in &landmarks {
            let apart = found_state.point(*joint, point) - true_state.point(*joint, point);
            frame_sums.add(&Sums::from_position(apart, shift));
        }
        for (joint, (t, f)) in joints.iter_mut().zip(true_state.positions.iter().zip(&found_state.positions))
        {
            joint.add(&Sums::from_position(f - t, shift));
        }
        let errors = frame_sums.errors(1);
        frame_rms_deg.push(errors.rms_deg);
        frame_mpjpe_cm.push(errors.mpjpe_cm);
        all.add(&frame_sums);
    }
    let joints = skeleton.joints().iter().zip(&joints).map(|(joint, sums)| {
        let errors = sums.errors(frames);
        JointErrors {
            joint: joint.name.clone(),
            angles: sums.angles as usize / frames.max(1),
            rms_deg: errors.rms_deg,
            mae_deg: errors.mae_deg,
            geodesic_deg: errors.geodesic_deg,
            position_cm: errors.mpjpe_cm,
        }
    });
    Comparison { errors: all.errors(frames), frame_rms_deg, frame_mpjpe_cm, joints: joints.collect() }
}

/// Sums of errors (radians, metres) and the numbers of summands.
#[derive(Debug, Clone, Default)]
struct Sums {
    squares: f64,
    absolute: f64,
    angles: f64,
    geodesic: f64,
    rotations: f64,
    position: f64,
    aligned_position: f64,
    positions: f64,
}

impl Sums {
    /// Of the angles of a joint in one frame.
    fn for_joint(joint: &Joint, can_flip: bool, truth: &[f64], found: &[f64]) -> Self {
        let slot = |axis| {
            joint.channels.iter().position(|c| c.kind == ChannelKind::Rotation && c.axis == axis).unwrap_or(0)
        };
        let slots: Vec<usize> = joint.rotation_order.iter().map(|&axis| slot(axis)).collect();
        let mut sums = Self::default();
        if slots.is_empty() {
            return sums;
        }
        let t: Vec<f64> = slots.iter().map(|&s| truth[s]).collect();
        let f: Vec<f64> = slots.iter().map(|&s| found[s]).collect();
        let nearest: Vec<f64> = match (&t[..], &f[..]) {
            (&[t0, t1, t2], &[f0, f1, f2]) => nearest_equivalent([f0, f1, f2], [t0, t1, t2]).to_vec(),
            (&[t0, t1], &[f0, f1]) if can_flip => nearest_flip([f0, f1], [t0, t1]).to_vec(),
            _ => f.iter().zip(&t).map(|(f, t)| unwrap_near(*f, *t)).collect(),
        };
        for (n, t) in nearest.iter().zip(&t) {
            sums.squares += (n - t).powi(2);
            sums.absolute += (n - t).abs();
            sums.angles += 1.0;
        }
        let order = &joint.rotation_order;
        sums.geodesic = angle_between(&rotation_from_angles(order, &t), &rotation_from_angles(order, &f));
        sums.rotations = 1.0;
        sums
    }

    /// Of one point: `apart` from the truth, and by `shift` more when the roots are brought together.
    fn from_position(apart: Vector3<f64>, shift: Vector3<f64>) -> Self {
        let (position, aligned_position) = (apart.norm(), (apart + shift).norm());
        Self { position, aligned_position, positions: 1.0, ..Self::default() }
    }

    fn add(&mut self, other: &Self) {
        self.squares += other.squares;
        self.absolute += other.absolute;
        self.angles += other.angles;
        self.geodesic += other.geodesic;
        self.rotations += other.rotations;
        self.position += other.position;
        self.aligned_position += other.aligned_position;
        self.positions += other.positions;
    }

    fn errors(&self, frames: usize) -> Errors {
        let degrees = 180.0 / std::f64::consts::PI;
        let mean = |sum: f64, count: f64| if count > 0.0 { sum / count } else { 0.0 };
        Errors {
            frames,
            rms_deg: mean(self.squares, self.angles).sqrt() * degrees,
            mae_deg: mean(self.absolute, self.angles) * degrees,
            geodesic_deg: mean(self.geodesic, self.rotations) * degrees,
            mpjpe_cm: mean(self.position, self.positions) * 100.0,
            mpjpe_aligned_cm: mean(self.aligned_position, self.positions) * 100.0,
        }
    }
}

/// Angle of the rotation from one matrix to the other, radians.
fn angle_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    kinematics::rotation_log(&(a.transpose() * b)).norm()
}

/// Every joint, and the ends of the bones that nothing hangs from.
fn landmarks(skeleton: &Skeleton) -> impl Iterator<Item = (usize, Vector3<f64>)> + '_ {
    let has_child = |j: usize| skeleton.joints().iter().any(|joint| joint.parent == Some(j));
    let joints = (0..skeleton.num_joints()).map(|j| (j, Vector3::zeros()));
    let ends = skeleton.joints().iter().enumerate();
    let ends = ends
        .filter(move |(j, joint)| joint.tip.norm() > 0.0 && !has_child(*j))
        .map(|(j, joint)| (j, joint.tip));
    joints.chain(ends)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Axis, Channel};

    fn arm(values: Vec<f64>) -> Motion {
        let root = Joint::root("root", vec![Channel::translation(Axis::X)]);
        let rotations = [Axis::Z, Axis::Y, Axis::X].map(Channel::rotation).to_vec();
        let mut upper = Joint::child("upper", 0, Vector3::zeros(), rotations);
        upper.tip = Vector3::x();
        let skeleton = Skeleton::new("arm", vec![root, upper]).unwrap();
        Motion::new(skeleton.into(), 60.0, values).unwrap()
    }

    #[test]
    fn the_other_euler_triple_of_the_same_rotation_is_no_error() {
        let pi = std::f64::consts::PI;
        let truth = arm(vec![0.0, 0.1, 0.2, 0.3]);
        let found = arm(vec![0.0, 0.1 - pi, pi - 0.2, 0.3 + pi]);
        let errors = compare(&truth, &found);
        assert!(errors.rms_deg < 1e-9 && errors.geodesic_deg < 1e-5 && errors.mpjpe_cm < 1e-9);
    }

    #[test]
    fn a_shifted_root_counts_only_where_roots_are_not_aligned() {
        let errors = compare(&arm(vec![0.0; 4]), &arm(vec![0.02, 0.0, 0.0, 0.0]));
        assert!((errors.mpjpe_cm - 2.0).abs() < 1e-9);
        assert!(errors.mpjpe_aligned_cm < 1e-9);
    }

    #[test]
    fn ten_degrees_in_one_of_three_angles_are_known_in_every_metric() {
        let errors = compare(&arm(vec![0.0; 4]), &arm(vec![0.0, 10f64.to_radians(), 0.0, 0.0]));
        assert!((errors.mae_deg - 10.0 / 3.0).abs() < 1e-9);
        assert!((errors.rms_deg - 10.0 / 3f64.sqrt()).abs() < 1e-9);
        assert!((errors.geodesic_deg - 10.0).abs() < 1e-9);
    }

    #[test]
    fn frames_and_joints_are_told_apart() {
        let truth = arm([[0.0; 4], [0.0; 4]].concat());
        let ten = 10f64.to_radians();
        let comparison = compare_in_detail(&truth, &arm(vec![0.0, 0.0, 0.0, 0.0, 0.0, ten, 0.0, 0.0]));
        assert_eq!(comparison.frame_rms_deg[0], 0.0);
        assert!((comparison.frame_rms_deg[1] - 10.0 / 3f64.sqrt()).abs() < 1e-9);
        // Landmarks: two joints and the far end, which alone moves: 2 sin(5 degrees) metres, a third of it in the mean.
        let chord_cm = 200.0 * (ten / 2.0).sin();
        assert!((comparison.frame_mpjpe_cm[1] - chord_cm / 3.0).abs() < 1e-9);
        let [root, upper] = &comparison.joints[..] else { panic!("{:?}", comparison.joints) };
        assert_eq!((root.angles, upper.angles), (0, 3));
        assert!((upper.geodesic_deg - 5.0).abs() < 1e-9 && (upper.mae_deg - 10.0 / 6.0).abs() < 1e-9);
        assert!((upper.rms_deg - 10.0 / 6f64.sqrt()).abs() < 1e-9 && upper.position_cm < 1e-9);
        assert!((comparison.errors.rms_deg - upper.rms_deg).abs() < 1e-9);
    }
}
