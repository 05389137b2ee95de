//! Skinning weights for a template that has none: heat that spreads from the bones over the surface until it rests (Baran and
//! Popović 2007, section 4; docs/papers.md#other-sources).
//!
//! For joint j: `(−Δ + H) w_j = H p_j`, with the cotangent Laplacian Δ, `H = 1/d²` of the distance d to the nearest bone, and
//! p_j = 1 where that bone is joint j's. A bone behind the surface is seen; one in front of it belongs to another limb and
//! is not, which stands for the paper's test of lines of sight.

use model::counted;
use nalgebra::Vector3;

use crate::{Error, Result, Rig, Skin};

/// Weights below this are dropped: they cost time and move nothing.
const LEAST_WEIGHT: f64 = 0.02;
/// Nearest a bone may be to a vertex, metres: keeps H finite.
const NEAREST_M: f64 = 1e-3;

/// Computes skinning weights of a mesh from the positions of the joints in it. A joint's bones lead to its children; that
/// of the last joint of a chain goes on in the direction of the one before it, as far as the mesh does.
///
/// # Errors
/// [`Error::Skin`] if the mesh or the joints can't be those of a body.
pub fn heat_skin(
    rest: &[Vector3<f64>],
    faces: &[[u32; 3]],
    rig: &Rig,
    joints: &[Vector3<f64>],
) -> Result<Skin> {
    if joints.len() != rig.num_joints() {
        let what = format!("positions of {}, expected {}", counted(joints.len(), "joint"), rig.num_joints());
        return Err(Error::Skin { what });
    }
    let mesh = model::Mesh::new(rest.to_vec(), faces.to_vec())?;
    let bones = bones(rest, rig, joints);
    let nearest: Vec<(usize, f64)> = rest
        .iter()
        .zip(mesh.normals())
        .map(|(vertex, normal)| nearest_bone(vertex, &normal, &bones))
        .collect();
    let system = System::new(&mesh, &nearest);
    let mut weights = vec![Vec::new(); rest.len()];
    for joint in 0..rig.num_joints() {
        let right: Vec<f64> =
            (0..rest.len()).map(|v| if nearest[v].0 == joint { system.source[v] } else { 0.0 }).collect();
        if right.iter().all(|&heat| heat == 0.0) {
            continue;
        }
        for (vertex, weight) in system.solve(&right).into_iter().enumerate() {
            if weight > LEAST_WEIGHT {
                weights[vertex].push((joint as u8, weight));
            }
        }
    }
    let (mut all_joints, mut all_weights) = (Vec::new(), Vec::new());
    for mut pairs in weights {
        pairs.sort_by(|a, b| b.1.total_cmp(&a.1));
        pairs.truncate(4);
        let sum: f64 = pairs.iter().map(|(_, weight)| weight).sum();
        all_joints.push(std::array::from_fn(|k| pairs.get(k).map_or(0, |(joint, _)| *joint)));
        all_weights
            .push(std::array::from_fn(|k| pairs.get(k).map_or(0.0, |(_, weight)| (weight / sum) as f32)));
    }
    Skin::new(&all_joints, &all_weights, rig.num_joints())
}

/// Joint and ends of every bone.
fn bones(rest: &[Vector3<f64>], rig: &Rig, joints: &[Vector3<f64>]) -> Vec<(usize, [Vector3<f64>; 2])> {
    let mut bones = Vec::new();
    for (index, joint) in rig.joints().iter().enumerate() {
        let children = rig.joints().iter().enumerate().filter(|(_, child)| child.parent == Some(index));
        let before = bones.len();
        bones.extend(children.map(|(child, _)| (index, [joints[index], joints[child]])));
        if bones.len() == before {
            let from = joint.parent.map_or(joints[index], |parent| joints[parent]);
            let direction = (joints[index] - from).try_normalize(1e-9).unwrap_or_default();
            let is_nearest = |vertex: &&Vector3<f64>| {
                let distance = (*vertex - joints[index]).norm_squared();
                joints.iter().all(|other| (*vertex - other).norm_squared() >= distance)
            };
            let reach = rest.iter().filter(is_nearest).map(|vertex| (vertex - joints[index]).dot(&direction));
            let length = reach.fold(0.0, f64::max) * 0.8;
            bones.push((index, [joints[index], joints[index] + direction * length]));
        }
    }
    bones
}

