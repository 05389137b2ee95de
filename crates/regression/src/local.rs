use dense::{PAD, ROWS, padded};

use crate::prediction::kernel_weights;
use crate::{Examples, Parameters, Prediction, Predictor, Query};

/// Least square of a pivot: one lost to rounding is held there.
const LEAST_PIVOT: f64 = 1e-12;

/// Local regression in its dual form (docs/papers.md#local-regression, eq. 4–10, changed as said there).
///
/// One factorisation of the K×K Gram matrix serves all D targets (docs/papers.md#dual-form). The projected
/// regression (docs/papers.md#ridge, eq. 5–9) has rank one and collapses to weighted least squares, which
/// needs a ridge because K is smaller than the window; so that is what is computed: with centred inputs
/// `X̃ = √ω (x − x̄)` and targets `Ỹ = √ω (y − ȳ)`,
///
/// ```text
/// G = X̃ X̃ᵀ + λ I,   ŷ = ȳ + (x_q − x̄)ᵀ X̃ᵀ G⁻¹ Ỹ,   e_k = (G⁻¹ Ỹ)_k / (G⁻¹)_kk
/// ```
///
/// where `e_k` is the leave-one-out residual of example k times √ω_k (docs/papers.md#residual-covariance). X̃ itself
/// is never made: G follows from the inner products of the x as they are. With `UᵀU = G`, one elimination of `[G | Ỹ
/// | X̃ (x_q − x̄) | I]` leaves `[U | U⁻ᵀỸ | U⁻ᵀX̃ (x_q − x̄) | U⁻ᵀ]`, of which prediction and residuals are
/// products.
#[derive(Debug, Clone)]
pub struct LocalRegression {
    /// `[G | Ỹ | X̃ (x_q − x̄) | I]`, row-major
    system: Vec<f64>,
    /// X x̄, then the diagonal of G⁻¹, `[K]`
    products: Vec<f64>,
    /// X x_q, then U⁻ᵀX̃ (x_q − x̄), `[K]`
    kernel: Vec<f64>,
    /// √ω, `[K]`
    roots: Vec<f64>,
}

/// Where the parts of the system are, for K examples of D targets.
#[derive(Debug, Clone, Copy)]
struct Layout {
    rows: usize,
    targets: usize,
    kernel: usize,
    identity: usize,
    stride: usize,
}

impl Layout {
    fn new(k: usize, dofs: usize) -> Self {
        let targets = padded(k, PAD);
        let identity = targets + padded(dofs + 1, PAD);
        let stride = dense::stride(identity + padded(k, PAD));
        Self { rows: padded(k, ROWS), targets, kernel: targets + dofs, identity, stride }
    }
}

impl LocalRegression {
    /// Memory for `neighbours` examples of `dofs` targets; the number of inputs may be any.
    pub fn new(neighbours: usize, dofs: usize) -> Self {
        let layout = Layout::new(neighbours, dofs);
        Self {
            system: vec![0.0; layout.rows * layout.stride],
            products: vec![0.0; neighbours],
            kernel: vec![0.0; neighbours],
            roots: vec![0.0; neighbours],
        }
    }

