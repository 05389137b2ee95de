//! Synthetic captures: a ring of cameras, silhouettes of a mesh, and the noise of a camera and its background model.

use model::{Camera, Distortion, Mesh, Silhouette};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::{Rasteriser, Topology, View};

/// Cameras in a circle around one place, at two heights in turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// number of cameras
    pub cameras: usize,
    /// distance from the axis of the ring, metres
    pub distance_m: f64,
    /// heights of cameras of even and of odd number, metres
    pub heights_m: [f64; 2],
    /// what all cameras look at, metres
    pub target: Vector3<f64>,
    /// direction of camera 0 from the target, radians from z towards x
    pub start: f64,
    /// width and height of the images, pixels
    pub size: u32,
    /// focal length, pixels
    pub focal: f64,
}

impl Default for Ring {
    fn default() -> Self {
        Self {
            cameras: 8,
            distance_m: 3.5,
            heights_m: [1.05, 1.65],
            target: Vector3::new(0.0, 1.0, 0.0),
            start: 0.2,
            size: 1004,
            focal: 1327.0,
        }
    }
}

impl Ring {
    /// The cameras, named `cam0` and so on, without lens distortion.
    pub fn cameras(&self) -> Vec<Camera> {
        (0..self.cameras).map(|index| self.camera(index)).collect()
    }

    fn camera(&self, index: usize) -> Camera {
        let angle = self.start + index as f64 * std::f64::consts::TAU / self.cameras as f64;
        let mut position = self.target + Vector3::new(angle.sin(), 0.0, angle.cos()) * self.distance_m;
        position.y = self.heights_m[index % 2];
        let forward = (self.target - position).normalize();
        let right = forward.cross(&Vector3::y()).normalize();
        let down = forward.cross(&right);
        let rows = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
        Camera {
            name: format!("cam{index}"),
            size: [self.size; 2],
            focal: Vector2::repeat(self.focal),
            principal: Vector2::repeat((f64::from(self.size) - 1.0) / 2.0),
            distortion: Distortion::default(),
            camera_from_world: Isometry3::from_parts(Translation3::from(-(rotation * position)), rotation),
        }
    }
}

/// Silhouettes of a mesh in all cameras.
pub fn silhouettes(mesh: &Mesh, cameras: &[Camera]) -> Vec<Silhouette> {
    let topology = Topology::new(&mesh.faces, mesh.vertices.len());
    let draw = |camera: &Camera| {
        let mut silhouette = Silhouette::empty(camera.size[0] as usize, camera.size[1] as usize);
        Rasteriser::new().silhouette(&View::new(camera), &mesh.vertices, &topology, &mut silhouette);
        silhouette
    };
    cameras.par_iter().map(draw).collect()
}

/// What a camera and a background model do to a silhouette. In this order:
///
/// 1. `blobs` discs are added. Their centres are drawn uniformly from the box around the person, made larger by a tenth of
///    its height on all sides.
/// 2. `holes` discs are cut out. Their centres are drawn uniformly from the pixels that showed the person before step 1.
/// 3. Every pixel of the image is turned over with the probability `flipped`, independently.
///
/// Radii are uniform between the two of `radii`, as shares of the height of the box. Everything is drawn from one stream of
/// random numbers for each (seed, view); an empty silhouette only suffers step 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SilhouetteNoise {
    /// probability that a pixel is turned over
    pub flipped: f64,
    /// number of discs added
    pub blobs: usize,
    /// number of discs cut out
    pub holes: usize,
    /// least and greatest radius of a disc, as a share of the person's height in the image
    pub radii: [f64; 2],
}

impl Default for SilhouetteNoise {
    fn default() -> Self {
        Self { flipped: 0.012, blobs: 6, holes: 6, radii: [0.005, 0.02] }
    }
}

impl SilhouetteNoise {
    /// Adds the noise to a silhouette; the same seed and view give the same noise.
    pub fn add_to(&self, silhouette: &mut Silhouette, seed: u64, view: u64) {
        let mut random = RandomStream::new(seed, view);
        if let Some(bounds) = silhouette.bounds() {
            self.add_discs(silhouette, bounds, &mut random);
        }
        for y in 0..silhouette.height() {
            for x in 0..silhouette.width() {
                if random.uniform() < self.flipped {
                    let is_person = silhouette.contains(x as isize, y as isize);
                    silhouette.set(x, y, !is_person);
                }
            }
        }
    }

