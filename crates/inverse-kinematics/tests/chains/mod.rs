//! An arm and what two cameras see of it.

use std::{f64::consts::PI, sync::Arc};

use evaluation::limbs::limb::{self, Build, Limb};
use inverse_kinematics::{ImageView, Support, SupportWidth};
use model::Silhouette;
use nalgebra::{Vector2, Vector3};
use vision::{DistanceField, scene::Ring};

/// An arm of 30 and 26 cm whose flesh is the bone.
pub fn arm() -> Limb {
    Limb::new(&Build {
        upper: Vector3::new(0.05, -0.295, 0.0),
        lower: Vector3::new(0.02, -0.26, 0.02),
        hinge: -Vector3::x(),
        bend: [-0.2, 2.4],
        twist: [-0.5 * PI, 0.5 * PI],
        play: 0.15,
        half_width_m: 0.05,
        upper_flesh: Vec::new(),
        lower_flesh: Vec::new(),
    })
    .unwrap()
}

pub const SHOULDER: Vector3<f64> = Vector3::new(0.2, 1.4, 0.1);

/// Coordinates of an arm that is raised forward and bent.
pub fn raised() -> Vec<f64> {
    let mut x = vec![0.0; limb::DOFS];
    limb::place(&mut x, &SHOULDER, 0.4);
    x[limb::UPPER..].copy_from_slice(&[0.6, 0.3, 0.2, 1.2, 0.0, 0.0]);
    x
}

/// Shoulder, elbow and wrist of coordinates.
pub fn joints(limb: &Limb, x: &[f64]) -> Vec<Vector3<f64>> {
    let chain = &limb.chain;
    let mut positions = vec![Vector3::zeros(); chain.points().len()];
    chain.points().positions(chain.kinematics(), x, &mut chain.kinematics().state(), &mut positions);
    positions
}

/// Pixels within 4 cm of the bones in two cameras, a quarter of a turn apart.
pub fn views(joints: &[Vector3<f64>]) -> Vec<ImageView> {
    let ring = Ring {
        cameras: 4,
        distance_m: 5.0,
        heights_m: [1.5, 1.8],
        target: Vector3::y(),
        start: 0.6,
        size: 640,
        focal: 560.0,
    };
    let seen = ring.cameras().into_iter().take(2).map(|camera| {
        let pixels: Vec<_> = joints.iter().map(|joint| camera.project(joint).unwrap()).collect();
        let mut silhouette = Silhouette::empty(camera.size[0] as usize, camera.size[1] as usize);
        for y in 0..silhouette.height() {
            for x in 0..silhouette.width() {
                let at = Vector2::new(x as f64, y as f64);
                let is_near = pixels.windows(2).any(|ends| {
                    let along = ends[1] - ends[0];
                    let t = ((at - ends[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                    (ends[0] + along * t - at).norm() <= 4.5
                });
                silhouette.set(x, y, is_near);
            }
        }
        let field = Arc::new(DistanceField::new(&silhouette, 1));
        let support = Support::seen_at(field, &camera, &SHOULDER, SupportWidth::default());
        ImageView { camera, support }
    });
    seen.collect()
}