    /// Fills the system, and puts ȳ into `out.mean`. The weights in `out` are those of the examples.
    fn fill(&mut self, at: Layout, examples: &Examples<'_>, query: &[f64], ridge: f64, out: &mut Prediction) {
        let (k, width, dofs) = (examples.len(), examples.width, examples.dofs);
        let weights = &out.weights[..k];
        let system = &mut self.system[..at.rows * at.stride];
        system.fill(0.0);
        dense::gram(examples.inputs, k, width, system, at.stride);
        dense::products(examples.inputs, query, &mut self.kernel[..k]);
        // Inner products with the weighted mean, of the examples, of the query and of itself.
        let products = &mut self.products[..k];
        products.fill(0.0);
        for (i, row) in system.chunks_exact(at.stride).take(k).enumerate() {
            let mut sum = weights[i] * row[i];
            for j in i + 1..k {
                sum += weights[j] * row[j];
                products[j] += weights[i] * row[j];
            }
            products[i] += sum;
        }
        let mean_product: f64 = products.iter().zip(weights).map(|(p, w)| p * w).sum();
        let query_product: f64 = self.kernel[..k].iter().zip(weights).map(|(p, w)| p * w).sum();
        out.mean.fill(0.0);
        dense::weighted_sum(examples.targets, dofs, weights, &mut out.mean);
        for (root, w) in self.roots.iter_mut().zip(weights) {
            *root = w.sqrt();
        }
        for (i, row) in system.chunks_exact_mut(at.stride).enumerate() {
            row[at.identity + i] = 1.0;
            if i >= k {
                row[i] = 1.0;
                continue;
            }
            let root = self.roots[i];
            let here = mean_product - products[i];
            for ((g, p), other) in row[i..k].iter_mut().zip(&products[i..]).zip(&self.roots[i..]) {
                *g = root * other * (*g - p + here);
            }
            row[i] += ridge;
            row[at.kernel] = root * (self.kernel[i] - query_product + here);
            for ((t, y), m) in row[at.targets..].iter_mut().zip(examples.target(i)).zip(&out.mean) {
                *t = root * (y - m);
            }
        }
    }
}

