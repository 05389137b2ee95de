use kinematics::Kinematics;

use crate::linearisation::{BLOCK, Linearisation};
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
    linearisation: Linearisation,
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
        let rows = BLOCK * points;
        Self {
            linearisation: Linearisation::new(points, dofs),
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
        self.x.copy_from_slice(&prior.mean);
        self.z.fill(0.0);
        let rows = likelihood.variances(measured, &mut self.variances);
        let (_, mut data_energy) = likelihood.residuals(kinematics, &self.x, measured, &mut self.residuals);
        let mut prior_energy = 0.0;
        let mut damping = 0.0;
        let mut steps = 0;
        let mut log_determinant = 0.0;
        let mut is_new_point = true;
        while steps < parameters.max_steps && rows > 0 {
            steps += 1;
            if is_new_point {
                self.linearise(kinematics, likelihood, measured, prior);
                is_new_point = false;
            }
            let share = 1.0 / (1.0 + damping);
            let from = [&self.x[..], &self.z];
            let to = [&mut self.trial_x[..], &mut self.trial_z];
            let Some(found) =
                self.linearisation.step(prior, &self.variances, &self.residuals, share, from, to)
            else {
                damping = next_damping(damping);
                continue;
            };
            if damping == 0.0 {
                log_determinant = found;
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

    /// Linearises at the coordinates last given to [`ControlPoints::residuals`].
    fn linearise(
        &mut self,
        kinematics: &Kinematics,
        likelihood: &mut ControlPoints,
        measured: &[Option<Measurement>],
        prior: &GaussianPrior,
    ) {
        likelihood.jacobian(kinematics, measured, self.linearisation.jacobian_mut());
        self.linearisation.update(prior, likelihood.moved_by(measured));
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
        likelihood.variances(measured, &mut self.variances);
        likelihood.residuals(kinematics, &self.x, measured, &mut self.residuals);
        self.linearise(kinematics, likelihood, measured, prior);
        self.linearisation.variances(prior, &self.variances, out);
        out.iter_mut().for_each(|v| *v = v.max(0.0).sqrt());
    }
}

fn next_damping(damping: f64) -> f64 {
    if damping == 0.0 { 1e-2 } else { damping * 10.0 }
}
