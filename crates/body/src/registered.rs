//! Pose and shape of a model from a mesh of the same topology: every vertex has its place.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::procrustes::rigid;
use crate::{BodyModel, Limb, Posed, Shape, ShapeDrift};

/// How to fit a registered mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisteredOptions {
    /// every how many-th vertex is used
    pub stride: usize,
    /// how far vertices are off, metres, one standard deviation of a coordinate; weighs them against the shape's prior
    pub sigma_m: f64,
    /// standard deviation of the angles about the rest pose, radians; `None` leaves them free
    pub angle_sigma: Option<f64>,
    /// how many coefficients of the shape are fitted; 0 keeps the shape
    pub components: usize,
    /// most steps
    pub iterations: usize,
}

impl Default for RegisteredOptions {
    fn default() -> Self {
        Self { stride: 4, sigma_m: 0.02, angle_sigma: None, components: 0, iterations: 60 }
    }
}

/// What was fitted to a registered mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct RegisteredFit {
    /// shape `[dofs]`
    pub pose: Vec<f64>,
    /// shape `[components]`, those that weren't fitted as in the shape given
    pub alpha: Vec<f64>,
}

/// Fits the pose, and the first coefficients of the shape if asked for, to a mesh of the model's topology, by
/// Levenberg–Marquardt from the rest pose placed at the target's torso. Limits of angles are not imposed.
///
/// # Panics
/// If the mesh has not as many vertices as the model.
pub fn fit_registered(
    model: &BodyModel,
    shape: &Shape,
    target: &[Vector3<f64>],
    options: &RegisteredOptions,
) -> RegisteredFit {
    assert_eq!(target.len(), model.num_vertices(), "vertices of the target and of the model");
    let mut problem = Problem::new(model, shape, target, options);
    let mut x = problem.start();
    let mut cost = problem.cost(&x);
    let mut damping = 1e-3;
    for _ in 0..options.iterations {
        let (normal, gradient) = problem.linearise(&x);
        let mut is_done = true;
        for _ in 0..8 {
            let mut damped = normal.clone();
            for i in 0..x.len() {
                damped[(i, i)] *= 1.0 + damping;
            }
            let Some(factor) = damped.cholesky() else { break };
            let step = factor.solve(&gradient);
            let next: Vec<f64> = x.iter().zip(&step).map(|(x, step)| x - step).collect();
            let next_cost = problem.cost(&next);
            if next_cost < cost {
                is_done = step.amax() < 1e-6 || cost - next_cost < 1e-9 * cost;
                (x, cost) = (next, next_cost);
                damping = (damping * 0.2).max(1e-9);
                break;
            }
            damping *= 5.0;
        }
        if is_done {
            break;
        }
    }
    let dofs = model.rig().num_dofs();
    let mut alpha = shape.alpha.clone();
    alpha[..x.len() - dofs].copy_from_slice(&x[dofs..]);
    RegisteredFit { pose: x[..dofs].to_vec(), alpha }
}

struct Problem<'a> {
    model: &'a BodyModel,
    target: &'a [Vector3<f64>],
    options: &'a RegisteredOptions,
    /// indices of the vertices that are used
    vertices: Vec<u32>,
    components: usize,
    shape: Shape,
    posed: Posed,
    drift: ShapeDrift,
}

impl<'a> Problem<'a> {
    fn new(
        model: &'a BodyModel,
        shape: &Shape,
        target: &'a [Vector3<f64>],
        options: &'a RegisteredOptions,
    ) -> Self {
        let vertices = (0..model.num_vertices() as u32).step_by(options.stride.max(1)).collect();
        let components = options.components.min(model.num_components());
        let (posed, drift) = (Posed::default(), ShapeDrift::default());
        Self { model, target, options, vertices, components, shape: shape.clone(), posed, drift }
    }

