//! Bodies that move, drawn by a ring of cameras.
#![allow(dead_code, reason = "each test uses some of it")]

use body::{BodyModel, Posed, Shape};
use model::{Camera, Mesh, Silhouette};
use nalgebra::Vector3;
use shape_fit::{ARMS, LEGS, limb_dofs, set_limb};
use tracking::blended;
use vision::scene::{Ring, silhouettes};

pub type Views = Vec<(Camera, Silhouette)>;

/// A pose with a heading, and rows of the tables of arms and legs: left arm, right arm, left leg, right leg.
pub fn pose(model: &BodyModel, heading: f64, chosen: [usize; 4]) -> Vec<f64> {
    let mut pose = vec![0.0; model.rig().num_dofs()];
    for (limb, (dofs, index)) in limb_dofs(model).iter().zip(chosen).enumerate() {
        set_limb(&mut pose, dofs, if limb < 2 { &ARMS[index] } else { &LEGS[index] });
    }
    model.rig().clamp(&mut pose);
    pose[4] = heading;
    pose
}

/// Poses with `steps` frames from each key to the next.
pub fn motion(keys: &[Vec<f64>], steps: usize) -> Vec<Vec<f64>> {
    let between = |pair: &[Vec<f64>]| -> Vec<Vec<f64>> {
        (0..steps)
            .map(|i| {
                let share = i as f64 / steps as f64;
                blended(&pair[0], &pair[1], share * share * (3.0 - 2.0 * share))
            })
            .collect()
    };
    keys.windows(2).flat_map(between).chain(keys.last().cloned()).collect()
}

/// A mixed motion: arms to the side, hands up, squat, a knee up, a turn.
pub fn mixed(model: &BodyModel, steps: usize) -> Vec<Vec<f64>> {
    let keys = [
        pose(model, 0.2, [0, 0, 0, 0]),
        pose(model, 0.3, [1, 1, 0, 0]),
        pose(model, 0.5, [4, 2, 4, 5]),
        pose(model, 0.7, [3, 5, 1, 1]),
        pose(model, 1.0, [8, 9, 2, 0]),
        pose(model, 1.5, [10, 6, 6, 0]),
    ];
    motion(&keys, steps)
}

pub fn cameras(count: usize) -> Vec<Camera> {
    Ring { cameras: count, size: 502, focal: 663.0, ..Ring::default() }.cameras()
}

/// The silhouettes of a posed body and its joints.
pub fn seen(
    model: &BodyModel,
    shape: &Shape,
    pose: &[f64],
    cameras: &[Camera],
) -> (Views, Vec<Vector3<f64>>) {
    let mut posed = Posed::default();
    shape.pose(model, pose, &mut posed);
    let mesh = Mesh::new(posed.vertices, model.faces().to_vec()).unwrap();
    (cameras.iter().cloned().zip(silhouettes(&mesh, cameras)).collect(), posed.joints)
}

/// Distances of all joints, metres.
pub fn distances<'a>(a: &'a [Vector3<f64>], b: &'a [Vector3<f64>]) -> impl Iterator<Item = f64> + 'a {
    a.iter().zip(b).map(|(a, b)| (a - b).norm())
}
