use faer::Side;
use faer::linalg::solvers::DenseSolveCore;

use crate::gplvm::active_set::nearest_centre;
use crate::gplvm::kernel::smooth_kernel;
use crate::gplvm::stored::Stored;
use crate::{Error, Result};

/// A trained model. Units are those of the training set.
#[derive(Debug, Clone, PartialEq)]
pub struct Gplvm {
    pub(super) stored: Stored,
    /// K⁻¹ (Y − μ), row-major, shape `[active, features]`
    coefficients: Vec<f64>,
    /// K⁻¹, row-major, shape `[active, active]`
    inverse: Vec<f64>,
}

/// The model at one latent point, with the memory to find it.
#[derive(Debug, Clone)]
pub struct At {
    /// x, shape `[latent_dims]`
    pub latent: Vec<f64>,
    /// f(x), shape `[features]`
    pub mean: Vec<f64>,
    /// ∂f/∂x, shape `[latent_dims, features]`
    pub slopes: Vec<f64>,
    /// σ²(x)
    pub variance: f64,
    /// ∂σ²/∂x, shape `[latent_dims]`
    pub variance_slopes: Vec<f64>,
    /// k(x) and its derivatives, shape `[1 + latent_dims, active]`
    kernel: Vec<f64>,
    /// K⁻¹ k(x), shape `[active]`
    solved: Vec<f64>,
}

impl Gplvm {
    /// Derives what predictions need from what is stored, which fits together and is finite.
    ///
    /// # Errors
    /// If the kernel matrix has no inverse.
    pub(super) fn new(stored: Stored) -> Result<Self> {
        let active = stored.latent.len() / stored.latent_dims;
        let width = stored.mean.len();
        let mut kernel = smooth_kernel(&stored.latent, stored.latent_dims, stored.inverse_width);
        for i in 0..active {
            kernel[(i, i)] += stored.noise;
        }
        let factor = kernel.llt(Side::Lower).map_err(|_| Error::Singular { active })?;
        let matrix = factor.inverse();
        let inverse: Vec<f64> = (0..active * active).map(|i| matrix[(i / active, i % active)]).collect();
        let mut coefficients = vec![0.0; active * width];
        for (row, out) in inverse.chunks_exact(active).zip(coefficients.chunks_exact_mut(width)) {
            for (factor, features) in row.iter().zip(stored.features.chunks_exact(width)) {
                add_scaled(out, *factor, features);
            }
        }
        if !coefficients.iter().all(|v| v.is_finite()) {
            return Err(Error::Singular { active });
        }
        Ok(Self { stored, coefficients, inverse })
    }

    /// Numbers of a pose.
    pub fn dofs(&self) -> usize {
        self.stored.dofs
    }

    /// Dimensions of the latent space.
    pub fn latent_dims(&self) -> usize {
        self.stored.latent_dims
    }

    /// Size of the active set.
    pub fn active(&self) -> usize {
        self.stored.latent.len() / self.stored.latent_dims
    }

    /// Memory for [`Self::evaluate`].
    pub(super) fn at(&self) -> At {
        let (dims, width) = (self.latent_dims(), self.stored.mean.len());
        At {
            latent: vec![0.0; dims],
            mean: vec![0.0; width],
            slopes: vec![0.0; dims * width],
            variance: 0.0,
            variance_slopes: vec![0.0; dims],
            kernel: vec![0.0; (1 + dims) * self.active()],
            solved: vec![0.0; self.active()],
        }
    }

