use model::Mesh;
use nalgebra::Vector3;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::{Error, Result};

/// Points of a mesh's surface, metres, drawn uniformly by area. The same mesh, count and seed give the same points.
///
/// # Errors
/// [`Error::NoSurface`] if the mesh has no area.
pub fn sample_surface(mesh: &Mesh, count: usize, seed: u64) -> Result<Vec<Vector3<f64>>> {
    let mut area_m2 = 0.0;
    let up_to: Vec<f64> = mesh
        .faces
        .iter()
        .map(|face| {
            let [a, b, c] = mesh.corners(face);
            area_m2 += 0.5 * (b - a).cross(&(c - a)).norm();
            area_m2
        })
        .collect();
    if !(area_m2 > 0.0 && area_m2.is_finite()) {
        return Err(Error::NoSurface { faces: mesh.faces.len(), area_m2 });
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut point = || {
        let at = uniform() * area_m2;
        let face = up_to.partition_point(|&area| area <= at).min(mesh.faces.len() - 1);
        let [a, b, c] = mesh.corners(&mesh.faces[face]);
        let (across, along) = (uniform().sqrt(), uniform());
        a * (1.0 - across) + b * (across * (1.0 - along)) + c * (across * along)
    };
    Ok((0..count).map(|_| point()).collect())
}