impl Predictor for LocalRegression {
    fn predict(
        &mut self,
        examples: &Examples<'_>,
        query: &Query<'_>,
        parameters: &Parameters,
        out: &mut Prediction,
    ) {
        let (k, width, dofs) = (examples.len(), examples.width, examples.dofs);
        if k == 0 {
            return;
        }
        out.rows = k;
        out.sigma.fill(parameters.min_sigma);
        kernel_weights(examples.distances_squared, parameters.bandwidth, &mut out.weights);
        // What lies at infinity (a control point from a broken file) is far, but a number.
        let nearest = examples.distances_squared.iter().copied().fold(1e100, f64::min);
        let ridge = parameters.ridge + parameters.ridge_distance * nearest / width as f64;
        let at = Layout::new(k, dofs);
        self.fill(at, examples, query.inputs, ridge, out);

        let system = &mut self.system[..at.rows * at.stride];
        dense::eliminate(system, at.rows, at.stride, Some(at.identity), LEAST_PIVOT);
        let kernel = &mut self.kernel[..k];
        let diagonal = &mut self.products[..k];
        diagonal.fill(0.0);
        for (row, kernel) in system.chunks_exact(at.stride).zip(kernel.iter_mut()) {
            *kernel = row[at.kernel];
            // (G⁻¹)_ii is the squared length of column i of U⁻ᵀ.
            for (sum, v) in diagonal.iter_mut().zip(&row[at.identity..]) {
                *sum += v * v;
            }
        }
        dense::weighted_sum(&system[at.targets..], at.stride, kernel, &mut out.mean);
        let residuals = &mut out.residuals[..k * dofs];
        let parts = [at.identity, at.targets];
        dense::transposed_product(system, k, at.stride, parts, dofs, residuals);
        for (row, diagonal) in residuals.chunks_exact_mut(dofs).zip(diagonal) {
            let scale = 1.0 / *diagonal;
            row.iter_mut().for_each(|r| *r *= scale);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;
    use faer::prelude::Solve;

    /// Deterministic numbers in [-1, 1].
    fn numbers(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    /// Weighted ridge regression in its primal form, straight from the definition.
    fn primal(x: &[f64], y: &[f64], w: &[f64], query: &[f64], ridge: f64) -> f64 {
        let (k, width) = (w.len(), query.len());
        let total: f64 = w.iter().sum();
        let mean_x: Vec<f64> =
            (0..width).map(|i| (0..k).map(|r| w[r] * x[r * width + i]).sum::<f64>() / total).collect();
        let mean_y = (0..k).map(|r| w[r] * y[r]).sum::<f64>() / total;
        let normal = Mat::<f64>::from_fn(width, width, |i, j| {
            let sum: f64 =
                (0..k).map(|r| w[r] * (x[r * width + i] - mean_x[i]) * (x[r * width + j] - mean_x[j])).sum();
            sum + if i == j { ridge } else { 0.0 }
        });
        let right = Mat::<f64>::from_fn(width, 1, |i, _| {
            (0..k).map(|r| w[r] * (x[r * width + i] - mean_x[i]) * (y[r] - mean_y)).sum()
        });
        let a = normal.partial_piv_lu().solve(&right);
        mean_y + (0..width).map(|i| a[(i, 0)] * (query[i] - mean_x[i])).sum::<f64>()
    }

    #[test]
    fn the_dual_form_agrees_with_the_primal_form() {
        let (k, width, dofs) = (20, 30, 3);
        let x = numbers(k * width, 1);
        let y = numbers(k * dofs, 2);
        let query = numbers(width, 3);
        let distances: Vec<f64> = (0..k).map(|r| 1.0 + 0.1 * r as f64).collect();
        let examples = Examples { width, dofs, inputs: &x, targets: &y, distances_squared: &distances };
        let parameters = Parameters { ridge: 0.05, ridge_distance: 0.0, ..Parameters::default() };
        let mut prediction = Prediction::new(k, dofs);
        LocalRegression::new(k, dofs).predict(
            &examples,
            &Query { inputs: &query, recent: &[] },
            &parameters,
            &mut prediction,
        );
        for d in 0..dofs {
            let target: Vec<f64> = (0..k).map(|r| y[r * dofs + d]).collect();
            let expected = primal(&x, &target, &prediction.weights, &query, 0.05);
            assert!((prediction.mean[d] - expected).abs() < 1e-9, "dof {d}");
        }
    }

    /// The closed form keeps the weighted means of all examples; so does this refit without example k.
    #[test]
    fn residuals_are_those_of_fits_that_leave_the_example_out() {
        let (k, width) = (12, 5);
        let x = numbers(k * width, 4);
        let y = numbers(k, 5);
        let distances: Vec<f64> = (0..k).map(|r| 1.0 + 0.2 * r as f64).collect();
        let examples = Examples { width, dofs: 1, inputs: &x, targets: &y, distances_squared: &distances };
        let parameters = Parameters { ridge: 0.1, ridge_distance: 0.0, ..Parameters::default() };
        let mut prediction = Prediction::new(k, 1);
        let mut regression = LocalRegression::new(k, 1);
        regression.predict(
            &examples,
            &Query { inputs: &x[..width], recent: &[] },
            &parameters,
            &mut prediction,
        );
        let w = &prediction.weights;
        let roots: Vec<f64> = w.iter().map(|w| w.sqrt()).collect();
        let mean_y: f64 = (0..k).map(|r| w[r] * y[r]).sum();
        let mean_x: Vec<f64> = (0..width).map(|i| (0..k).map(|r| w[r] * x[r * width + i]).sum()).collect();
        for (left_out, weight) in prediction.weights.iter().enumerate() {
            let keep: Vec<usize> = (0..k).filter(|&r| r != left_out).collect();
            let centred = |r: usize, i: usize| roots[r] * (x[r * width + i] - mean_x[i]);
            let target = |r: usize| roots[r] * (y[r] - mean_y);
            let normal = Mat::<f64>::from_fn(width, width, |i, j| {
                let sum: f64 = keep.iter().map(|&r| centred(r, i) * centred(r, j)).sum();
                sum + if i == j { 0.1 } else { 0.0 }
            });
            let right =
                Mat::<f64>::from_fn(width, 1, |i, _| keep.iter().map(|&r| centred(r, i) * target(r)).sum());
            let a = normal.partial_piv_lu().solve(&right);
            let fitted: f64 = (0..width).map(|i| a[(i, 0)] * centred(left_out, i)).sum();
            let expected = target(left_out) - fitted;
            assert!((prediction.residuals[left_out] - expected).abs() < 1e-9, "{left_out} {weight}");
        }
    }
}
