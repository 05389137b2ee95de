//! The energy of points that were found again: how far each point of the skin is from the ray on which it is seen now.
//!
//! For a ray with Plücker coordinates (d, l), d of unit length and l = o × d, the residual of a point V of the posed
//! body is `V × d − l`, whose length is the distance from the ray (docs/papers.md#tracking, eq. 6). It has no part
//! along d, so that two of its coordinates across d are all there is. Weights are those of Geman and McClure.

use body::{BodyModel, Posed, Shape};
use nalgebra::Vector3;
use shape_fit::Quadratic;

use crate::lift::SurfacePoint;

/// How far a point that was lifted rightly is expected to be off its ray, metres: a pixel or two, what skinning and shape don't
/// express, and the error of the pose before.
const SIGMA_M: f64 = 0.006;
/// Share of the robust weight's scale by which a coarse step trusts points less.
const COARSE: f64 = 0.15;
/// Points whose derivatives are held at a time.
const BLOCK: usize = 64;

/// Buffers of one view.
#[derive(Debug, Default)]
pub struct TextureScratch {
    rows: Vec<f64>,
    block: Vec<f64>,
    by_point: Vec<Vector3<f64>>,
    by_corner: Vec<Vector3<f64>>,
}

/// A body in a pose.
#[derive(Clone, Copy)]
pub struct TextureTerm<'a> {
    pub model: &'a BodyModel,
    pub shape: &'a Shape,
    pub posed: &'a Posed,
    /// σ of the robust weight, metres
    pub scale_m: f64,
}

impl TextureTerm<'_> {
    /// Adds the energy of a view's points and its derivatives with respect to the pose.
    pub fn add(&self, points: &[SurfacePoint], scratch: &mut TextureScratch, sum: &mut Quadratic) {
        let dofs = self.model.rig().num_dofs();
        let columns = dofs + 1;
        scratch.block.resize(columns * columns, 0.0);
        scratch.by_point.resize(dofs, Vector3::zeros());
        scratch.by_corner.resize(dofs, Vector3::zeros());
        let scale2 = self.scale_m * self.scale_m;
        let least = 1.0 / (SIGMA_M * SIGMA_M + (COARSE * self.scale_m).powi(2));
        for points in points.chunks(BLOCK) {
            scratch.rows.clear();
            for point in points {
                let place = self.place(point);
                let axes = axes_across(&point.direction);
                let residual = axes.map(|axis| axis.dot(&(place - point.origin)));
                let squared = residual[0] * residual[0] + residual[1] * residual[1];
                let robust = scale2 / (squared + scale2);
                let weight = point.share * least;
                sum.energy += weight * squared * robust;
                let root = weight.sqrt() * robust;
                self.differentiate(point, scratch);
                for (axis, residual) in axes.iter().zip(residual) {
                    scratch.rows.extend(scratch.by_point.iter().map(|moved| root * axis.dot(moved)));
                    scratch.rows.push(root * residual);
                }
            }
            dense::self_product(&scratch.rows, columns, &mut scratch.block);
            sum.product.iter_mut().zip(&scratch.block).for_each(|(sum, x)| *sum += x);
        }
    }

    /// Where a point of the skin is, metres.
    fn place(&self, point: &SurfacePoint) -> Vector3<f64> {
        let corners = point.vertices.iter().zip(point.weights);
        corners.map(|(&vertex, weight)| self.posed.vertices[vertex as usize] * weight).sum()
    }

    /// Derivative of that with respect to the pose, into `scratch.by_point`.
    fn differentiate(&self, point: &SurfacePoint, scratch: &mut TextureScratch) {
        scratch.by_point.fill(Vector3::zeros());
        for (&vertex, weight) in point.vertices.iter().zip(point.weights) {
            self.posed.vertex_by_pose(self.model, self.shape, vertex as usize, &mut scratch.by_corner);
            for (sum, moved) in scratch.by_point.iter_mut().zip(&scratch.by_corner) {
                *sum += moved * weight;
            }
        }
    }
}

/// Two unit vectors at right angles to a unit vector and to each other.
fn axes_across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = Vector3::ith(direction.iamin(), 1.0);
    let first = direction.cross(&least).normalize();
    [first, direction.cross(&first)]
}

#[cfg(test)]
mod tests {
    use kinematics::check_jacobian;

    use super::*;

