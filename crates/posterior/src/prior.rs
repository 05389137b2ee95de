/// A Gaussian over D coordinates, in metres and radians.
#[derive(Debug, Clone)]
pub struct GaussianPrior {
    /// μ, shape `[dofs]`
    pub mean: Vec<f64>,
    /// Σ, symmetric positive definite, row-major, shape `[dofs, dofs]`
    pub covariance: Vec<f64>,
}

impl GaussianPrior {
    /// Memory for `dofs` coordinates.
    pub fn new(dofs: usize) -> Self {
        Self { mean: vec![0.0; dofs], covariance: vec![0.0; dofs * dofs] }
    }

    /// Σ = EᵀE + diag(σ²). `residuals` E is row-major, shape `[K, dofs]`; `min_sigma` has shape `[dofs]`.
    pub fn set_full(&mut self, residuals: &[f64], min_sigma: &[f64]) {
        let dofs = self.mean.len();
        dense::self_product(residuals, dofs, &mut self.covariance);
        for (i, sigma) in min_sigma.iter().enumerate() {
            self.covariance[i * dofs + i] += sigma * sigma;
        }
    }

    /// As [`Self::set_full`], with the covariances between coordinates left out.
    pub fn set_diagonal(&mut self, residuals: &[f64], min_sigma: &[f64]) {
        let dofs = self.mean.len();
        self.covariance.fill(0.0);
        for (i, sigma) in min_sigma.iter().enumerate() {
            let sum: f64 = residuals.iter().skip(i).step_by(dofs).map(|r| r * r).sum();
            self.covariance[i * dofs + i] = sum + sigma * sigma;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_diagonal_is_that_of_the_full_covariance() {
        let residuals = [0.1, -0.2, 0.3, 0.4, 0.5, -0.6];
        let (mut full, mut diagonal) = (GaussianPrior::new(3), GaussianPrior::new(3));
        full.set_full(&residuals, &[0.01, 0.02, 0.03]);
        diagonal.set_diagonal(&residuals, &[0.01, 0.02, 0.03]);
        for i in 0..3 {
            assert!((full.covariance[4 * i] - diagonal.covariance[4 * i]).abs() < 1e-15);
        }
        assert!((full.covariance[1] - (0.1 * -0.2 + 0.4 * 0.5)).abs() < 1e-15);
        assert_eq!(full.covariance[1], full.covariance[3]);
    }
}
