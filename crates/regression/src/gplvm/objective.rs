use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use crate::gplvm::kernel::smooth_kernel;
use crate::gplvm::model::Gplvm;
use crate::gplvm::stored::Stored;
use crate::{Error, Result};

/// Variance of a feature that is not the latent variables' to explain, squared units per pose.
const FEATURE_FLOOR: f64 = 0.1;
/// A velocity that varies less than this, squared units per frame, is left out.
const CONSTANT: f64 = 1e-9;

/// Minus the log of the posterior of a model's unknowns, L of the module's documentation, with the scales `w_k` at
/// their best values: `w_k⁻² = (Y_kᵀ K⁻¹ Y_k)/N + floor`.
pub struct Objective {
    /// centred features, shape `[active, features]`
    features: Mat<f64>,
    mean: Vec<f64>,
    /// which features take part
    is_used: Vec<bool>,
    dofs: usize,
    latent_dims: usize,
}

/// What is sought: latent points, row-major, then ln γ and ln β⁻¹.
pub struct Unknowns {
    pub values: Vec<f64>,
}

impl Unknowns {
    /// Starts where principal components analysis puts the active set, scaled to variance 1 along the first.
    pub fn from_principal_components(active: &[f64], width: usize, latent_dims: usize) -> Self {
        let (count, mean) = (active.len() / width, means(active, width));
        let centred = Mat::from_fn(count, width, |i, k| active[i * width + k] - mean[k]);
        let gram = &centred * centred.transpose();
        let mut values = vec![0.0; count * latent_dims + 2];
        // Eigenvalues rise. Without an eigendecomposition (which finite numbers always have) the start is zero.
        if let Ok(eigen) = gram.self_adjoint_eigen(Side::Lower) {
            let largest = eigen.S()[count - 1].max(1e-12);
            for j in 0..latent_dims.min(count) {
                let column = count - 1 - j;
                let scale = (eigen.S()[column].max(0.0) / largest * count as f64).sqrt();
                for i in 0..count {
                    values[i * latent_dims + j] = scale * eigen.U()[(i, column)];
                }
            }
        }
        let [inverse_width, noise] = &mut values[count * latent_dims..] else {
            unreachable!("two values follow")
        };
        (*inverse_width, *noise) = (1.0f64.ln(), 0.05f64.ln());
        Self { values }
    }
}

/// The kernel matrix and what follows from it.
struct Kernel {
    /// without noise
    smooth: Mat<f64>,
    inverse: Mat<f64>,
    log_determinant: f64,
    inverse_width: f64,
    noise: f64,
}

impl Objective {
    /// The objective of an active set: features, row-major, shape `[active, 2 · dofs]`.
    pub fn new(active: &[f64], dofs: usize, latent_dims: usize) -> Self {
        let width = 2 * dofs;
        let (count, mean) = (active.len() / width, means(active, width));
        let features = Mat::from_fn(count, width, |i, k| active[i * width + k] - mean[k]);
        let varies =
            |k: usize| (0..count).map(|i| features[(i, k)].powi(2)).sum::<f64>() > CONSTANT * count as f64;
        let is_used = (0..width).map(|k| k < dofs || varies(k)).collect();
        Self { features, mean, is_used, dofs, latent_dims }
    }

    fn kernel(&self, x: &[f64]) -> Option<Kernel> {
        let (count, dims) = (self.features.nrows(), self.latent_dims);
        let (inverse_width, noise) = (x[count * dims].exp(), x[count * dims + 1].exp());
        // The prior of γ and β is not a distribution: where poses say nothing of them, they would run off.
        let in_range = (1e-6..=1e6).contains(&inverse_width) && (1e-8..=1.0).contains(&noise);
        if !in_range {
            return None;
        }
        let smooth = smooth_kernel(&x[..count * dims], dims, inverse_width);
        let mut full = smooth.clone();
        for i in 0..count {
            full[(i, i)] += noise;
        }
        let factor = full.llt(Side::Lower).ok()?;
        let lower = factor.L();
        let log_determinant = (0..count).map(|i| 2.0 * lower[(i, i)].ln()).sum();
        Some(Kernel { inverse: factor.inverse(), smooth, log_determinant, inverse_width, noise })
    }

    /// `w_k⁻²` of every feature, 0 for those left out, and `K⁻¹ Y`.
    fn scales(&self, kernel: &Kernel) -> (Vec<f64>, Mat<f64>) {
        let count = self.features.nrows();
        let coefficients = &kernel.inverse * &self.features;
        let variances = (0..self.features.ncols()).map(|k| {
            let explained: f64 = (0..count).map(|i| self.features[(i, k)] * coefficients[(i, k)]).sum();
            if self.is_used[k] { explained / count as f64 + FEATURE_FLOOR } else { 0.0 }
        });
        (variances.collect(), coefficients)
    }

