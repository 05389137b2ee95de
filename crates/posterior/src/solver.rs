use kinematics::Kinematics;

use crate::dense::{cholesky, solve_lower, solve_positive_definite};
use crate::{ControlPoints, GaussianPrior, Measurement};

/// When the solver stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverParameters {
    /// most steps tried
    pub max_steps: usize,
    /// stop when a step lowers the energy by less than this share
    pub relative_decrease: f64,
}

impl Default for SolverParameters {
    fn default() -> Self {
        Self { max_steps: 12, relative_decrease: 1e-4 }
    }
}

/// What a solve came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// steps tried
    pub steps: usize,
    /// energy of the likelihood: squared residuals over their variances
    pub likelihood_energy: f64,
    /// energy of the prior: squared Mahalanobis distance
    pub prior_energy: f64,
    /// root mean square distance of the measured points, metres; 0 if none was measured
    pub residual_m: f64,
    /// log of the determinant of `JΣJᵀ + W⁻¹`, the covariance that the prior predicts for the measurements, metres²
    pub log_determinant: f64,
}

impl Solution {
    /// Minus the log of the probability density that the prior gave to the measurements (up to a constant): it grows when
    /// they are far from what was predicted and when the prediction was vague.
    pub fn surprise(&self) -> f64 {
        0.5 * (self.likelihood_energy + self.prior_energy + self.log_determinant)
    }
}

/// Finds the pose of least energy, keeping its memory from frame to frame.
///
/// Coordinates are written x = μ + Σz. With a = W⁻¹-weighted multipliers of the measurements, damping κ (which
/// scales the prior's metric) and the Jacobian J, a Levenberg–Marquardt step is
///
/// ```text
/// (W⁻¹ + JΣJᵀ/(1+κ)) a = r + J(x − μ)/(1+κ),    dz = (Jᵀa − z)/(1+κ),    dx = Σ dz
/// ```
///
/// where r = c − f(x) and W⁻¹ holds the variances of the measurements.
#[derive(Debug, Clone)]
pub struct MapSolver {
    jacobian: Vec<f64>,
    /// JΣ, `[rows, dofs]`
    spread: Vec<f64>,
    system: Vec<f64>,
    multipliers: Vec<f64>,
    residuals: Vec<f64>,
    trial_residuals: Vec<f64>,
    variances: Vec<f64>,
    x: Vec<f64>,
    z: Vec<f64>,
    trial_x: Vec<f64>,
    trial_z: Vec<f64>,
}

impl MapSolver {
    /// Memory for `points` control points and `dofs` coordinates.
    pub fn new(points: usize, dofs: usize) -> Self {
        let rows = 3 * points;
        Self {
            jacobian: vec![0.0; rows * dofs],
            spread: vec![0.0; rows * dofs],
            system: vec![0.0; rows * rows],
            multipliers: vec![0.0; rows],
            residuals: vec![0.0; rows],
            trial_residuals: vec![0.0; rows],
            variances: vec![0.0; rows],
            x: vec![0.0; dofs],
            z: vec![0.0; dofs],
            trial_x: vec![0.0; dofs],
            trial_z: vec![0.0; dofs],
        }
    }

    /// The coordinates found by the last [`Self::solve`], shape `[dofs]`.
    pub fn coordinates(&self) -> &[f64] {
        &self.x
    }

    /// Minimises the energy, starting from the prior's mean. `measured` has shape `[points]`.
    pub fn solve(
        &mut self,
        kinematics: &Kinematics,
        likelihood: &mut ControlPoints,
        measured: &[Option<Measurement>],
        prior: &GaussianPrior,
        parameters: &SolverParameters,
    ) -> Solution {
        let dofs = prior.mean.len();
        self.x.copy_from_slice(&prior.mean);
        self.z.fill(0.0);
        let mut rows = 0;
        for m in measured.iter().flatten() {
            self.variances[rows..rows + 3].fill(m.sigma * m.sigma);
            rows += 3;
        }
        let (_, mut data_energy) = likelihood.residuals(kinematics, &self.x, measured, &mut self.residuals);
        let mut prior_energy = 0.0;
        let mut damping = 0.0;
        let mut steps = 0;
        let mut log_determinant = 0.0;
        let mut is_new_point = true;
        while steps < parameters.max_steps && rows > 0 {
            steps += 1;
            if is_new_point {
                likelihood.jacobian(kinematics, measured, &mut self.jacobian);
                self.spread(prior, rows, dofs);
            }
            if !self.step(prior, rows, dofs, damping) {
                damping = next_damping(damping);
                continue;
            }
            if damping == 0.0 {
                // The system now holds its Cholesky factor.
                log_determinant = (0..rows).map(|i| 2.0 * self.system[i * rows + i].ln()).sum();
            }
            let (_, trial_data) =
                likelihood.residuals(kinematics, &self.trial_x, measured, &mut self.trial_residuals);
            let trial_prior: f64 =
                self.trial_z.iter().zip(&self.trial_x).zip(&prior.mean).map(|((z, x), m)| z * (x - m)).sum();
            let (energy, trial) = (data_energy + prior_energy, trial_data + trial_prior);
            is_new_point = trial < energy;
            if is_new_point {
                std::mem::swap(&mut self.x, &mut self.trial_x);
                std::mem::swap(&mut self.z, &mut self.trial_z);
                std::mem::swap(&mut self.residuals, &mut self.trial_residuals);
                (data_energy, prior_energy) = (trial_data, trial_prior);
                damping = if damping < 1e-3 { 0.0 } else { damping / 10.0 };
                if energy - trial <= parameters.relative_decrease * energy {
                    break;
                }
            } else {
                if trial - energy <= 1e-9 * energy {
                    break;
                }
                damping = next_damping(damping);
            }
        }
        let squares: f64 = self.residuals[..rows].iter().map(|r| r * r).sum();
        let residual_m = if rows > 0 { (squares / (rows / 3) as f64).sqrt() } else { 0.0 };
        Solution { steps, likelihood_energy: data_energy, prior_energy, residual_m, log_determinant }
    }

