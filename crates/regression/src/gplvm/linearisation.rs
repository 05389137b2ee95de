use crate::Prediction;
use crate::gplvm::model::{At, Gplvm, dot};

/// The terms of the energy that hang on pose and latent point, besides the latent point itself.
#[derive(Debug, Clone, Copy)]
pub struct Terms<'a> {
    /// the pose before, shape `[dofs]`; without it, velocities are not compared
    pub before: Option<&'a [f64]>,
    /// where the pose would go if it kept its velocity, shape `[dofs]`
    pub onwards: Option<&'a [f64]>,
    /// precision of `onwards`
    pub smoothness: f64,
    /// variance that is added to each feature's
    pub floor: f64,
}

/// The energy's expansion to second order in pose q and latent point ξ = x − x₀,
///
/// ```text
/// E(q, ξ) ≈ qᵀVq⁻¹q + 2 qᵀCξ + ξᵀHξ − 2 hqᵀq − 2 hxᵀξ,      Vq diagonal
/// ```
///
/// with the model's mean linearised, its variance's slope taken at the residuals of a given pose, and `κ‖ξ‖²` added
/// where a step has to be short.
#[derive(Debug, Clone)]
pub struct Linearisation {
    dofs: usize,
    dims: usize,
    /// Vq, shape `[dofs]`
    spread: Vec<f64>,
    /// hq, shape `[dofs]`
    pull: Vec<f64>,
    /// C, shape `[dims, dofs]`
    coupling: Vec<f64>,
    /// H, shape `[dims, dims]`
    curvature: Vec<f64>,
    /// hx, shape `[dims]`
    latent_pull: Vec<f64>,
    /// a factor and a right-hand side, shape `[dims, dims]` and `[dims]`
    factor: Vec<f64>,
    solved: Vec<f64>,
}

impl Linearisation {
    pub fn new(dofs: usize, dims: usize) -> Self {
        Self {
            dofs,
            dims,
            spread: vec![0.0; dofs],
            pull: vec![0.0; dofs],
            coupling: vec![0.0; dims * dofs],
            curvature: vec![0.0; dims * dims],
            latent_pull: vec![0.0; dims],
            factor: vec![0.0; dims * dims],
            solved: vec![0.0; dims],
        }
    }

    /// Expands about the latent point of `at`; `pose` is where the variance's slope is taken.
    pub fn set(&mut self, model: &Gplvm, at: &At, pose: &[f64], terms: &Terms<'_>, damping: f64) {
        let (dofs, dims, width) = (self.dofs, self.dims, 2 * self.dofs);
        self.spread.fill(0.0);
        self.pull.fill(0.0);
        self.coupling.fill(0.0);
        self.curvature.fill(0.0);
        // ½‖x‖² of Grochow et al. is ‖x₀ + ξ‖² in an energy that is twice minus the log.
        for d in 0..dims {
            self.curvature[d * dims + d] = 1.0 + damping;
            self.latent_pull[d] = -at.latent[d];
        }
        for k in 0..width {
            let Some((scale, offset)) = feature(model, k, terms) else { continue };
            let q = k % dofs;
            let precision = 1.0 / (at.variance * scale + terms.floor);
            let target = at.mean[k] + offset;
            let residual = pose[q] - target;
            let by_variance = 0.5 * precision * scale * (1.0 - precision * residual * residual);
            self.spread[q] += precision;
            self.pull[q] += precision * target;
            for d in 0..dims {
                let slope = at.slopes[d * width + k];
                self.coupling[d * dofs + q] -= precision * slope;
                self.latent_pull[d] -= precision * slope * target + by_variance * at.variance_slopes[d];
                for e in 0..=d {
                    self.curvature[d * dims + e] += precision * slope * at.slopes[e * width + k];
                }
            }
        }
        if let Some(onwards) = terms.onwards {
            let numbers = self.spread.iter_mut().zip(&mut self.pull).zip(onwards);
            for ((spread, pull), onwards) in numbers {
                *spread += terms.smoothness;
                *pull += terms.smoothness * onwards;
            }
        }
        self.spread.iter_mut().for_each(|v| *v = 1.0 / *v);
    }

