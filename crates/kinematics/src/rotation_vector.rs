use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

/// Below this angle (radians) the series is used instead of the closed form.
const SMALL: f64 = 1e-4;

/// The skew matrix `[v]×`, so that `skew(v) u = v × u`.
fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Rotation of angle `‖v‖` (radians) about `v` (Rodrigues).
pub fn rotation_exp(v: &Vector3<f64>) -> Matrix3<f64> {
    exp_and_left_jacobian(v).0
}

/// The left Jacobian of SO(3): `exp(v + dv) = exp(J dv) exp(v)` to first order.
pub fn left_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    exp_and_left_jacobian(v).1
}

/// `exp(v)` and its left Jacobian, sharing sine and cosine.
pub(crate) fn exp_and_left_jacobian(v: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let angle_squared = v.norm_squared();
    let (a, b, c) = if angle_squared < SMALL * SMALL {
        (1.0 - angle_squared / 6.0, 0.5 - angle_squared / 24.0, 1.0 / 6.0 - angle_squared / 120.0)
    } else {
        let angle = angle_squared.sqrt();
        let (sin, cos) = angle.sin_cos();
        (sin / angle, (1.0 - cos) / angle_squared, (angle - sin) / (angle_squared * angle))
    };
    let k = skew(v);
    let k2 = v * v.transpose() - Matrix3::from_diagonal_element(angle_squared);
    (Matrix3::identity() + k * a + k2 * b, Matrix3::identity() + k * b + k2 * c)
}

/// The rotation vector of `rotation` with angle at most π, radians.
pub fn rotation_log(rotation: &Matrix3<f64>) -> Vector3<f64> {
    // By way of the quaternion: well conditioned at 0 and at π.
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(
        *rotation,
    ));
    let (w, v) = if q.w < 0.0 { (-q.w, -q.imag()) } else { (q.w, q.imag()) };
    let sin_half = v.norm();
    if sin_half < 1e-12 { v * 2.0 } else { v * (2.0 * sin_half.atan2(w) / sin_half) }
}

/// Of all vectors that stand for the same rotation as `v` (angles differ by 2π), the nearest to `near`.
pub fn nearest_rotation_vector(v: &Vector3<f64>, near: &Vector3<f64>) -> Vector3<f64> {
    let angle = v.norm();
    if angle < 1e-9 {
        // Any multiple of a full turn about any axis: take the axis of `near`.
        let length = near.norm();
        let turns = (length / TAU).round();
        return if turns == 0.0 { *v } else { near * (turns * TAU / length) };
    }
    let axis = v / angle;
    let turns = ((near.dot(&axis) - angle) / TAU).round();
    axis * (angle + turns * TAU)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(length: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-length..length).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn log_undoes_exp(v in vector(1.8)) {
            prop_assume!(v.norm() < 3.1);
            prop_assert!((rotation_log(&rotation_exp(&v)) - v).norm() < 1e-9);
        }

        #[test]
        fn left_jacobian_agrees_with_differences(v in vector(3.0), d in vector(1.0)) {
            let h = 1e-6;
            let moved = rotation_exp(&(v + d * h)) * rotation_exp(&(v - d * h)).transpose();
            let found = rotation_log(&moved) / (2.0 * h);
            prop_assert!((found - left_jacobian(&v) * d).norm() < 1e-6);
        }

        #[test]
        fn nearest_vector_is_the_same_rotation(v in vector(3.0), near in vector(9.0)) {
            let w = nearest_rotation_vector(&v, &near);
            prop_assert!((rotation_exp(&w) - rotation_exp(&v)).norm() < 1e-9);
            prop_assert!((w - near).norm() <= (v - near).norm() + 1e-9);
        }
    }
}
