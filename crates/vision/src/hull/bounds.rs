use nalgebra::{Matrix3, Vector2, Vector3};

use super::{cone::Cone, cube::Cube};

/// A cube with all of the person: around the place nearest to the axes of the cones (least absolute distances, so that a
/// view that is wrong has little say), as large as the widest cone is there, and half as much again.
pub(super) fn root_cube(cones: &[Cone]) -> Cube {
    let axes: Vec<_> = cones.iter().filter_map(|cone| Some((cone.view.position, axis(cone)?))).collect();
    let ahead = |(position, direction): &(Vector3<f64>, Vector3<f64>)| position + direction * 3.0;
    let start = axes.iter().map(ahead).sum::<Vector3<f64>>() / axes.len().max(1) as f64;
    let mut centre = start;
    for round in 0..20 {
        // nearly parallel axes leave the distance open: it stays near the start
        let mut matrix = Matrix3::identity() * 1e-6;
        let mut side = start * 1e-6;
        for (position, direction) in &axes {
            let across = Matrix3::identity() - direction * direction.transpose();
            let miss = (across * (centre - position)).norm();
            let weight = if round == 0 { 1.0 } else { 1.0 / miss.max(0.02) };
            matrix += across * weight;
            side += across * position * weight;
        }
        if let Some(factor) = matrix.cholesky() {
            centre = factor.solve(&side);
        }
    }
    let half = cones.iter().map(|cone| {
        let [left, top, right, bottom] = cone.bounds.map(|side| side as f64);
        let focal = cone.view.camera.focal;
        let half_diagonal = Vector2::new((right - left) / focal.x, (bottom - top) / focal.y).norm() / 2.0;
        half_diagonal * (centre - cone.view.position).norm()
    });
    Cube { centre, half: half.fold(0.0, f64::max).clamp(0.1, 20.0) * 1.5 }
}

/// Direction through the middle of the silhouette's box.
fn axis(cone: &Cone) -> Option<Vector3<f64>> {
    let [left, top, right, bottom] = cone.bounds.map(|side| side as f64);
    cone.view.camera.ray(Vector2::new((left + right - 1.0) / 2.0, (top + bottom - 1.0) / 2.0))
}