    /// The Gaussian over the pose that is left when ξ is integrated out.
    pub fn marginal(&mut self, out: &mut Prediction) {
        let (dofs, dims) = (self.dofs, self.dims);
        for d in 0..dims {
            let row = &self.coupling[d * dofs..(d + 1) * dofs];
            self.solved[d] = self.latent_pull[d]
                - row.iter().zip(&self.spread).zip(&self.pull).map(|((c, v), h)| c * v * h).sum::<f64>();
            for e in 0..=d {
                let other = &self.coupling[e * dofs..(e + 1) * dofs];
                let through: f64 = row.iter().zip(&self.spread).zip(other).map(|((a, v), b)| a * v * b).sum();
                self.factor[d * dims + e] = self.curvature[d * dims + e] - through;
            }
        }
        cholesky(&mut self.factor, dims);
        // E = L⁻¹ C Vq: forward substitution row by row.
        for d in 0..dims {
            let (done, rest) = out.residuals.split_at_mut(d * dofs);
            let row = &mut rest[..dofs];
            for ((r, c), v) in row.iter_mut().zip(&self.coupling[d * dofs..]).zip(&self.spread) {
                *r = c * v;
            }
            for (e, before) in done.chunks_exact(dofs).enumerate() {
                let factor = self.factor[d * dims + e];
                row.iter_mut().zip(before).for_each(|(r, b)| *r -= factor * b);
            }
            row.iter_mut().for_each(|r| *r /= self.factor[d * dims + d]);
        }
        out.rows = dims;
        solve(&self.factor, &mut self.solved);
        for q in 0..dofs {
            let pulled: f64 = (0..dims).map(|d| self.coupling[d * dofs + q] * self.solved[d]).sum();
            out.mean[q] = self.spread[q] * (self.pull[q] - pulled);
            out.sigma[q] = self.spread[q].sqrt();
        }
    }

    /// The most probable ξ given the pose, shape `[dims]`.
    pub fn latent_given(&mut self, pose: &[f64]) -> &[f64] {
        for d in 0..self.dims {
            let row = &self.coupling[d * self.dofs..(d + 1) * self.dofs];
            self.solved[d] = self.latent_pull[d] - dot(row, pose);
        }
        self.factor.copy_from_slice(&self.curvature);
        cholesky(&mut self.factor, self.dims);
        solve(&self.factor, &mut self.solved);
        &self.solved
    }
}

/// The energy of a pose and the latent point of `at`: twice minus the log of their probability, up to a constant.
pub fn energy(model: &Gplvm, at: &At, pose: &[f64], terms: &Terms<'_>) -> f64 {
    let dofs = pose.len();
    let mut energy: f64 = at.latent.iter().map(|v| v * v).sum();
    for k in 0..2 * dofs {
        let Some((scale, offset)) = feature(model, k, terms) else { continue };
        let variance = at.variance * scale + terms.floor;
        energy += (pose[k % dofs] - at.mean[k] - offset).powi(2) / variance + variance.ln();
    }
    if let Some(onwards) = terms.onwards {
        energy += terms.smoothness * pose.iter().zip(onwards).map(|(q, o)| (q - o) * (q - o)).sum::<f64>();
    }
    energy
}

/// `w_k⁻²` of a feature, and what it has to be shifted by to compare with the pose; `None` if it takes no part.
fn feature(model: &Gplvm, k: usize, terms: &Terms<'_>) -> Option<(f64, f64)> {
    let scale = model.stored.variances[k];
    let dofs = model.dofs();
    if k < dofs {
        return Some((scale, 0.0));
    }
    let before = terms.before?;
    (scale > 0.0).then(|| (scale, before[k - dofs]))
}

/// Cholesky factor in place; the latent space's own prior keeps pivots above 0, rounding excepted.
fn cholesky(a: &mut [f64], n: usize) {
    for j in 0..n {
        for i in j..n {
            let product: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            let rest = a[i * n + j] - product;
            a[i * n + j] = if i == j { rest.max(1e-9).sqrt() } else { rest / a[j * n + j] };
        }
    }
}

/// `b ← (LLᵀ)⁻¹ b`.
fn solve(factor: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        let sum: f64 = (0..i).map(|j| factor[i * n + j] * b[j]).sum();
        b[i] = (b[i] - sum) / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|j| factor[j * n + i] * b[j]).sum();
        b[i] = (b[i] - sum) / factor[i * n + i];
    }
}
