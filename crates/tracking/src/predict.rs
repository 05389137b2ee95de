use body::{BodyModel, ROOT_DOFS};
use kinematics::{rotation_exp, rotation_log};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Largest change of an angle that goes on for another frame, radians: what changed by more was found anew, not moved.
const FASTEST: f64 = 0.5;
/// The same of the root's translation, metres.
const FASTEST_M: f64 = 0.3;

/// The pose after two, at constant velocity: angles within their limits, the root's rotation on its great circle.
pub fn predicted(model: &BodyModel, before: &[f64], last: &[f64]) -> Vec<f64> {
    let mut next: Vec<f64> = last.to_vec();
    for (d, next) in next.iter_mut().enumerate() {
        let most = if d < 3 { FASTEST_M } else { FASTEST };
        *next += (last[d] - before[d]).clamp(-most, most);
    }
    model.rig().clamp(&mut next);
    let (from, to) = (rotation_of(before), rotation_of(last));
    let turn = Rotation3::from_matrix_unchecked(to * from.transpose());
    let angle = turn.angle();
    let share = if angle > FASTEST { FASTEST / angle } else { 1.0 };
    set_rotation(&mut next, &(turn.powf(share).into_inner() * to));
    next
}

/// Between two poses, `share` of the way from `a` to `b`.
pub fn blended(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    let mut pose: Vec<f64> = a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect();
    let (from, to) = (rotation_of(a), rotation_of(b));
    let turn = Rotation3::from_matrix_unchecked(to * from.transpose()).powf(share);
    set_rotation(&mut pose, &(turn.into_inner() * from));
    pose
}

/// Gives the root's rotation vector the whole turns that bring it nearest to that of the frame before, so that a person who turns
/// round has no jump at half a turn. (Who leans, and so turns about no single axis, has one near a whole turn, where rotation vectors
/// have their pole.) Where the rotation is the identity any axis will do, and the vector before says which.
pub fn unwind(pose: &mut [f64], before: &[f64]) {
    let (vector, last) = (rotation_log(&rotation_of(pose)), Vector3::new(before[3], before[4], before[5]));
    let angle = vector.norm();
    let axis = if angle > 1e-6 { vector / angle } else { last.try_normalize(1e-6).unwrap_or_default() };
    let turns = ((axis.dot(&last) - angle) / std::f64::consts::TAU).round();
    pose[3..ROOT_DOFS].copy_from_slice((axis * (angle + turns * std::f64::consts::TAU)).as_slice());
}

/// The same pose with a rotation vector of at most half a turn.
pub fn wound(pose: &[f64]) -> Vec<f64> {
    let mut wound = pose.to_vec();
    set_rotation(&mut wound, &rotation_of(pose));
    wound
}

fn rotation_of(pose: &[f64]) -> Matrix3<f64> {
    rotation_exp(&Vector3::new(pose[3], pose[4], pose[5]))
}

/// Sets the root's rotation with a vector of at most half a turn: a longer one runs into the pole at a whole turn.
fn set_rotation(pose: &mut [f64], rotation: &Matrix3<f64>) {
    pose[3..ROOT_DOFS].copy_from_slice(rotation_log(rotation).as_slice());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_goes_on_through_half_a_turn() {
        let model = BodyModel::shipped();
        let at = |turn: f64| {
            let mut pose = vec![0.0; model.rig().num_dofs()];
            pose[4] = turn;
            pose[0] = turn;
            pose
        };
        let turned = |pose: &[f64], turn: f64| (rotation_of(pose) - rotation_of(&at(turn))).amax() < 1e-9;
        let next = predicted(&model, &at(3.0), &at(3.1));
        assert!(turned(&next, 3.2) && (next[0] - 3.2).abs() < 1e-9 && next[4] < -3.0, "{next:?}");
        // what jumped doesn't go on as fast
        let far = predicted(&model, &at(0.0), &at(3.0));
        assert!(turned(&far, 3.5) && (far[0] - 3.3).abs() < 1e-9, "{far:?}");
    }

    #[test]
    fn rotation_vectors_go_on_round_and_round_where_the_person_does() {
        for tilt in [0.0, 0.1] {
            let mut before = vec![0.0, 0.0, 0.0, tilt, 2.9, 0.0];
            for step in 1..120 {
                let heading = Vector3::new(0.0, 2.9 + 0.13 * f64::from(step), 0.0);
                let rotation = rotation_exp(&heading) * rotation_exp(&Vector3::new(tilt, 0.0, 0.0));
                let mut pose = before.clone();
                set_rotation(&mut pose, &rotation);
                unwind(&mut pose, &before);
                assert!((rotation_of(&pose) - rotation).amax() < 1e-9);
                // no vector goes on past a whole turn that isn't about the same axis: there is the pole
                let is_pole = Rotation3::from_matrix_unchecked(rotation).angle() < 0.3 && tilt > 0.0;
                let moved = (pose[4] - before[4]).abs();
                assert!(is_pole || moved < 0.4, "step {step}: {pose:?} after {before:?}");
                assert!(
                    (rotation_of(&wound(&pose)) - rotation).amax() < 1e-9 && wound(&pose)[4].abs() < 3.15
                );
                assert!(tilt > 0.0 || (pose[4] - heading.y).abs() < 1e-6, "step {step}: {pose:?}");
                before = pose;
            }
        }
        let mut still = vec![0.0; 6];
        unwind(&mut still, &[0.0, 0.0, 0.0, 0.0, 6.2, 0.0]);
        assert!((still[4] - std::f64::consts::TAU).abs() < 1e-9);
        unwind(&mut still, &[0.0; 6]);
        assert_eq!(still, [0.0; 6]);
    }

    #[test]
    fn the_middle_of_two_poses_is_between_them() {
        let model = BodyModel::shipped();
        let mut a = vec![0.1; model.rig().num_dofs()];
        let mut b = a.clone();
        (a[4], b[4], b[9]) = (3.0, 3.0 - std::f64::consts::TAU + 0.2, 0.5);
        let middle = blended(&a, &b, 0.5);
        assert!((middle[9] - 0.3).abs() < 1e-12);
        // the short way round
        let turn = |x: &[f64], y: &[f64]| {
            Rotation3::from_matrix_unchecked(rotation_of(x) * rotation_of(y).transpose()).angle()
        };
        assert!((turn(&middle, &a) - turn(&middle, &b)).abs() < 1e-9 && turn(&middle, &a) < 0.2);
    }
}
