//! Correspondences between the rim of the projected model and the contour of an image, both ways.

use vision::RimPoint;

use crate::observation::Outline;

/// Stands for no partner.
pub const NONE: u32 = u32::MAX;

/// Who belongs to whom.
#[derive(Debug, Clone, Default)]
pub struct Matches {
    /// point of the outline for every point of the rim, [`NONE`] if there are none, shape `[rim]`
    pub of_rim: Vec<u32>,
    /// point of the rim for every point of the outline, shape `[outline]`
    pub of_outline: Vec<u32>,
    rim: [Vec<f32>; 4],
    least: Vec<f32>,
}

impl Matches {
    /// Finds for each point its nearest of the other kind. Distances are those of place and normal together: normals that are
    /// opposite count as `2 normal_px` pixels, so that the two sides of a limb are told apart.
    pub fn find(&mut self, rim: &[RimPoint], outline: &Outline, normal_px: f64) {
        for (i, numbers) in self.rim.iter_mut().enumerate() {
            numbers.clear();
            numbers.extend(rim.iter().map(|point| key(point.pixel, point.image_normal, normal_px)[i]));
        }
        let count = rim.len();
        self.least.clear();
        self.least.resize(count, f32::INFINITY);
        self.of_rim.clear();
        self.of_rim.resize(count, NONE);
        self.of_outline.clear();
        let [xs, ys, us, vs] = [0, 1, 2, 3].map(|i| &self.rim[i][..count]);
        for (at, (pixel, normal)) in outline.pixels.iter().zip(&outline.normals).enumerate() {
            let [x, y, u, v] = key(*pixel, *normal, normal_px);
            let (mut nearest, mut nearest_squared) = (NONE, f32::INFINITY);
            let (least, of_rim) = (&mut self.least[..count], &mut self.of_rim[..count]);
            for i in 0..count {
                let (dx, dy, du, dv) = (xs[i] - x, ys[i] - y, us[i] - u, vs[i] - v);
                let squared = dx * dx + dy * dy + du * du + dv * dv;
                let is_less = squared < least[i];
                least[i] = if is_less { squared } else { least[i] };
                of_rim[i] = if is_less { at as u32 } else { of_rim[i] };
                let is_nearest = squared < nearest_squared;
                nearest_squared = if is_nearest { squared } else { nearest_squared };
                nearest = if is_nearest { i as u32 } else { nearest };
            }
            self.of_outline.push(nearest);
        }
    }
}

fn key(pixel: nalgebra::Vector2<f64>, normal: nalgebra::Vector2<f64>, normal_px: f64) -> [f32; 4] {
    [pixel.x, pixel.y, normal.x * normal_px, normal.y * normal_px].map(|x| x as f32)
}
