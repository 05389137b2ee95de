use kinematics::{Kinematics, Parametrisation};
use model::Motion;
use nalgebra::Vector3;

/// Positions of all joints, metres, row-major, shape `[frames, joints]`.
pub fn joint_positions(motion: &Motion) -> Vec<Vector3<f64>> {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    let mut positions = Vec::with_capacity(motion.num_frames() * skeleton.num_joints());
    for pose in motion.poses() {
        kinematics.update(pose, &mut state);
        positions.extend_from_slice(&state.positions);
    }
    positions
}

/// Mean distance of the joints of two motions, each on its own skeleton (of the same joints), centimetres.
pub fn mean_distance_cm(a: &Motion, b: &Motion) -> f64 {
    let (a, b) = (joint_positions(a), joint_positions(b));
    let count = a.len().min(b.len()).max(1) as f64;
    100.0 * a.iter().zip(&b).map(|(a, b)| (a - b).norm()).sum::<f64>() / count
}

/// Root mean square and largest acceleration of the joints, metres a second squared; 0 below three frames.
pub fn accelerations(motion: &Motion) -> (f64, f64) {
    let positions = joint_positions(motion);
    let joints = motion.skeleton().num_joints();
    let (mut squares, mut largest, mut count) = (0.0, 0.0f64, 0.0);
    for i in 2 * joints..positions.len() {
        let change = positions[i] - positions[i - joints] * 2.0 + positions[i - 2 * joints];
        let acceleration = change.norm() * motion.frame_rate().powi(2);
        squares += acceleration * acceleration;
        largest = largest.max(acceleration);
        count += 1.0;
    }
    if count > 0.0 { (f64::sqrt(squares / count), largest) } else { (0.0, 0.0) }
}
