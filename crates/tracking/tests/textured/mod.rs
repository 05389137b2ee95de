//! Pictures of a body whose skin is covered with noise: fixed to it at rest, lit from above (Lambert).
#![allow(dead_code, reason = "each test uses some of it")]

use body::{BodyModel, Posed, Shape};
use model::{Camera, Image};
use nalgebra::{Vector2, Vector3};
use vision::{DepthBuffer, Topology, View};

fn lattice([x, y, z]: [i64; 3], octave: u64) -> f64 {
    let mut h = octave.wrapping_mul(0x1656_67b1_9e37_79f9);
    for number in [x, y, z] {
        h = (h ^ number as u64).wrapping_mul(0xff51_afd7_ed55_8ccd);
        h = (h ^ h >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    (h >> 40) as f64 / (1u64 << 24) as f64
}

/// Noise of four wavelengths, 8 to 1 cm, in [0, 1].
fn skin(rest: &Vector3<f64>) -> f64 {
    let mut sum = 0.0;
    for (octave, (wavelength, share)) in
        [(0.08, 0.35), (0.04, 0.3), (0.02, 0.2), (0.01, 0.15)].into_iter().enumerate()
    {
        let at = rest / wavelength;
        let corner = at.map(f64::floor);
        let t = (at - corner).map(|t| t * t * (3.0 - 2.0 * t));
        let mut value = 0.0;
        for i in 0..8 {
            let bit = [i & 1, i >> 1 & 1, i >> 2 & 1];
            let weight: f64 =
                (0..3).map(|axis| if bit[axis] == 1 { t[axis] } else { 1.0 - t[axis] }).product();
            let place = std::array::from_fn(|axis| corner[axis] as i64 + bit[axis] as i64);
            value += weight * lattice(place, octave as u64);
        }
        sum += share * value;
    }
    // a mean has few low and high values
    (0.5 + 2.2 * (sum - 0.5)).clamp(0.0, 1.0)
}

/// What a camera sees of a posed body before a background of other noise.
pub fn picture(
    model: &BodyModel,
    shape: &Shape,
    posed: &Posed,
    topology: &Topology,
    camera: &Camera,
) -> Image {
    let view = View::new(camera);
    let mut depths = DepthBuffer::new();
    depths.draw(&view, &posed.vertices, topology);
    let [width, height] = view.size;
    let mut image = Image::black(width, height);
    for y in 0..height {
        for x in 0..width {
            let grey = match depths.face(x as isize, y as isize) {
                None => 60.0 + 60.0 * lattice([x as i64 / 6, y as i64 / 6, 0], 9),
                Some(face) => {
                    let corners = model.faces()[face as usize];
                    let [a, b, c] = corners.map(|i| posed.vertices[i as usize]);
                    let normal = (b - a).cross(&(c - a));
                    let ray = camera.ray(Vector2::new(x as f64, y as f64)).unwrap();
                    let point = view.position + ray * ((a - view.position).dot(&normal) / ray.dot(&normal));
                    let area = normal.norm_squared();
                    let v = (point - a).cross(&(c - a)).dot(&normal) / area;
                    let w = (b - a).cross(&(point - a)).dot(&normal) / area;
                    let [p, q, r] = corners.map(|i| shape.vertices[i as usize]);
                    let light = Vector3::new(0.3, 0.8, 0.5).normalize();
                    let lit = 0.5 + 0.5 * normal.normalize().dot(&light).max(0.0);
                    20.0 + 220.0 * lit * skin(&(p * (1.0 - v - w) + q * v + r * w))
                }
            };
            image.set(x, y, [grey.round() as u8; 3]);
        }
    }
    image
}
