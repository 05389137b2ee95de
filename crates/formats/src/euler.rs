//! Euler angles about the coordinate axes in any order.

use std::f64::consts::{PI, TAU};

use model::Axis;
use nalgebra::{Matrix3, Rotation3};

/// Product of the rotations about `axes`, leftmost first, radians.
pub(crate) fn compose(axes: &[Axis], angles: &[f64]) -> Rotation3<f64> {
    axes.iter().zip(angles).fold(Rotation3::identity(), |product, (axis, angle)| {
        product * Rotation3::from_axis_angle(&axis.unit(), *angle)
    })
}

/// Angles `[a, b, c]`, radians, with `R(order[0], a) · R(order[1], b) · R(order[2], c) = rotation`; the three axes
/// are different. Of the two answers the one with |b| ≤ 90°; where the outer axes fall together, c is 0.
pub(crate) fn decompose(order: [Axis; 3], rotation: &Rotation3<f64>) -> [f64; 3] {
    let [i, j, k] = order.map(Axis::index);
    // +1 for x y z and its cyclic orders, -1 for the others
    let sign = if (i + 1) % 3 == j { 1.0 } else { -1.0 };
    let m: &Matrix3<f64> = rotation.matrix();
    let sin_b = (sign * m[(i, k)]).clamp(-1.0, 1.0);
    let cos_b = m[(i, i)].hypot(m[(i, j)]);
    let b = sin_b.atan2(cos_b);
    if cos_b > 1e-9 {
        let a = (-sign * m[(j, k)]).atan2(m[(k, k)]);
        let c = (-sign * m[(i, j)]).atan2(m[(i, i)]);
        [a, b, c]
    } else {
        [(sign * m[(k, j)]).atan2(m[(j, j)]), b, 0.0]
    }
}

/// As [`decompose`], but of all angles that give the rotation those nearest to `before`, so that a motion's angles
/// do not jump: both answers are looked at, and whole turns are added.
pub(crate) fn nearest(order: [Axis; 3], rotation: &Rotation3<f64>, before: [f64; 3]) -> [f64; 3] {
    let near = |angle: f64, before: f64| angle + TAU * ((before - angle) / TAU).round();
    let near_all = |angles: [f64; 3]| [0, 1, 2].map(|i| near(angles[i], before[i]));
    let distance = |angles: &[f64; 3]| (0..3).map(|i| (angles[i] - before[i]).powi(2)).sum::<f64>();

    let [a, b, c] = decompose(order, rotation);
    if b.cos().abs() < 1e-9 {
        // only a ± c is known: c stays
        let without_c = rotation * compose(&order[2..], &[-before[2]]);
        let [a, b, _] = decompose(order, &without_c);
        return [near(a, before[0]), near(b, before[1]), before[2]];
    }
    let one = near_all([a, b, c]);
    let other = near_all([a + PI, PI - b, c + PI]);
    if distance(&other) < distance(&one) { other } else { one }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDERS: [[Axis; 3]; 6] = {
        use Axis::{X, Y, Z};
        [[X, Y, Z], [Y, Z, X], [Z, X, Y], [X, Z, Y], [Z, Y, X], [Y, X, Z]]
    };

    #[test]
    fn angles_of_any_order_compose_to_the_rotation_again() {
        for order in ORDERS {
            for angles in [[0.3, -0.4, 2.0], [-3.0, 1.5, 0.1], [1.0, 2.0, 3.0], [0.0; 3]] {
                let rotation = compose(&order, &angles);
                let again = compose(&order, &decompose(order, &rotation));
                assert!((rotation.matrix() - again.matrix()).norm() < 1e-12, "{order:?} {angles:?}");
            }
        }
    }

    #[test]
    fn a_quarter_turn_about_the_middle_axis_composes_again() {
        for order in ORDERS {
            for b in [std::f64::consts::FRAC_PI_2, -std::f64::consts::FRAC_PI_2] {
                let rotation = compose(&order, &[0.7, b, -0.2]);
                let again = compose(&order, &decompose(order, &rotation));
                assert!((rotation.matrix() - again.matrix()).norm() < 1e-8, "{order:?} {b}");
            }
        }
    }

    #[test]
    fn angles_that_turn_on_do_not_jump() {
        for order in ORDERS {
            let mut before = [0.0; 3];
            for frame in 0..2000 {
                let t = f64::from(frame) * 0.01;
                let truth = [t, 2.0 * (0.3 * t).sin(), -0.7 * t];
                let rotation = compose(&order, &truth);
                let angles = nearest(order, &rotation, before);
                let again = compose(&order, &angles);
                assert!((rotation.matrix() - again.matrix()).norm() < 1e-8);
                for (angle, before) in angles.iter().zip(before) {
                    assert!((angle - before).abs() < 0.1, "{order:?} frame {frame}: {before} to {angle}");
                }
                before = angles;
            }
        }
    }
}
