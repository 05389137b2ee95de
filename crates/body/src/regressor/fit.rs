//! Weights of vertices from meshes whose joints are known.

use nalgebra::{DMatrix, DVector, Vector3};

use super::JointRegressor;
use crate::{Error, Result};

/// Vertices that a joint may use in each of the eight directions around it, nearest first: a weighted mean lies between its
/// vertices, so they must surround the joint.
const PER_OCTANT: usize = 12;
/// What keeps weights from growing where meshes don't tell, square metres a mesh.
const RIDGE_M2: f64 = 1e-5;
/// How much the sum of the weights counts against the positions, square metres a mesh.
const SUM_M2: f64 = 1.0;

/// See [`JointRegressor::fit`].
pub fn fit(meshes: &[&[Vector3<f64>]], joints: &[&[Vector3<f64>]]) -> Result<JointRegressor> {
    let (Some(first), Some(first_joints)) = (meshes.first(), joints.first()) else {
        return Err(Error::Regressor { what: "no meshes to fit to".into() });
    };
    if meshes.len() != joints.len()
        || meshes.iter().any(|mesh| mesh.len() != first.len())
        || joints.iter().any(|own| own.len() != first_joints.len())
    {
        let what = "meshes and joints to fit to have different counts".into();
        return Err(Error::Regressor { what });
    }
    let rows = (0..first_joints.len()).map(|joint| fit_joint(meshes, joints, joint)).collect();
    JointRegressor::new(rows, first.len())
}

fn fit_joint(meshes: &[&[Vector3<f64>]], joints: &[&[Vector3<f64>]], joint: usize) -> Vec<(u32, f32)> {
    let candidates = around(meshes[0], &joints[0][joint]);
    let n = candidates.len();
    let count = meshes.len() as f64;
    // About the joint itself the target is 0, and the sum of the weights alone has to be told.
    let mut gram = DMatrix::from_element(n, n, SUM_M2 * count);
    let right = DVector::from_element(n, SUM_M2 * count);
    for (mesh, joints) in meshes.iter().zip(joints) {
        let offsets: Vec<_> = candidates.iter().map(|&v| mesh[v as usize] - joints[joint]).collect();
        for (i, a) in offsets.iter().enumerate() {
            for (j, b) in offsets.iter().enumerate() {
                gram[(i, j)] += a.dot(b);
            }
        }
    }
    for i in 0..n {
        gram[(i, i)] += RIDGE_M2 * count;
    }
    let weights = non_negative(&gram, &right);
    let least = 1e-3 * weights.max();
    let sum: f64 = weights.iter().filter(|weight| **weight > least).sum();
    let kept = candidates.into_iter().zip(&weights).filter(|(_, weight)| **weight > least);
    kept.map(|(vertex, weight)| (vertex, (weight / sum) as f32)).collect()
}

/// The vertices nearest to a point in each octant around it.
fn around(mesh: &[Vector3<f64>], point: &Vector3<f64>) -> Vec<u32> {
    let mut octants: [Vec<(f64, u32)>; 8] = Default::default();
    for (vertex, position) in mesh.iter().enumerate() {
        let offset = position - point;
        let octant = (0..3).fold(0, |bits, axis| bits | usize::from(offset[axis] > 0.0) << axis);
        octants[octant].push((offset.norm_squared(), vertex as u32));
    }
    for octant in &mut octants {
        octant.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        octant.truncate(PER_OCTANT);
    }
    octants.iter().flatten().map(|&(_, vertex)| vertex).collect()
}

/// Least squares with x ≥ 0, by coordinate descent on `xᵀ G x / 2 − bᵀ x`.
fn non_negative(gram: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let n = right.len();
    let mut x = DVector::from_element(n, 1.0 / n as f64);
    let mut slope = gram * &x - right;
    for _ in 0..3000 {
        let mut most: f64 = 0.0;
        for i in 0..n {
            let next = (x[i] - slope[i] / gram[(i, i)]).max(0.0);
            let step = next - x[i];
            if step != 0.0 {
                x[i] = next;
                slope.axpy(step, &gram.column(i), 1.0);
                most = most.max(step.abs());
            }
        }
        if most < 1e-9 {
            break;
        }
    }
    x
}
