//! Learning the zero pose of a performer who is not in the database from the first seconds of their session.
//!
//! Measured points c_t = f(y_t + o + e_t), where y_t is the mean of the neighbours' poses, e_t what this pose differs from
//! them by (with their covariance) and o the performer's constant offsets. Linearised at the pose found, that is a
//! linear-Gaussian measurement of o; its prior is how performers of the database differ.

use std::sync::Arc;

use motion_db::ZeroPosePrior;
use nalgebra::{DMatrix, DVector};

use crate::frame_solver::FrameSolver;
use crate::problem::{Problem, table_around};
use crate::start::start;
use crate::zero_pose_information::ZeroPoseInformation;
use crate::{Parameters, Result};

/// How often the first seconds are tracked and the offsets fitted.
const ROUNDS: usize = 3;
/// Frames between two that are looked at: those in between say the same.
const STRIDE: usize = 4;
/// This many frames count as one independent frame: how a person's pose differs from its neighbours changes slowly.
const CORRELATED_FRAMES: f64 = 150.0;

/// Learns the performer's zero pose from the session's first frames, see [`crate::Reconstructor::learn_zero_pose`].
///
/// # Errors
/// If no start pose is found or the method's model is missing.
pub(crate) fn learn_zero_pose(problem: &mut Problem<'_>) -> Result<()> {
    let prior = problem.database.zero_pose_prior(&problem.session.skeleton);
    let Parameters { learn_zero_pose, zero_pose_frames, .. } = *problem.parameters;
    if prior.is_known || !learn_zero_pose {
        return Ok(());
    }
    let Some(prior) = FreePrior::new(&prior) else { return Ok(()) };
    let frames = zero_pose_frames;
    let dofs = problem.database.num_dofs();
    for _ in 0..ROUNDS {
        let mut information = ZeroPoseInformation::none(dofs);
        let mut solver = FrameSolver::new(problem)?;
        let begun = start(problem, &mut solver, 0, None)?;
        let mut track = begun.track;
        let end = (begun.frame + frames).min(problem.session.num_frames());
        for frame in begun.frame..end {
            solver.step(&mut track, problem.observed(frame));
            if (frame - begun.frame).is_multiple_of(STRIDE) {
                solver.add_zero_pose_information(STRIDE as f64 / CORRELATED_FRAMES, &mut information);
            }
        }
        drop(solver);
        let Some((learned, variance)) = prior.given(&information) else { break };
        problem.zero_pose = learned;
        problem.zero_pose_variance = variance;
        let table = table_around(
            problem.database,
            problem.index,
            problem.session,
            &problem.zero_pose,
            problem.around,
        )?;
        problem.table = Arc::new(table);
    }
    Ok(())
}

/// A prior over those offsets that may differ from 0.
struct FreePrior {
    dofs: usize,
    free: Vec<usize>,
    precision: DMatrix<f64>,
    mean: DVector<f64>,
}

impl FreePrior {
    /// `None` if nothing is free, or the covariance has no inverse.
    fn new(prior: &ZeroPosePrior) -> Option<Self> {
        let dofs = prior.mean.len();
        let free: Vec<usize> = (0..dofs).filter(|d| prior.covariance[d * dofs + d] > 0.0).collect();
        let covariance =
            DMatrix::from_fn(free.len(), free.len(), |a, b| prior.covariance[free[a] * dofs + free[b]]);
        let precision = covariance.cholesky().filter(|_| !free.is_empty())?.inverse();
        let mean = DVector::from_iterator(free.len(), free.iter().map(|d| prior.mean[*d]));
        Some(Self { dofs, free, precision, mean })
    }

    /// The most probable offsets and their variances, shape `[dofs]`, radians.
    fn given(&self, information: &ZeroPoseInformation) -> Option<(Vec<f64>, Vec<f64>)> {
        let free = &self.free;
        let count = free.len();
        let measured = DMatrix::from_fn(count, count, |a, b| information.precision[(free[a], free[b])]);
        let vector = DVector::from_iterator(count, free.iter().map(|d| information.vector[*d]));
        let factor = (measured + &self.precision).cholesky()?;
        let solved = factor.solve(&(vector + &self.precision * &self.mean));
        let covariance = factor.inverse();
        let (mut offsets, mut variances) = (vec![0.0; self.dofs], vec![0.0; self.dofs]);
        for (i, d) in free.iter().enumerate() {
            (offsets[*d], variances[*d]) = (solved[i], covariance[(i, i)]);
        }
        offsets.iter().chain(&variances).all(|o| o.is_finite()).then_some((offsets, variances))
    }
}
