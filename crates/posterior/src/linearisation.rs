use dense::{PAD, ROWS, padded};

use crate::GaussianPrior;

/// Rows of a block: one vector in space.
pub const BLOCK: usize = 3;

/// The residuals to first order about some coordinates, and what the prior makes of it: all that steps of any damping
/// from there have in common.
///
/// Residuals come in blocks of three rows that are moved by the same coordinates; most of J is zero. A residual of fewer
/// rows leaves the others of its block zero, with variance 1: they then add nothing to energy and determinant.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// J, `[rows, dofs]`
    jacobian: Vec<f64>,
    /// JΣ, `[rows, dofs]`
    spread: Vec<f64>,
    /// lower triangle of JΣJᵀ, `[rows, rows]`
    products: Vec<f64>,
    /// how many rows there are, of the room for them
    rows: usize,
    dofs: usize,
    /// `[W⁻¹ + share · JΣJᵀ | right sides]`
    system: Vec<f64>,
    /// what the rows are multiplied with in a step, `[rows]`
    multipliers: Vec<f64>,
}

impl Linearisation {
    /// Memory for `blocks` blocks of residuals and `dofs` coordinates.
    pub fn new(blocks: usize, dofs: usize) -> Self {
        let rows = BLOCK * blocks;
        let wide = dense::stride(padded(rows, PAD) + padded(dofs, PAD));
        Self {
            jacobian: vec![0.0; rows * dofs],
            spread: vec![0.0; rows * dofs],
            products: vec![0.0; rows * rows],
            rows: 0,
            dofs,
            system: vec![0.0; padded(rows, ROWS) * wide],
            multipliers: vec![0.0; rows],
        }
    }

    /// J, row-major, shape `[rows, dofs]`, to be written before [`Self::update`].
    pub fn jacobian_mut(&mut self) -> &mut [f64] {
        &mut self.jacobian
    }

    /// Takes J as it was written. `moved_by` gives, block after block, the coordinates that move it, in rising order.
    pub fn update<'a>(&mut self, prior: &GaussianPrior, moved_by: impl Iterator<Item = &'a [usize]> + Clone) {
        let dofs = self.dofs;
        let block = BLOCK * dofs;
        self.rows = 0;
        let blocks = self.jacobian.chunks_exact(block).zip(self.spread.chunks_exact_mut(block));
        for (moved_by, (j, spread)) in moved_by.clone().zip(blocks) {
            dense::selected_product(j, moved_by, &prior.covariance, dofs, spread);
            self.rows += BLOCK;
        }
        for (k, (moved_by, j)) in moved_by.zip(self.jacobian.chunks_exact(block)).enumerate() {
            for row in BLOCK * k..self.rows {
                let spread = &self.spread[row * dofs..][..dofs];
                let mut sums = [0.0; BLOCK];
                for &dof in moved_by {
                    for (sum, i) in sums.iter_mut().zip(0..BLOCK) {
                        *sum += spread[dof] * j[i * dofs + dof];
                    }
                }
                self.products[row * self.rows + BLOCK * k..][..BLOCK].copy_from_slice(&sums);
            }
        }
    }

    /// Fills the system of a step, `W⁻¹ + share · JΣJᵀ`, with room for `columns` right sides; returns the distance of its
    /// rows and the column at which the right sides begin.
    fn fill(&mut self, variances: &[f64], share: f64, columns: usize) -> (usize, usize) {
        let rows = self.rows;
        let right = padded(rows, PAD);
        let stride = dense::stride(right + padded(columns, PAD));
        let system = &mut self.system[..padded(rows, ROWS) * stride];
        system.fill(0.0);
        for (i, row) in system.chunks_exact_mut(stride).enumerate() {
            if i < rows {
                for (k, value) in row[..rows].iter_mut().enumerate().skip(i) {
                    *value = share * self.products[k * rows + i];
                }
                row[i] += variances[i];
            } else {
                row[i] = 1.0;
            }
        }
        (stride, right)
    }

    /// One damped step from `x`, `z` (see [`crate::MapSolver`]) into `trial_x`, `trial_z`; returns the log of the system's
    /// determinant, or `None` if it cannot be solved.
    pub fn step(
        &mut self,
        prior: &GaussianPrior,
        variances: &[f64],
        residuals: &[f64],
        share: f64,
        [x, z]: [&[f64]; 2],
        [trial_x, trial_z]: [&mut [f64]; 2],
    ) -> Option<f64> {
        let (rows, dofs) = (self.rows, self.dofs);
        let (stride, right) = self.fill(variances, share, 1);
        let size = padded(rows, ROWS);
        let system = &mut self.system[..size * stride];
        for d in 0..dofs {
            trial_x[d] = x[d] - prior.mean[d];
        }
        for (i, row) in system.chunks_exact_mut(stride).take(rows).enumerate() {
            let j = &self.jacobian[i * dofs..][..dofs];
            row[right] = residuals[i] + share * dense::inner_product(j, trial_x);
        }
        if !dense::eliminate(system, size, stride, None, f64::MIN_POSITIVE) {
            return None;
        }
        let mut log_determinant = 0.0;
        for (i, row) in system.chunks_exact(stride).take(rows).enumerate() {
            log_determinant += 2.0 * row[i].ln();
            self.multipliers[i] = row[right];
        }
        let multipliers = &mut self.multipliers[..rows];
        dense::solve_upper(system, rows, stride, multipliers);
        multipliers.iter_mut().for_each(|m| *m *= share);
        for d in 0..dofs {
            trial_x[d] = x[d] - share * (x[d] - prior.mean[d]);
            trial_z[d] = z[d] - share * z[d];
        }
        dense::weighted_sum(&self.spread, dofs, multipliers, trial_x);
        dense::weighted_sum(&self.jacobian, dofs, multipliers, trial_z);
        Some(log_determinant)
    }

    /// Variance of every coordinate given the measurements, `diag(Σ − ΣJᵀ(JΣJᵀ + W⁻¹)⁻¹JΣ)`, into `out`.
    pub fn variances(&mut self, prior: &GaussianPrior, variances: &[f64], out: &mut [f64]) {
        let (rows, dofs) = (self.rows, self.dofs);
        for (d, out) in out.iter_mut().enumerate() {
            *out = prior.covariance[d * dofs + d];
        }
        let (stride, right) = self.fill(variances, 1.0, dofs);
        let size = padded(rows, ROWS);
        let system = &mut self.system[..size * stride];
        for (row, spread) in system.chunks_exact_mut(stride).zip(self.spread.chunks_exact(dofs)).take(rows) {
            row[right..right + dofs].copy_from_slice(spread);
        }
        if !dense::eliminate(system, size, stride, None, f64::MIN_POSITIVE) {
            return;
        }
        for row in system.chunks_exact(stride).take(rows) {
            for (out, v) in out.iter_mut().zip(&row[right..]) {
                *out -= v * v;
            }
        }
    }
}
