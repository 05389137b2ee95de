//! Pictures of a textured surface through a known similarity.
#![allow(dead_code, reason = "each test uses some of it")]

use model::{Image, Silhouette};
use nalgebra::{Rotation2, Vector2};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// How a picture differs from that of the surface itself.
#[derive(Debug, Clone, Copy)]
pub struct Change {
    /// radians about the middle of the picture
    pub turn: f64,
    pub scale: f64,
    pub shift: Vector2<f64>,
    /// factor and offset of grey levels
    pub light: [f64; 2],
    /// standard deviation, grey levels
    pub noise: f64,
}

pub const NONE: Change =
    Change { turn: 0.0, scale: 1.0, shift: Vector2::new(0.0, 0.0), light: [1.0, 0.0], noise: 0.0 };

impl Change {
    /// Where a pixel of the unchanged picture is.
    pub fn place(&self, pixel: Vector2<f64>, size: [usize; 2]) -> Vector2<f64> {
        let middle = Vector2::new(size[0] as f64, size[1] as f64) / 2.0;
        Rotation2::new(self.turn) * (pixel - middle) * self.scale + middle + self.shift
    }

    fn back(&self, pixel: Vector2<f64>, size: [usize; 2]) -> Vector2<f64> {
        let middle = Vector2::new(size[0] as f64, size[1] as f64) / 2.0;
        Rotation2::new(-self.turn) * (pixel - middle - self.shift) / self.scale + middle
    }
}

fn lattice(x: i64, y: i64, octave: u64) -> f64 {
    let mut h =
        (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    h = (h ^ octave.wrapping_mul(0x1656_67b1_9e37_79f9)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    h = (h ^ h >> 33).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    (h >> 40) as f64 / (1u64 << 24) as f64 - 0.5
}

/// Smooth noise of five wavelengths, grey levels.
pub fn surface(at: Vector2<f64>) -> f64 {
    let mut sum = 120.0;
    for (octave, wavelength) in [64.0, 32.0, 16.0, 9.0, 5.0].into_iter().enumerate() {
        let p = at / wavelength;
        let (x, y) = (p.x.floor(), p.y.floor());
        let smooth = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        let (u, v) = (smooth(p.x - x), smooth(p.y - y));
        let at = |dx: i64, dy: i64| lattice(x as i64 + dx, y as i64 + dy, octave as u64);
        let upper = at(0, 0) + (at(1, 0) - at(0, 0)) * u;
        let lower = at(0, 1) + (at(1, 1) - at(0, 1)) * u;
        sum += [70.0, 60.0, 50.0, 40.0, 30.0][octave] * (upper + (lower - upper) * v);
    }
    sum
}

/// A picture of the surface inside an ellipse that is changed as well; around it a background of another texture that does not
/// move. With the silhouette of the ellipse.
pub fn picture(size: [usize; 2], change: Change, seed: u64) -> (Image, Silhouette) {
    let [width, height] = size;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut bytes, mut mask) = (Vec::new(), Vec::new());
    for y in 0..height {
        for x in 0..width {
            let pixel = Vector2::new(x as f64, y as f64);
            let at = change.back(pixel, size);
            let from_middle = (at - Vector2::new(width as f64, height as f64) / 2.0)
                .component_div(&Vector2::new(0.40 * width as f64, 0.40 * height as f64));
            let is_inside = from_middle.norm() < 1.0;
            let grey = if is_inside {
                change.light[0] * surface(at) + change.light[1]
            } else {
                surface(pixel.yx() * 0.9 + Vector2::repeat(5000.0))
            };
            let noise: f64 = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            bytes.extend([(grey + change.noise * noise).round() as u8; 3]);
            mask.push(u8::from(is_inside));
        }
    }
    let silhouette = Silhouette::from_pixels(width, height, &mask, |m| m == 1).unwrap();
    (Image::from_rgb(width, height, bytes).unwrap(), silhouette)
}
