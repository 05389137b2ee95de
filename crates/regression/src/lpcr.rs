use crate::prediction::kernel_weights;
use crate::principal::Principal;
use crate::{Examples, Parameters, Prediction, Predictor, Query};

/// An example that is fitted more closely than this by its own weight is taken to be fitted so.
const LEAST_FREEDOM: f64 = 0.05;

/// What [`PrincipalRegression`] depends on besides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LpcrParameters {
    /// most principal components; besides, never more than half the examples, which leaves the residuals their
    /// meaning
    pub components: usize,
}

impl Default for LpcrParameters {
    fn default() -> Self {
        Self { components: 4 }
    }
}

/// Local principal component regression (Liu et al. 2011, 2014; docs/papers.md#principal-component-regression): the
/// neighbours' inputs are replaced by their scores on the leading principal components, and every target is regressed
/// on those by weighted least squares.
///
/// ```text
/// √ω (x − x̄) = Σ_i √λ_i u_i b_iᵀ,    ŷ = ȳ + Σ_{i ≤ n} b_iᵀ(x_q − x̄) λ_i^−½ Ỹᵀu_i,
/// e_k = (Ỹ − Σ_{i ≤ n} u_i u_iᵀ Ỹ)_k / (1 − ω_k − Σ_{i ≤ n} u_ik²)
/// ```
///
/// where `Ỹ = √ω (y − ȳ)` and `e_k` is the residual of example k if it is left out (its principal components kept). The
/// number n is, at each frame, the one whose residuals are least.
pub struct PrincipalRegression {
    parameters: LpcrParameters,
    principal: Principal,
    inputs: Vec<f64>,
    mean_input: Vec<f64>,
    /// Ỹ, less what the components explain, `[K, dofs]`
    targets: Vec<f64>,
    /// Ỹᵀu_i, `[components, dofs]`
    loadings: Vec<f64>,
    /// 1 − ω_k − Σ u_ik², `[K]`
    freedom: Vec<f64>,
}

impl PrincipalRegression {
    /// Memory for `neighbours` examples of `width` inputs and `dofs` targets.
    pub fn new(neighbours: usize, width: usize, dofs: usize, parameters: LpcrParameters) -> Self {
        Self {
            parameters,
            principal: Principal::new(neighbours, width),
            inputs: vec![0.0; neighbours * width],
            mean_input: vec![0.0; width],
            targets: vec![0.0; neighbours * dofs],
            loadings: vec![0.0; neighbours.min(width) * dofs],
            freedom: vec![0.0; neighbours],
        }
    }

    /// Sum of squares of the leave-one-out residuals.
    fn left_out(&self, count: usize, dofs: usize) -> f64 {
        let rows = self.targets[..count * dofs].chunks_exact(dofs).zip(&self.freedom);
        rows.map(|(row, freedom)| row.iter().map(|r| r * r).sum::<f64>() / (freedom * freedom)).sum()
    }

    /// Takes what component `i` explains out of the targets, and counts it in the leverages.
    fn explain(&mut self, i: usize, count: usize, width: usize, dofs: usize) {
        let (_, u, _) = self.principal.component(i, count, width);
        let loading = &mut self.loadings[i * dofs..(i + 1) * dofs];
        loading.fill(0.0);
        for (u, row) in u.iter().zip(self.targets.chunks_exact(dofs)) {
            add_scaled(loading, *u, row);
        }
        for ((u, row), freedom) in u.iter().zip(self.targets.chunks_exact_mut(dofs)).zip(&mut self.freedom) {
            add_scaled(row, -u, loading);
            *freedom = (*freedom - u * u).max(LEAST_FREEDOM);
        }
    }

    /// How many components to take.
    fn count_components(&mut self, count: usize, width: usize, dofs: usize) -> usize {
        let (mut best, mut least) = (0, self.left_out(count, dofs));
        for i in 0..self.principal.len().min(self.parameters.components).min(count / 2) {
            self.explain(i, count, width, dofs);
            let now = self.left_out(count, dofs);
            if now < least {
                (best, least) = (i + 1, now);
            }
        }
        best
    }

    /// Weighted and centred targets, and leverages of the mean alone.
    fn reset(&mut self, examples: &Examples<'_>, out: &Prediction) {
        let dofs = examples.dofs;
        for (k, &w) in out.weights[..examples.len()].iter().enumerate() {
            let (root, target) = (w.sqrt(), &mut self.targets[k * dofs..(k + 1) * dofs]);
            for ((t, y), m) in target.iter_mut().zip(examples.target(k)).zip(&out.mean) {
                *t = root * (y - m);
            }
            self.freedom[k] = (1.0 - w).max(LEAST_FREEDOM);
        }
    }
}

impl Predictor for PrincipalRegression {
    fn predict(
        &mut self,
        examples: &Examples<'_>,
        query: &Query<'_>,
        parameters: &Parameters,
        out: &mut Prediction,
    ) {
        let (count, width, dofs) = (examples.len(), examples.width, examples.dofs);
        if count == 0 {
            return;
        }
        kernel_weights(examples.distances_squared, parameters.bandwidth, &mut out.weights);
        out.mean.fill(0.0);
        self.mean_input.fill(0.0);
        for (k, &w) in out.weights[..count].iter().enumerate() {
            add_scaled(&mut self.mean_input, w, &examples.inputs[k * width..(k + 1) * width]);
            add_scaled(&mut out.mean, w, examples.target(k));
        }
        for (k, &w) in out.weights[..count].iter().enumerate() {
            let input = &mut self.inputs[k * width..(k + 1) * width];
            for ((i, x), m) in input.iter_mut().zip(&examples.inputs[k * width..]).zip(&self.mean_input) {
                *i = w.sqrt() * (x - m);
            }
        }
        self.principal.decompose(&self.inputs[..count * width], count, width);
        self.reset(examples, out);
        let components = self.count_components(count, width, dofs);
        self.reset(examples, out);
        for i in 0..components {
            self.explain(i, count, width, dofs);
            let (variance, _, b) = self.principal.component(i, count, width);
            let along: f64 =
                b.iter().zip(query.inputs).zip(&self.mean_input).map(|((b, x), m)| b * (x - m)).sum();
            add_scaled(&mut out.mean, along / variance.sqrt(), &self.loadings[i * dofs..(i + 1) * dofs]);
        }
        out.rows = count;
        out.sigma.fill(parameters.min_sigma);
        for (k, freedom) in self.freedom[..count].iter().enumerate() {
            let residuals = &mut out.residuals[k * dofs..(k + 1) * dofs];
            residuals.iter_mut().zip(&self.targets[k * dofs..]).for_each(|(r, t)| *r = t / freedom);
        }
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    sum.iter_mut().zip(row).for_each(|(s, v)| *s += factor * v);
}
