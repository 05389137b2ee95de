use model::Mesh;
use nalgebra::Vector3;
use serde::Serialize;

use crate::surface::compare_surfaces;

/// Points drawn on each surface.
const SAMPLES: usize = 50_000;
/// Seed of these points: the same bodies give the same errors.
const SEED: u64 = 1;

/// A body: its surface and its joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// metres
    pub mesh: Mesh,
    /// names and positions of joints, metres
    pub joints: Vec<(String, Vector3<f64>)>,
}

/// How far a body is from the true one, millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShapeErrors {
    /// mean distance of points from the other surface, both ways
    pub surface_mean_abs_mm: f64,
    /// mean signed distance, positive where the found body is outside the true one
    pub surface_mean_signed_mm: f64,
    /// standard deviation of the signed distances
    pub surface_std_mm: f64,
    /// largest distance
    pub surface_max_mm: f64,
    /// mean distance of joints of the same name
    pub joint_mean_mm: f64,
    /// largest of them
    pub joint_max_mm: f64,
    /// height of the found body, from its lowest to its highest point, less that of the true one
    pub stature_error_mm: f64,
}

/// Compares a body with the true one; the meshes need not have the same topology. `None` if one has no surface or no joint
/// has a counterpart.
pub fn shape_errors(found: &Body, truth: &Body) -> Option<ShapeErrors> {
    let surfaces = compare_surfaces(&found.mesh, &truth.mesh, SAMPLES, SEED).ok()?;
    let distances: Vec<f64> = found
        .joints
        .iter()
        .filter_map(|(name, position)| {
            let (_, true_position) = truth.joints.iter().find(|(other, _)| other == name)?;
            Some((position - true_position).norm())
        })
        .collect();
    if distances.is_empty() {
        return None;
    }
    let mm = |metres: f64| 1e3 * metres;
    Some(ShapeErrors {
        surface_mean_abs_mm: mm(surfaces.both.mean_abs_m),
        surface_mean_signed_mm: mm(surfaces.both.mean_signed_m),
        surface_std_mm: mm(surfaces.both.std_m),
        surface_max_mm: mm(surfaces.both.max_abs_m),
        joint_mean_mm: mm(distances.iter().sum::<f64>() / distances.len() as f64),
        joint_max_mm: mm(distances.iter().copied().fold(0.0, f64::max)),
        stature_error_mm: mm(height(&found.mesh) - height(&truth.mesh)),
    })
}

fn height(mesh: &Mesh) -> f64 {
    let [low, high] = mesh.vertices.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], vertex| {
        [low.min(vertex.y), high.max(vertex.y)]
    });
    high - low
}

/// How a figure is distributed over several cases.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distribution {
    /// half of the cases are below
    pub median: f64,
    /// mean
    pub mean: f64,
    /// nine tenths of the cases are at or below
    pub percentile_90: f64,
    /// largest
    pub max: f64,
}

impl Distribution {
    /// Of these figures; `None` if there are none.
    pub fn from_figures(figures: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut figures: Vec<f64> = figures.into_iter().collect();
        figures.sort_by(f64::total_cmp);
        let (count, max) = (figures.len(), *figures.last()?);
        Some(Self {
            median: (figures[(count - 1) / 2] + figures[count / 2]) / 2.0,
            mean: figures.iter().sum::<f64>() / count as f64,
            percentile_90: figures[(count * 9).div_ceil(10) - 1],
            max,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(side: f64, joint: f64) -> Body {
        let corner = |i: u32| Vector3::from([0, 1, 2].map(|axis| f64::from(i >> axis & 1) - 0.5)) * side;
        let faces = vec![
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
            [2, 6, 3],
            [3, 6, 7],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
        ];
        let mesh = Mesh::new((0..8).map(corner).collect(), faces).unwrap();
        Body { mesh, joints: vec![("only".into(), Vector3::x() * joint), ("other".into(), Vector3::zeros())] }
    }

    #[test]
    fn a_larger_cube_is_outside_on_all_sides() {
        let mut truth = cube(1.0, 0.0);
        truth.joints.pop();
        let errors = shape_errors(&cube(1.02, 0.03), &truth).unwrap();
        assert!((errors.surface_mean_abs_mm - 10.0).abs() < 0.3, "{errors:?}");
        assert!((errors.surface_mean_signed_mm - 10.0).abs() < 0.3);
        assert!((errors.stature_error_mm - 20.0).abs() < 1e-9);
        assert!((errors.joint_mean_mm - 30.0).abs() < 1e-9 && (errors.joint_max_mm - 30.0).abs() < 1e-9);
    }

    #[test]
    fn bodies_without_a_joint_in_common_are_not_compared() {
        let mut truth = cube(1.0, 0.0);
        truth.joints.clear();
        assert_eq!(shape_errors(&cube(1.0, 0.0), &truth), None);
    }

    #[test]
    fn a_distribution_of_ten_has_its_ninth_at_ninety_percent() {
        let found = Distribution::from_figures((1..=10).rev().map(f64::from)).unwrap();
        assert_eq!((found.median, found.mean, found.percentile_90, found.max), (5.5, 5.5, 9.0, 10.0));
        assert_eq!(Distribution::from_figures([]), None);
    }
}
