use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as matmul_triangular};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef, Par};

use crate::prediction::kernel_weights;
use crate::{Examples, Parameters, Prediction, Predictor, Query};

/// Local regression in its dual form (LR eq. 4–10 with the mends of method §2).
///
/// One factorisation of the K×K Gram matrix serves all D targets (mend 5). As LR prints it, the projected
/// regression of eq. 5–9 has rank one and collapses to weighted least squares, which needs a ridge because K is
/// smaller than the window (mend 4); so that is what is computed: with centred inputs `X̃ = √ω (x − x̄)` and
/// targets `Ỹ = √ω (y − ȳ)`,
///
/// ```text
/// G = X̃ X̃ᵀ + λ I,   ŷ = ȳ + (x_q − x̄)ᵀ X̃ᵀ G⁻¹ Ỹ,   e_k = (G⁻¹ Ỹ)_k / (G⁻¹)_kk
/// ```
///
/// where `e_k` is the leave-one-out residual of example k times √ω_k (mend 6).
#[derive(Debug, Clone)]
pub struct LocalRegression {
    /// X̃, `[K, width]`
    inputs: Vec<f64>,
    /// Ỹ, then L⁻¹ Ỹ, `[K, dofs]`
    targets: Vec<f64>,
    /// L⁻¹ Ỹ, `[K, dofs]`
    solved: Vec<f64>,
    /// G, then its Cholesky factor L, `[K, K]`
    gram: Vec<f64>,
    /// L⁻¹, `[K, K]`
    inverse: Vec<f64>,
    mean_input: Vec<f64>,
    /// X̃ (x_q − x̄), then L⁻¹ of it, `[K]`
    kernel: Vec<f64>,
}

impl LocalRegression {
    /// Memory for `neighbours` examples of `width` inputs and `dofs` targets.
    pub fn new(neighbours: usize, width: usize, dofs: usize) -> Self {
        Self {
            inputs: vec![0.0; neighbours * width],
            targets: vec![0.0; neighbours * dofs],
            solved: vec![0.0; neighbours * dofs],
            gram: vec![0.0; neighbours * neighbours],
            inverse: vec![0.0; neighbours * neighbours],
            mean_input: vec![0.0; width],
            kernel: vec![0.0; neighbours],
        }
    }