    /// Evaluates the model at `at.latent`.
    pub(super) fn evaluate(&self, at: &mut At) {
        let Stored { latent_dims: dims, inverse_width, noise, ref mean, ref latent, .. } = self.stored;
        let (active, width) = (self.active(), mean.len());
        let (kernel, slopes) = at.kernel.split_at_mut(active);
        for (i, point) in latent.chunks_exact(dims).enumerate() {
            let squared: f64 = point.iter().zip(&at.latent).map(|(a, b)| (a - b) * (a - b)).sum();
            kernel[i] = (-0.5 * inverse_width * squared).exp();
            for d in 0..dims {
                slopes[d * active + i] = -inverse_width * kernel[i] * (at.latent[d] - point[d]);
            }
        }
        at.mean.copy_from_slice(mean);
        at.slopes.fill(0.0);
        for (i, row) in self.coefficients.chunks_exact(width).enumerate() {
            // Far from an active pose its kernel is nothing.
            if kernel[i] < 1e-12 {
                continue;
            }
            add_scaled(&mut at.mean, kernel[i], row);
            for d in 0..dims {
                add_scaled(&mut at.slopes[d * width..(d + 1) * width], slopes[d * active + i], row);
            }
        }
        for (solved, row) in at.solved.iter_mut().zip(self.inverse.chunks_exact(active)) {
            *solved = dot(row, kernel);
        }
        at.variance = (1.0 + noise - dot(kernel, &at.solved)).max(noise);
        for (out, slope) in at.variance_slopes.iter_mut().zip(slopes.chunks_exact(active)) {
            *out = -2.0 * dot(slope, &at.solved);
        }
    }

    /// The latent point of the active pose nearest to `centred`, features less their mean, shape `[features]`.
    pub(super) fn nearest_latent(&self, centred: &[f64]) -> &[f64] {
        let (nearest, _) = nearest_centre(centred, &self.stored.features);
        &self.stored.latent[nearest * self.latent_dims()..(nearest + 1) * self.latent_dims()]
    }
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
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

pub fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    sum.iter_mut().zip(row).for_each(|(s, v)| *s += factor * v);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Gplvm {
        let (active, dofs, latent_dims) = (12, 3, 2);
        let wave = |count: usize, speed: f64| -> Vec<f64> {
            (0..count).map(|i| (i as f64 * speed + (i as f64).sqrt()).sin()).collect()
        };
        let stored = Stored {
            dofs,
            latent_dims,
            inverse_width: 1.5,
            noise: 0.01,
            mean: wave(2 * dofs, 0.3),
            variances: vec![1.0; 2 * dofs],
            latent: wave(active * latent_dims, 1.7),
            features: wave(active * 2 * dofs, 0.9),
        };
        Gplvm::new(stored).unwrap()
    }

    #[test]
    fn the_mean_goes_near_the_active_poses() {
        let model = model();
        let mut at = model.at();
        for i in 0..12 {
            at.latent.copy_from_slice(&model.stored.latent[2 * i..2 * i + 2]);
            model.evaluate(&mut at);
            assert!(at.variance < 0.03, "{}", at.variance);
        }
        at.latent.fill(50.0);
        model.evaluate(&mut at);
        assert_eq!(at.mean, model.stored.mean);
        assert!((at.variance - 1.01).abs() < 1e-12);
    }

    #[test]
    fn slopes_agree_with_central_differences() {
        let model = model();
        let (mut at, mut above, mut below) = (model.at(), model.at(), model.at());
        at.latent.copy_from_slice(&[0.3, -0.2]);
        model.evaluate(&mut at);
        for d in 0..2 {
            above.latent.copy_from_slice(&at.latent);
            below.latent.copy_from_slice(&at.latent);
            above.latent[d] += 1e-6;
            below.latent[d] -= 1e-6;
            model.evaluate(&mut above);
            model.evaluate(&mut below);
            for k in 0..6 {
                let expected = (above.mean[k] - below.mean[k]) / 2e-6;
                assert!((at.slopes[d * 6 + k] - expected).abs() < 1e-6, "feature {k}, dimension {d}");
            }
            let expected = (above.variance - below.variance) / 2e-6;
            assert!((at.variance_slopes[d] - expected).abs() < 1e-6, "dimension {d}");
        }
    }
}
