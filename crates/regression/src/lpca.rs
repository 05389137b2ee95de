use crate::prediction::kernel_weights;
use crate::principal::Principal;
use crate::{Examples, Parameters, Prediction, Predictor, Query};

/// What [`LocalPca`] depends on besides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LpcaParameters {
    /// share of the variance of the neighbours' successors that the principal components keep
    pub variance: f64,
    /// standard deviation of the pose about where the last two poses lead, feature units
    pub smooth_sigma: f64,
}

impl Default for LpcaParameters {
    fn default() -> Self {
        Self { variance: 1.0, smooth_sigma: 6.0 }
    }
}

/// Local principal components (Chai & Hodgins 2005; docs/papers.md#local-principal-components): the pose lies near
/// the space of the leading principal components of the neighbours' successors, and keeps its velocity.
///
/// ```text
/// q = q̄ + B b + ε,    E(q) = bᵀΛ⁻¹b + ‖ε‖²/σ² + ‖q − 2 q_{t−1} + q_{t−2}‖²/τ²
/// ```
///
/// Both terms are Gaussian, and so is their product. The smoothness is isotropic, so the principal directions remain
/// those of the product: along b_i the precision is `1/(λ_i + σ²) + 1/τ²`, across all of them `1/σ² + 1/τ²`.
pub struct LocalPca {
    parameters: LpcaParameters,
    principal: Principal,
    /// weighted and centred successors, `[K, dofs]`
    targets: Vec<f64>,
    /// where the last poses lead, less the mean, `[dofs]`
    onwards: Vec<f64>,
}

impl LocalPca {
    /// Memory for `neighbours` examples of `dofs` targets.
    pub fn new(neighbours: usize, dofs: usize, parameters: LpcaParameters) -> Self {
        Self {
            parameters,
            principal: Principal::new(neighbours, dofs),
            targets: vec![0.0; neighbours * dofs],
            onwards: vec![0.0; dofs],
        }
    }
}

impl Predictor for LocalPca {
    fn predict(
        &mut self,
        examples: &Examples<'_>,
        query: &Query<'_>,
        parameters: &Parameters,
        out: &mut Prediction,
    ) {
        let (count, dofs) = (examples.len(), examples.dofs);
        if count == 0 {
            return;
        }
        kernel_weights(examples.distances_squared, parameters.bandwidth, &mut out.weights);
        out.mean.fill(0.0);
        for (k, &w) in out.weights[..count].iter().enumerate() {
            add_scaled(&mut out.mean, w, examples.target(k));
        }
        for (k, &w) in out.weights[..count].iter().enumerate() {
            let row = &mut self.targets[k * dofs..(k + 1) * dofs];
            for ((t, y), m) in row.iter_mut().zip(examples.target(k)).zip(&out.mean) {
                *t = w.sqrt() * (y - m);
            }
        }
        self.principal.decompose(&self.targets[..count * dofs], count, dofs);

        // Smoothness needs two poses; without them its precision is 0.
        let mut smoothness = self.parameters.smooth_sigma.powi(-2);
        match (query.pose(1, dofs), query.pose(2, dofs)) {
            (Some(newest), Some(older)) => {
                for (d, onwards) in self.onwards.iter_mut().enumerate() {
                    *onwards = 2.0 * newest[d] - older[d] - out.mean[d];
                }
            }
            _ => {
                self.onwards.fill(0.0);
                smoothness = 0.0;
            }
        }
        // Across: towards the mean with 1/σ², onwards with 1/τ². Along each component: less towards the mean.
        let noise = parameters.min_sigma.powi(2);
        let across = 1.0 / (1.0 / noise + smoothness);
        add_scaled(&mut out.mean, across * smoothness, &self.onwards);
        let total: f64 = self.principal.variances.iter().sum();
        let mut kept = 0.0;
        out.rows = 0;
        for i in 0..self.principal.len() {
            if kept >= self.parameters.variance * total {
                break;
            }
            let (variance, _, direction) = self.principal.component(i, count, dofs);
            kept += variance;
            let along = 1.0 / (1.0 / (variance + noise) + smoothness);
            let onwards: f64 = direction.iter().zip(&self.onwards).map(|(b, o)| b * o).sum();
            add_scaled(&mut out.mean, (along - across) * smoothness * onwards, direction);
            let row = &mut out.residuals[i * dofs..(i + 1) * dofs];
            let root = (along - across).max(0.0).sqrt();
            row.iter_mut().zip(direction).for_each(|(r, b)| *r = root * b);
            out.rows += 1;
        }
        out.sigma.fill(across.sqrt());
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    sum.iter_mut().zip(row).for_each(|(s, v)| *s += factor * v);
}