/// Joint and distance of the nearest bone behind the surface, or of the nearest at all if none is.
fn nearest_bone(
    vertex: &Vector3<f64>,
    normal: &Vector3<f64>,
    bones: &[(usize, [Vector3<f64>; 2])],
) -> (usize, f64) {
    let mut best = (true, f64::INFINITY, 0);
    for (joint, [a, b]) in bones {
        let along = b - a;
        let t = ((vertex - a).dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        let to_bone = a + along * t - vertex;
        let found = (to_bone.dot(normal) > 0.0, to_bone.norm(), *joint);
        if (found.0, found.1) < (best.0, best.1) {
            best = found;
        }
    }
    (best.2, best.1.max(NEAREST_M))
}

/// The symmetric matrix `L + M H` in rows: L the cotangent Laplacian, M the vertices' areas.
struct System {
    diagonal: Vec<f64>,
    /// off the diagonal: column and number, shape `[vertices, any]`
    rows: Vec<Vec<(u32, f64)>>,
    /// `M H`, shape `[vertices]`
    source: Vec<f64>,
}

impl System {
    fn new(mesh: &model::Mesh, nearest: &[(usize, f64)]) -> Self {
        let n = mesh.vertices.len();
        let (mut area, mut diagonal) = (vec![0.0; n], vec![0.0; n]);
        let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
        for face in &mesh.faces {
            let corners = mesh.corners(face);
            for k in 0..3 {
                let (i, j) = (face[(k + 1) % 3], face[(k + 2) % 3]);
                let (u, v) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
                let twice_area = u.cross(&v).norm();
                area[face[k] as usize] += twice_area / 6.0;
                // Slivers have cotangents without bound, which would only spoil the conditioning.
                let weight = (0.5 * u.dot(&v) / twice_area.max(1e-12)).clamp(0.0, 10.0);
                for (row, column) in [(i, j), (j, i)] {
                    diagonal[row as usize] += weight;
                    match rows[row as usize].iter_mut().find(|(c, _)| *c == column) {
                        Some((_, number)) => *number -= weight,
                        None => rows[row as usize].push((column, -weight)),
                    }
                }
            }
        }
        let source: Vec<f64> = area.iter().zip(nearest).map(|(area, (_, d))| area / (d * d)).collect();
        // A vertex without faces is warmed by its bone alone.
        let source: Vec<f64> = source.into_iter().map(|heat| heat.max(1e-12)).collect();
        diagonal.iter_mut().zip(&source).for_each(|(d, heat)| *d += heat);
        Self { diagonal, rows, source }
    }

    /// Conjugate gradients, scaled by the diagonal.
    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let n = right.len();
        let mut x = vec![0.0; n];
        let mut residual = right.to_vec();
        let mut direction: Vec<f64> = residual.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect();
        let mut energy = dense::inner_product(&residual, &direction);
        let enough = 1e-14 * energy;
        let mut image = vec![0.0; n];
        for _ in 0..2000 {
            if energy <= enough || energy.is_nan() {
                break;
            }
            for i in 0..n {
                let others = self.rows[i].iter().map(|&(j, number)| number * direction[j as usize]);
                image[i] = self.diagonal[i] * direction[i] + others.sum::<f64>();
            }
            let step = energy / dense::inner_product(&direction, &image);
            dense::add_scaled(&mut x, step, &direction);
            dense::add_scaled(&mut residual, -step, &image);
            let scaled: Vec<f64> = residual.iter().zip(&self.diagonal).map(|(r, d)| r / d).collect();
            let next = dense::inner_product(&residual, &scaled);
            direction.iter_mut().zip(&scaled).for_each(|(d, s)| *d = s + next / energy * *d);
            energy = next;
        }
        x
    }
}