    /// The root as the torso lies, all angles 0.
    fn start(&self) -> Vec<f64> {
        let is_torso = |(limb, _): &(&Limb, _)| **limb == Limb::Torso;
        let pairs = self.shape.vertices.iter().zip(self.target);
        let torso = self.model.limbs().iter().zip(pairs).filter(is_torso).map(|(_, pair)| pair);
        let found = rigid(torso);
        let root = self.shape.joints[0];
        let dofs = self.model.rig().num_dofs();
        let mut x = vec![0.0; dofs + self.components];
        // The scale goes with the shape; the torso's place is kept by way of the root.
        let shift = found.apply(&root) - root;
        x[..3].copy_from_slice(shift.as_slice());
        x[3..6].copy_from_slice(kinematics::rotation_log(&found.rotation).as_slice());
        x[dofs..].copy_from_slice(&self.shape.alpha[..self.components]);
        x
    }

    fn pose(&mut self, x: &[f64]) {
        let (pose, alpha) = x.split_at(self.model.rig().num_dofs());
        if self.components > 0 {
            self.model.shape_into(alpha, &mut self.shape);
        }
        self.shape.pose_vertices(self.model, pose, &self.vertices, &mut self.posed);
    }

    /// What a number is expected to be off from 0: standard deviation of coordinate `i`, infinite if it is free.
    fn prior_sigma(&self, i: usize) -> f64 {
        let dofs = self.model.rig().num_dofs();
        if i >= dofs {
            1.0
        } else if i < crate::ROOT_DOFS {
            f64::INFINITY
        } else {
            self.options.angle_sigma.unwrap_or(f64::INFINITY)
        }
    }

    fn cost(&mut self, x: &[f64]) -> f64 {
        self.pose(x);
        let miss =
            |(posed, &vertex): (&Vector3<f64>, &u32)| (posed - self.target[vertex as usize]).norm_squared();
        let evidence: f64 = self.posed.vertices.iter().zip(&self.vertices).map(miss).sum();
        let prior: f64 = x.iter().enumerate().map(|(i, x)| (x / self.prior_sigma(i)).powi(2)).sum();
        evidence / self.options.sigma_m.powi(2) + prior
    }

    /// Half the Hessian (Gauss–Newton) and half the gradient of the cost.
    fn linearise(&mut self, x: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        self.pose(x);
        self.drift.update(self.model, &self.posed);
        let (dofs, width) = (self.model.rig().num_dofs(), x.len());
        // One more column holds the residuals, so that one product gives matrix and gradient.
        let columns = width + 1;
        let mut rows = vec![0.0; 3 * self.vertices.len() * columns];
        let mut derivatives = vec![Vector3::zeros(); columns];
        for ((rows, &vertex), posed) in
            rows.chunks_exact_mut(3 * columns).zip(&self.vertices).zip(&self.posed.vertices)
        {
            let vertex = vertex as usize;
            let (by_pose, rest) = derivatives.split_at_mut(dofs);
            self.posed.vertex_by_pose(self.model, &self.shape, vertex, by_pose);
            if self.components > 0 {
                let by_shape = &mut rest[..self.components];
                self.posed.vertex_by_shape(self.model, &self.drift, vertex, by_shape);
            }
            rest[self.components] = posed - self.target[vertex];
            for (axis, row) in rows.chunks_exact_mut(columns).enumerate() {
                row.iter_mut()
                    .zip(&derivatives)
                    .for_each(|(number, d)| *number = d[axis] / self.options.sigma_m);
            }
        }
        let mut product = vec![0.0; columns * columns];
        dense::self_product(&rows, columns, &mut product);
        let weight = |i: usize| self.prior_sigma(i).powi(-2);
        let prior = |i: usize, j: usize| if i == j { weight(i) } else { 0.0 };
        let normal = DMatrix::from_fn(width, width, |i, j| product[i * columns + j] + prior(i, j));
        let gradient = DVector::from_fn(width, |i, _| product[i * columns + width] + weight(i) * x[i]);
        (normal, gradient)
    }
}