    /// Centres with the weighted means and multiplies each example by the root of its weight.
    fn centre(&mut self, examples: &Examples<'_>, query: &[f64], out: &mut Prediction) {
        let (width, dofs) = (examples.width, examples.dofs);
        self.mean_input.fill(0.0);
        out.mean.fill(0.0);
        for (k, &w) in out.weights[..examples.len()].iter().enumerate() {
            add_scaled(&mut self.mean_input, w, &examples.inputs[k * width..][..width]);
            add_scaled(&mut out.mean, w, examples.target(k));
        }
        for (k, &w) in out.weights[..examples.len()].iter().enumerate() {
            let root = w.sqrt();
            let input = &mut self.inputs[k * width..][..width];
            let example = &examples.inputs[k * width..][..width];
            let mut product = 0.0;
            for i in 0..width {
                input[i] = root * (example[i] - self.mean_input[i]);
                product += input[i] * (query[i] - self.mean_input[i]);
            }
            self.kernel[k] = product;
            let target = &mut self.targets[k * dofs..][..dofs];
            for ((t, y), m) in target.iter_mut().zip(examples.target(k)).zip(&out.mean) {
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
        out.rows = examples.len();
        out.sigma.fill(parameters.min_sigma);
        kernel_weights(examples.distances_squared, parameters.bandwidth, &mut out.weights);
        self.centre(examples, query.inputs, out);
        let nearest = examples.distances_squared.iter().copied().fold(f64::INFINITY, f64::min);
        let ridge = parameters.ridge + parameters.ridge_distance * nearest / width as f64;

        let inputs = MatRef::from_row_major_slice(&self.inputs[..k * width], k, width);
        let mut gram = MatMut::from_row_major_slice_mut(&mut self.gram[..k * k], k, k);
        matmul_triangular(
            gram.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Replace,
            inputs,
            BlockStructure::Rectangular,
            inputs.transpose(),
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
        for i in 0..k {
            gram[(i, i)] += ridge;
        }
        cholesky(&mut self.gram[..k * k], k);
        let lower = MatRef::from_row_major_slice(&self.gram[..k * k], k, k);
        let mut inverse = MatMut::from_row_major_slice_mut(&mut self.inverse[..k * k], k, k);
        inverse.fill(0.0);
        invert_lower_triangular(inverse.as_mut(), lower, Par::Seq);

        // L⁻¹ Ỹ and L⁻¹ k: the prediction is their product; L⁻ᵀ L⁻¹ Ỹ gives the residuals.
        let targets = MatRef::from_row_major_slice(&self.targets[..k * dofs], k, dofs);
        let mut solved = MatMut::from_row_major_slice_mut(&mut self.solved[..k * dofs], k, dofs);
        solved.copy_from(targets);
        solve_lower_triangular_in_place(lower, solved.as_mut(), Par::Seq);
        let kernel = MatMut::from_column_major_slice_mut(&mut self.kernel[..k], k, 1);
        solve_lower_triangular_in_place(lower, kernel, Par::Seq);
        for (row, weight) in self.solved.chunks_exact(dofs).zip(&self.kernel[..k]) {
            add_scaled(&mut out.mean, *weight, row);
        }
        let inverse = MatRef::from_row_major_slice(&self.inverse[..k * k], k, k);
        let mut residuals = MatMut::from_row_major_slice_mut(&mut out.residuals[..k * dofs], k, dofs);
        let solved = MatRef::from_row_major_slice(&self.solved[..k * dofs], k, dofs);
        matmul(residuals.as_mut(), Accum::Replace, inverse.transpose(), solved, 1.0, Par::Seq);
        for i in 0..k {
            // (G⁻¹)_ii is the squared length of column i of L⁻¹.
            let diagonal: f64 = (i..k).map(|j| self.inverse[j * k + i].powi(2)).sum();
            out.residuals[i * dofs..(i + 1) * dofs].iter_mut().for_each(|r| *r /= diagonal);
        }
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    for (s, v) in sum.iter_mut().zip(row) {
        *s += factor * v;
    }
}

/// Cholesky factor of a positive definite matrix in place, lower triangle, row-major. The ridge keeps every pivot
/// positive; a pivot lost to rounding is held at a tiny positive number.
fn cholesky(a: &mut [f64], n: usize) {
    for j in 0..n {
        let (above, below) = a.split_at_mut((j + 1) * n);
        let row_j = &mut above[j * n..];
        let square: f64 = row_j[..j].iter().map(|v| v * v).sum();
        let pivot = (row_j[j] - square).max(1e-12).sqrt();
        row_j[j] = pivot;
        for row_i in below.chunks_exact_mut(n) {
            row_i[j] = (row_i[j] - dot(&row_i[..j], &row_j[..j])) / pivot;
        }
    }
}

/// Inner product in four lanes; the order of the sum is fixed.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    for (x, y) in a4.iter().zip(b4) {
        for i in 0..4 {
            lanes[i] += x[i] * y[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
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
        LocalRegression::new(k, width, dofs).predict(
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
        let mut regression = LocalRegression::new(k, width, 1);
        regression.predict(
            &examples,
            &Query { inputs: &x[..width], recent: &[] },
            &parameters,
            &mut prediction,
        );
        for (left_out, weight) in prediction.weights.iter().enumerate() {
            let keep: Vec<usize> = (0..k).filter(|&r| r != left_out).collect();
            let centred = |r: usize, i: usize| regression.inputs[r * width + i];
            let normal = Mat::<f64>::from_fn(width, width, |i, j| {
                let sum: f64 = keep.iter().map(|&r| centred(r, i) * centred(r, j)).sum();
                sum + if i == j { 0.1 } else { 0.0 }
            });
            let right = Mat::<f64>::from_fn(width, 1, |i, _| {
                keep.iter().map(|&r| centred(r, i) * regression.targets[r]).sum()
            });
            let a = normal.partial_piv_lu().solve(&right);
            let fitted: f64 = (0..width).map(|i| a[(i, 0)] * centred(left_out, i)).sum();
            let expected = regression.targets[left_out] - fitted;
            assert!((prediction.residuals[left_out] - expected).abs() < 1e-9, "{left_out} {weight}");
        }
    }
}