    /// The value at `x`, with its gradient.
    pub fn value(&self, x: &[f64], gradient: &mut [f64]) -> f64 {
        let (count, dims) = (self.features.nrows(), self.latent_dims);
        let Some(kernel) = self.kernel(x) else { return f64::INFINITY };
        let (variances, mut coefficients) = self.scales(&kernel);
        let used = self.is_used.iter().filter(|u| **u).count() as f64;
        let (latent, _) = x.split_at(count * dims);
        let log_scales: f64 = variances.iter().filter(|v| **v > 0.0).map(|v| v.ln()).sum();
        let value = 0.5 * used * kernel.log_determinant
            + 0.5 * count as f64 * log_scales
            + 0.5 * latent.iter().map(|v| v * v).sum::<f64>()
            + kernel.inverse_width.ln()
            - kernel.noise.ln();
        // ∂L/∂K = ½ (F K⁻¹ − Σ_k w_k² K⁻¹Y_k Y_kᵀK⁻¹)
        for (k, v) in variances.iter().enumerate() {
            let scale = if *v > 0.0 { v.sqrt().recip() } else { 0.0 };
            for i in 0..count {
                coefficients[(i, k)] *= scale;
            }
        }
        let products = &coefficients * coefficients.transpose();
        gradient.copy_from_slice(x);
        let (by_latent, by_kernel) = gradient.split_at_mut(count * dims);
        (by_kernel[0], by_kernel[1]) = (1.0, -1.0);
        for i in 0..count {
            for j in 0..count {
                let slope = 0.5 * (used * kernel.inverse[(j, i)] - products[(j, i)]);
                if i == j {
                    by_kernel[1] += slope * kernel.noise;
                    continue;
                }
                let along = slope * kernel.smooth[(j, i)] * kernel.inverse_width;
                let mut squared = 0.0;
                for d in 0..dims {
                    let difference = latent[i * dims + d] - latent[j * dims + d];
                    squared += difference * difference;
                    by_latent[i * dims + d] -= 2.0 * along * difference;
                }
                by_kernel[0] -= 0.5 * along * squared;
            }
        }
        value
    }

    /// The model at `x`.
    ///
    /// # Errors
    /// If the kernel matrix there has no inverse.
    pub fn model(&self, x: &[f64]) -> Result<Gplvm> {
        let (count, dims) = (self.features.nrows(), self.latent_dims);
        let kernel = self.kernel(x).ok_or(Error::Singular { active: count })?;
        let (variances, _) = self.scales(&kernel);
        let width = self.features.ncols();
        let features = (0..count * width).map(|i| self.features[(i / width, i % width)]).collect();
        Gplvm::new(Stored {
            dofs: self.dofs,
            latent_dims: dims,
            inverse_width: kernel.inverse_width,
            noise: kernel.noise,
            mean: self.mean.clone(),
            variances,
            latent: x[..count * dims].to_vec(),
            features,
        })
    }
}

fn means(rows: &[f64], width: usize) -> Vec<f64> {
    let count = (rows.len() / width) as f64;
    let mut mean = vec![0.0; width];
    for row in rows.chunks_exact(width) {
        mean.iter_mut().zip(row).for_each(|(m, v)| *m += v / count);
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize) -> Vec<f64> {
        (0..count).map(|i| 10.0 * (i as f64 * 0.71 + (i as f64).sqrt()).sin()).collect()
    }

    #[test]
    fn the_gradient_agrees_with_central_differences() {
        let (active, dofs, dims) = (wave(12 * 6), 3, 2);
        let objective = Objective::new(&active, dofs, dims);
        let mut x = Unknowns::from_principal_components(&active, 2 * dofs, dims).values;
        x[3] += 0.3;
        let mut gradient = vec![0.0; x.len()];
        let mut unused = gradient.clone();
        objective.value(&x, &mut gradient);
        for i in 0..x.len() {
            let (at, step) = (x[i], 1e-5);
            x[i] = at + step;
            let above = objective.value(&x, &mut unused);
            x[i] = at - step;
            let below = objective.value(&x, &mut unused);
            x[i] = at;
            let expected = (above - below) / (2.0 * step);
            let tolerance = 1e-6 * (1.0 + expected.abs());
            assert!((gradient[i] - expected).abs() < tolerance, "unknown {i}: {} {expected}", gradient[i]);
        }
    }

    #[test]
    fn a_velocity_that_never_changes_is_left_out() {
        let mut active = wave(10 * 4);
        active.chunks_exact_mut(4).for_each(|row| row[3] = 0.0);
        let objective = Objective::new(&active, 2, 1);
        assert_eq!(objective.is_used, [true, true, true, false]);
    }
}