    fn point(seed: f64) -> SurfacePoint {
        SurfacePoint {
            vertices: [(700.0 * seed) as u32, (700.0 * seed) as u32 + 4, (700.0 * seed) as u32 + 9],
            weights: [0.5, 0.2, 0.3],
            origin: Vector3::new(3.0 * seed.sin(), 1.2, 3.0 * seed.cos()),
            direction: Vector3::new(-seed.sin(), 0.1 * seed.sin(), -seed.cos()).normalize(),
            share: 0.7,
        }
    }

    #[test]
    fn the_residual_is_that_of_plucker_coordinates() {
        for seed in 1..6 {
            let SurfacePoint { origin, direction, .. } = point(f64::from(seed));
            let place = Vector3::new(0.3, 0.8, -0.2) * f64::from(seed);
            let plucker = place.cross(&direction) - origin.cross(&direction);
            let across = axes_across(&direction).map(|axis| axis.dot(&(place - origin)));
            assert!((plucker.norm() - across[0].hypot(across[1])).abs() < 1e-12);
        }
    }

    #[test]
    fn the_derivative_of_a_distance_from_a_ray_is_that_of_differences() {
        let model = BodyModel::shipped();
        let shape = model.shape(&[0.7, -1.0]);
        let pose: Vec<f64> = (0..model.rig().num_dofs()).map(|i| 0.4 * (i as f64 * 1.7).sin()).collect();
        let points: Vec<SurfacePoint> = (1..9).map(|seed| point(f64::from(seed))).collect();
        let mut posed = Posed::default();
        shape.pose(&model, &pose, &mut posed);
        let term = TextureTerm { model: &model, shape: &shape, posed: &posed, scale_m: 0.1 };
        let mut scratch = TextureScratch::default();
        let mut jacobian = Vec::new();
        scratch.by_point.resize(pose.len(), Vector3::zeros());
        scratch.by_corner.resize(pose.len(), Vector3::zeros());
        for point in &points {
            term.differentiate(point, &mut scratch);
            for axis in axes_across(&point.direction) {
                jacobian.extend(scratch.by_point.iter().map(|moved| axis.dot(moved)));
            }
        }
        check_jacobian(&pose, 2 * points.len(), &jacobian, 1e-6, |pose, residuals| {
            let mut posed = Posed::default();
            shape.pose(&model, pose, &mut posed);
            let term = TextureTerm { posed: &posed, ..term };
            for (point, residuals) in points.iter().zip(residuals.chunks_exact_mut(2)) {
                let from = term.place(point) - point.origin;
                for (residual, axis) in residuals.iter_mut().zip(axes_across(&point.direction)) {
                    *residual = axis.dot(&from);
                }
            }
        })
        .unwrap();
    }

    #[test]
    fn the_gradient_is_half_the_slope_of_the_energy_where_points_are_near() {
        let model = BodyModel::shipped();
        let shape = model.shape(&[]);
        let pose = vec![0.05; model.rig().num_dofs()];
        // rays through points of the body a little aside
        let at = |pose: &[f64]| {
            let mut posed = Posed::default();
            shape.pose(&model, pose, &mut posed);
            posed
        };
        let posed = at(&pose);
        let near = |seed: i32| {
            let mut point = point(f64::from(seed));
            let place = posed.vertices[point.vertices[0] as usize] + Vector3::new(0.01, -0.004, 0.002);
            point.direction = (place - point.origin).normalize();
            point
        };
        let points: Vec<SurfacePoint> = (1..9).map(near).collect();
        let columns = pose.len() + 1;
        let evaluate = |posed: &Posed| {
            let mut sum = Quadratic { product: vec![0.0; columns * columns], energy: 0.0 };
            // so wide that the weights hardly change
            let term = TextureTerm { model: &model, shape: &shape, posed, scale_m: 100.0 };
            term.add(&points, &mut TextureScratch::default(), &mut sum);
            sum
        };
        let sum = evaluate(&posed);
        for d in 0..pose.len() {
            let mut moved = [pose.clone(), pose.clone()];
            (moved[0][d], moved[1][d]) = (pose[d] - 1e-5, pose[d] + 1e-5);
            let [low, high] = moved.map(|pose| evaluate(&at(&pose)).energy);
            let (found, expected) = (sum.product[d * columns + pose.len()], (high - low) / 4e-5);
            assert!((found - expected).abs() <= 1e-5 * expected.abs().max(1e-3), "{d}: {found} {expected}");
        }
    }
}
