use model::Mesh;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::{Surface, sample_surface};
use crate::Result;

/// Mean, spread and extreme of signed distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistanceStatistics {
    /// number of distances
    pub count: usize,
    /// mean of the absolute distances, metres
    pub mean_abs_m: f64,
    /// mean of the signed distances, metres
    pub mean_signed_m: f64,
    /// standard deviation of the signed distances around their mean, metres
    pub std_m: f64,
    /// largest absolute distance, metres
    pub max_abs_m: f64,
}

impl DistanceStatistics {
    /// Of signed distances, metres; all zero if there are none.
    pub fn from_distances(signed_m: &[f64]) -> Self {
        let count = signed_m.len();
        let mean = |sum: f64| if count == 0 { 0.0 } else { sum / count as f64 };
        let mean_signed_m = mean(signed_m.iter().sum());
        Self {
            count,
            mean_abs_m: mean(signed_m.iter().map(|distance| distance.abs()).sum()),
            mean_signed_m,
            std_m: mean(signed_m.iter().map(|distance| (distance - mean_signed_m).powi(2)).sum()).sqrt(),
            max_abs_m: signed_m.iter().fold(0.0, |most, distance| most.max(distance.abs())),
        }
    }
}

/// How far two surfaces are from each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceComparison {
    /// points of the found surface to the true one; positive where the found one is outside
    pub found_to_true: DistanceStatistics,
    /// points of the true surface to the found one; positive where the found one is outside, so that the signs of both
    /// ways mean the same
    pub true_to_found: DistanceStatistics,
    /// of all distances of both ways
    pub both: DistanceStatistics,
}

/// Distances between two surfaces, both ways, from `samples` points of each that are drawn uniformly by area with this seed.
/// The meshes need not have the same topology.
///
/// # Errors
/// [`crate::Error::NoSurface`] if one has no area.
pub fn compare_surfaces(found: &Mesh, truth: &Mesh, samples: usize, seed: u64) -> Result<SurfaceComparison> {
    let (found_surface, true_surface) = (Surface::new(found)?, Surface::new(truth)?);
    let mut forth = true_surface.signed_distances(&sample_surface(found, samples, seed)?);
    let mut back = found_surface.signed_distances(&sample_surface(truth, samples, seed)?);
    back.iter_mut().for_each(|distance| *distance = -*distance);
    let found_to_true = DistanceStatistics::from_distances(&forth);
    let true_to_found = DistanceStatistics::from_distances(&back);
    forth.append(&mut back);
    Ok(SurfaceComparison { found_to_true, true_to_found, both: DistanceStatistics::from_distances(&forth) })
}

impl Surface {
    /// Signed distances of points from the surface, metres, positive outside; on all cores.
    pub fn signed_distances(&self, points: &[Vector3<f64>]) -> Vec<f64> {
        points.par_iter().map(|point| self.closest(point).signed_m).collect()
    }
}
