//! Correspondences between the rim of the projected model and the contour of an image, both ways.

use pulp::{Arch, Simd, WithSimd};
use vision::RimPoint;

use crate::observation::Outline;

/// Stands for no partner.
pub const NONE: u32 = u32::MAX;

/// Who belongs to whom.
#[derive(Debug, Clone, Default)]
pub struct Matches {
    /// point of the outline for every point of the rim, [`NONE`] if there are none, shape `[rim]`
    pub by_rim: Vec<u32>,
    /// point of the rim for every point of the outline, shape `[outline]`
    pub by_outline: Vec<u32>,
    rim: [Vec<f32>; 4],
    least: Vec<f32>,
    squared: Vec<f32>,
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
        self.by_rim.clear();
        self.by_rim.resize(count, NONE);
        self.by_outline.clear();
        self.squared.resize(count, 0.0);
        let rim = self.rim.each_ref().map(|numbers| &numbers[..count]);
        let (least, by_rim) = (&mut self.least[..count], &mut self.by_rim[..count]);
        for (at, (pixel, normal)) in outline.pixels.iter().zip(&outline.normals).enumerate() {
            let point = key(*pixel, *normal, normal_px);
            let squared = &mut self.squared[..count];
            let nearest = Arch::new().dispatch(Nearest { at: at as u32, point, rim, squared, least, by_rim });
            self.by_outline.push(nearest);
        }
    }
}

/// The search for the partner of one point of the outline; rim points that find it nearer than others before take it.
struct Nearest<'a> {
    at: u32,
    point: [f32; 4],
    rim: [&'a [f32]; 4],
    squared: &'a mut [f32],
    least: &'a mut [f32],
    by_rim: &'a mut [u32],
}

/// Numbers compared at a time.
const LANES: usize = 8;

impl WithSimd for Nearest<'_> {
    type Output = u32;

    /// Index of the first of the nearest rim points.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> u32 {
        let Self { at, point: [x, y, u, v], rim: [xs, ys, us, vs], squared, least, by_rim } = self;
        let count = squared.len();
        let (xs, ys, us, vs) = (&xs[..count], &ys[..count], &us[..count], &vs[..count]);
        let (least, by_rim) = (&mut least[..count], &mut by_rim[..count]);
        for i in 0..count {
            let (dx, dy, du, dv) = (xs[i] - x, ys[i] - y, us[i] - u, vs[i] - v);
            let distance = dx * dx + dy * dy + du * du + dv * dv;
            squared[i] = distance;
            let is_less = distance < least[i];
            least[i] = if is_less { distance } else { least[i] };
            by_rim[i] = if is_less { at } else { by_rim[i] };
        }
        let (chunks, rest) = squared.as_chunks::<LANES>();
        let mut lanes = [f32::INFINITY; LANES];
        for chunk in chunks {
            for lane in 0..LANES {
                lanes[lane] = if chunk[lane] < lanes[lane] { chunk[lane] } else { lanes[lane] };
            }
        }
        let smallest = lanes.iter().chain(rest).copied().fold(f32::INFINITY, f32::min);
        squared.iter().position(|&distance| distance == smallest).map_or(NONE, |i| i as u32)
    }
}

fn key(pixel: nalgebra::Vector2<f64>, normal: nalgebra::Vector2<f64>, normal_px: f64) -> [f32; 4] {
    [pixel.x, pixel.y, normal.x * normal_px, normal.y * normal_px].map(|x| x as f32)
}