    /// `JΣ`, using that most of J is zero: a point is moved by its own chain only.
    fn spread(&mut self, prior: &GaussianPrior, rows: usize, dofs: usize) {
        for (j, out) in
            self.jacobian[..rows * dofs].chunks_exact(dofs).zip(self.spread.chunks_exact_mut(dofs))
        {
            out.fill(0.0);
            for (factor, covariance) in j.iter().zip(prior.covariance.chunks_exact(dofs)) {
                if *factor != 0.0 {
                    for (o, c) in out.iter_mut().zip(covariance) {
                        *o += factor * c;
                    }
                }
            }
        }
    }

    /// Puts the damped step's end into `trial_x`, `trial_z`. `false` if the system cannot be solved.
    fn step(&mut self, prior: &GaussianPrior, rows: usize, dofs: usize, damping: f64) -> bool {
        let share = 1.0 / (1.0 + damping);
        self.system(rows, dofs, share);
        for i in 0..rows {
            let j = &self.jacobian[i * dofs..][..dofs];
            let moved: f64 = j.iter().zip(&self.x).zip(&prior.mean).map(|((j, x), m)| j * (x - m)).sum();
            self.multipliers[i] = self.residuals[i] + share * moved;
        }
        if !solve_positive_definite(&mut self.system[..rows * rows], rows, &mut self.multipliers[..rows]) {
            return false;
        }
        for d in 0..dofs {
            self.trial_x[d] = self.x[d] - share * (self.x[d] - prior.mean[d]);
            self.trial_z[d] = self.z[d] - share * self.z[d];
        }
        for i in 0..rows {
            let factor = share * self.multipliers[i];
            let (j, s) = (&self.jacobian[i * dofs..][..dofs], &self.spread[i * dofs..][..dofs]);
            for d in 0..dofs {
                self.trial_x[d] += factor * s[d];
                self.trial_z[d] += factor * j[d];
            }
        }
        true
    }

    /// `W⁻¹ + share · JΣJᵀ`, lower triangle.
    fn system(&mut self, rows: usize, dofs: usize, share: f64) {
        for i in 0..rows {
            let s = &self.spread[i * dofs..][..dofs];
            for k in 0..=i {
                let j = &self.jacobian[k * dofs..][..dofs];
                let product: f64 = s.iter().zip(j).map(|(s, j)| s * j).sum();
                self.system[i * rows + k] = share * product + if i == k { self.variances[i] } else { 0.0 };
            }
        }
    }

    /// Standard deviation of every coordinate under the posterior's Gaussian approximation at the solution (the
    /// inverse of the energy's Hessian: `Σ − ΣJᵀ(JΣJᵀ + W⁻¹)⁻¹JΣ`), shape `[dofs]`, metres and radians.
    pub fn standard_deviations(
        &mut self,
        kinematics: &Kinematics,
        likelihood: &mut ControlPoints,
        measured: &[Option<Measurement>],
        prior: &GaussianPrior,
        out: &mut [f64],
    ) {
        let dofs = prior.mean.len();
        let (rows, _) = likelihood.residuals(kinematics, &self.x, measured, &mut self.residuals);
        likelihood.jacobian(kinematics, measured, &mut self.jacobian);
        self.spread(prior, rows, dofs);
        self.system(rows, dofs, 1.0);
        let is_solved = cholesky(&mut self.system[..rows * rows], rows);
        for (d, out) in out.iter_mut().enumerate() {
            let mut variance = prior.covariance[d * dofs + d];
            if is_solved {
                for i in 0..rows {
                    self.multipliers[i] = self.spread[i * dofs + d];
                }
                solve_lower(&self.system, rows, &mut self.multipliers[..rows]);
                variance -= self.multipliers[..rows].iter().map(|v| v * v).sum::<f64>();
            }
            *out = variance.max(0.0).sqrt();
        }
    }
}

fn next_damping(damping: f64) -> f64 {
    if damping == 0.0 { 1e-2 } else { damping * 10.0 }
}