    fn add_discs(&self, silhouette: &mut Silhouette, bounds: [usize; 4], random: &mut RandomStream) {
        let [left, top, right, bottom] = bounds.map(|side| side as f64);
        let (height, margin) = (bottom - top, 0.1 * (bottom - top));
        let person = silhouette.clone();
        for index in 0..self.blobs + self.holes {
            let is_blob = index < self.blobs;
            let centre = if is_blob {
                let x = random.between(left - margin, right + margin);
                Vector2::new(x, random.between(top - margin, bottom + margin))
            } else {
                loop {
                    let (x, y) = (random.between(left, right), random.between(top, bottom));
                    if person.contains(x as isize, y as isize) {
                        break Vector2::new(x.floor(), y.floor());
                    }
                }
            };
            let radius = random.between(self.radii[0], self.radii[1]) * height;
            let rows = (centre.y - radius).max(0.0) as usize..=(centre.y + radius).max(0.0) as usize;
            for y in rows {
                for x in (centre.x - radius).max(0.0) as usize..=(centre.x + radius).max(0.0) as usize {
                    if (Vector2::new(x as f64, y as f64) - centre).norm() <= radius {
                        silhouette.set(x, y, is_blob);
                    }
                }
            }
        }
    }
}

/// The random numbers of one view.
struct RandomStream(ChaCha8Rng);

impl RandomStream {
    fn new(seed: u64, view: u64) -> Self {
        let mut bytes = [0; 32];
        bytes[..8].copy_from_slice(&seed.to_le_bytes());
        bytes[8..16].copy_from_slice(&view.to_le_bytes());
        Self(ChaCha8Rng::from_seed(bytes))
    }

    /// Uniform in [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cameras_of_a_ring_see_its_target_in_the_middle_and_upright() {
        let ring = Ring::default();
        let cameras = ring.cameras();
        assert_eq!(cameras.len(), 8);
        for camera in &cameras {
            let middle = camera.project(&ring.target).unwrap();
            assert!((middle - camera.principal).norm() < 1e-9);
            let above = camera.project(&(ring.target + Vector3::new(0.0, 0.5, 0.0))).unwrap();
            assert!(above.y < middle.y - 100.0 && (above.x - middle.x).abs() < 1e-6, "{}", camera.name);
            let from_axis = camera.position() - ring.target;
            assert!((from_axis.xz().norm() - 3.5).abs() < 1e-9);
        }
    }

    #[test]
    fn noise_turns_over_its_share_and_depends_on_seed_and_view_alone() {
        let mut clean = Silhouette::empty(400, 400);
        for y in 50..350 {
            for x in 150..250 {
                clean.set(x, y, true);
            }
        }
        let noisy = |noise: SilhouetteNoise, seed, view| {
            let mut silhouette = clean.clone();
            noise.add_to(&mut silhouette, seed, view);
            silhouette
        };
        let changed = |silhouette: &Silhouette| -> u32 {
            clean.words().iter().zip(silhouette.words()).map(|(a, b)| (a ^ b).count_ones()).sum()
        };
        let flips = SilhouetteNoise { blobs: 0, holes: 0, ..SilhouetteNoise::default() };
        let share = f64::from(changed(&noisy(flips, 7, 0))) / 160_000.0;
        assert!((share - 0.012).abs() < 0.001, "{share} of the pixels changed");
        let all = SilhouetteNoise::default();
        assert_eq!(noisy(all, 7, 3), noisy(all, 7, 3));
        assert_ne!(noisy(all, 7, 3), noisy(all, 7, 4));
        assert_ne!(noisy(all, 7, 3), noisy(all, 8, 3));
        let holes = SilhouetteNoise { flipped: 0.0, blobs: 0, ..all };
        assert!(noisy(holes, 1, 0).area() < clean.area());
        let blobs = SilhouetteNoise { flipped: 0.0, holes: 0, ..all };
        assert!(noisy(blobs, 1, 0).area() > clean.area());
    }
}
