use std::f64::consts::{PI, TAU};

use model::{Axis, Skeleton};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// `angle` plus the multiple of 2π that brings it nearest to `near`, radians.
pub fn unwrap_near(angle: f64, near: f64) -> f64 {
    angle + ((near - angle) / TAU).round() * TAU
}

/// The product of rotations about `axes`, leftmost first, by `angles` (radians).
pub fn rotation_from_angles(axes: &[Axis], angles: &[f64]) -> Matrix3<f64> {
    axes.iter()
        .zip(angles)
        .map(|(axis, &angle)| Rotation3::from_axis_angle(&axis.unit(), angle).into_inner())
        .fold(Matrix3::identity(), |product, r| product * r)
}

/// The angles, leftmost axis first, radians, whose rotations about three different `axes` multiply to `rotation`.
/// Of the equivalent triples the one nearest to `near`; at a gimbal pole the first angle is `near`'s.
pub fn angles_from_rotation(axes: [Axis; 3], rotation: &Matrix3<f64>, near: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = axes.map(Axis::index);
    let sign = if (a + 1) % 3 == b { 1.0 } else { -1.0 };
    let sin_b = (sign * rotation[(a, c)]).clamp(-1.0, 1.0);
    let cos_b = (1.0 - sin_b * sin_b).sqrt();
    if cos_b < 1e-7 {
        // R = R_a(α) R_b(±π/2) R_c(γ): only a sum of α and γ is known. Keep α, read γ off what is left.
        let angle_a = near[0];
        let angle_b = sin_b.signum() * PI / 2.0;
        let left = rotation_from_angles(&[axes[0], axes[1]], &[angle_a, angle_b]);
        let rest = left.transpose() * rotation;
        // rest is a rotation about c: its sine and cosine stand in the plane of the other two axes.
        let angle_c = (-sign * rest[(a, b)]).atan2(rest[(a, a)]);
        return nearest_equivalent([angle_a, angle_b, angle_c], near);
    }
    let angle_a = (-sign * rotation[(b, c)]).atan2(rotation[(c, c)]);
    let angle_c = (-sign * rotation[(a, b)]).atan2(rotation[(a, a)]);
    let angle_b = sin_b.atan2(cos_b);
    nearest_equivalent([angle_a, angle_b, angle_c], near)
}

/// Of all triples of angles about three different axes that give the same rotation, the nearest to `near`
/// (sum of squares): each angle may change by 2π, and (α, β, γ) equals (α + π, π − β, γ + π).
pub fn nearest_equivalent(angles: [f64; 3], near: [f64; 3]) -> [f64; 3] {
    let [alpha, beta, gamma] = angles;
    let distance = |x: &[f64; 3]| -> f64 { x.iter().zip(&near).map(|(a, n)| (a - n).powi(2)).sum() };
    let unwrapped = |x: [f64; 3]| std::array::from_fn(|i| unwrap_near(x[i], near[i]));
    let first = unwrapped([alpha, beta, gamma]);
    let second = unwrapped([alpha + PI, PI - beta, gamma + PI]);
    if distance(&second) < distance(&first) { second } else { first }
}

/// Whether a joint's two rotations can be flipped without moving its bone: nothing hangs from it and its bone lies along
/// the third axis. Then angles (α, β), leftmost first, and (α + π, π − β) differ by half a turn of the bone about
/// itself. Recorded thumbs jump between the two from one frame to the next.
pub fn can_flip(skeleton: &Skeleton, joint_index: usize) -> bool {
    let joint = &skeleton.joints()[joint_index];
    let [a, b] = joint.rotation_order[..] else { return false };
    let third = Vector3::ith(3 - a.index() - b.index(), 1.0);
    let tip = joint.axes.inverse() * joint.tip;
    a != b
        && skeleton.joints().iter().all(|j| j.parent != Some(joint_index))
        && tip.norm() > 0.0
        && tip.cross(&third).norm() < 1e-3 * tip.norm()
}

/// Of the pairs of angles that put the bone of a joint that [`can_flip`] in the same place, the nearest to `near`.
pub fn nearest_flip([alpha, beta]: [f64; 2], near: [f64; 2]) -> [f64; 2] {
    let unwrapped = |x: [f64; 2]| [unwrap_near(x[0], near[0]), unwrap_near(x[1], near[1])];
    let distance = |x: &[f64; 2]| (x[0] - near[0]).powi(2) + (x[1] - near[1]).powi(2);
    let (first, second) = (unwrapped([alpha, beta]), unwrapped([alpha + PI, PI - beta]));
    if distance(&second) < distance(&first) { second } else { first }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ORDERS: [[Axis; 3]; 6] = [
        [Axis::X, Axis::Y, Axis::Z],
        [Axis::X, Axis::Z, Axis::Y],
        [Axis::Y, Axis::X, Axis::Z],
        [Axis::Y, Axis::Z, Axis::X],
        [Axis::Z, Axis::X, Axis::Y],
        [Axis::Z, Axis::Y, Axis::X],
    ];

    #[test]
    fn a_flip_leaves_the_bone_where_it_is() {
        let order = [Axis::Z, Axis::X];
        let [a, b] = nearest_flip([0.3, 0.4], [0.3 + PI, PI - 0.4]);
        assert!((a - 0.3 - PI).abs() < 1e-12 && (b + 0.4 - PI).abs() < 1e-12);
        let bone = |angles: &[f64]| rotation_from_angles(&order, angles) * Vector3::y();
        assert!((bone(&[0.3, 0.4]) - bone(&[a, b])).norm() < 1e-12);
    }

    proptest! {
        #[test]
        fn angles_near_the_truth_are_the_truth(order in 0usize..6, angles in prop::array::uniform3(-7.0..7.0f64)) {
            let rotation = rotation_from_angles(&ORDERS[order], &angles);
            prop_assume!(angles[1].cos().abs() > 1e-3);
            let found = angles_from_rotation(ORDERS[order], &rotation, angles);
            for (f, e) in found.iter().zip(angles) {
                prop_assert!((f - e).abs() < 1e-9, "{found:?} is not {angles:?}");
            }
        }

        #[test]
        fn a_gimbal_pole_still_gives_the_rotation(order in 0usize..6, a in -3.0..3.0f64, c in -3.0..3.0f64, up: bool) {
            let angles = [a, if up { PI / 2.0 } else { -PI / 2.0 }, c];
            let rotation = rotation_from_angles(&ORDERS[order], &angles);
            let found = angles_from_rotation(ORDERS[order], &rotation, [0.3, 0.0, 0.1]);
            prop_assert!((rotation_from_angles(&ORDERS[order], &found) - rotation).norm() < 1e-6);
        }
    }
}
