use motion_db::{HeadingFrame, Neighbour, Scratch, SkeletonSize, StartPose};
use nalgebra::{DMatrix, DVector, Vector3};
use posterior::{ControlPoints, GaussianPrior, MapSolver, Solution};
use regression::gplvm::TrainingOptions;
use regression::{Prediction, Predictor};

use crate::examples::ExampleBuffer;
use crate::frame_query::FrameQuery;
use crate::methods::predictor;
use crate::problem::Problem;
use crate::track::{Observed, Step, Track};
use crate::uncertainty::Uncertainty;
use crate::zero_pose_information::ZeroPoseInformation;
use crate::{Covariance, FramePart, Result, Search};

/// Least standard deviation of a point, metres, where a zero pose is learned: bone lengths are no better known.
const MIN_ZERO_POSE_SIGMA_M: f64 = 0.005;

/// Takes a [`Track`] one frame further: search, prediction and the most probable pose, with all their memory.
pub(crate) struct FrameSolver<'a> {
    problem: &'a Problem<'a>,
    /// database translation per session translation
    scale: f64,
    root_offset: Vector3<f64>,
    query: FrameQuery<'a>,
    predictor: Box<dyn Predictor + 'a>,
    prediction: Prediction,
    examples: ExampleBuffer,
    prior: GaussianPrior,
    sigma: Vec<f64>,
    likelihood: ControlPoints,
    solver: MapSolver,
    search: Scratch,
    neighbours: Vec<Neighbour>,
    local: Vec<f64>,
    found: Vec<f64>,
}

impl<'a> FrameSolver<'a> {
    /// Solves the frames of `problem`.
    ///
    /// # Errors
    /// If the method's model is missing.
    pub fn new(problem: &'a Problem<'_>) -> Result<Self> {
        let Problem { database, index, session, parameters, kinematics, points, .. } = problem;
        let dofs = database.num_dofs();
        let k = parameters.neighbours;
        let width =
            index.width() + if parameters.control_points_in_query { problem.num_controls() } else { 0 };
        let scale = database.leg_length() / SkeletonSize::leg_length(&session.skeleton);
        Ok(Self {
            problem,
            scale,
            root_offset: session.skeleton.joints()[0].offset,
            query: FrameQuery::new(problem, width, scale),
            predictor: predictor(problem, width)?,
            prediction: Prediction::new(k.max(TrainingOptions::MOST_LATENT_DIMS), dofs),
            examples: ExampleBuffer::new(k, width, dofs),
            prior: GaussianPrior::new(dofs),
            sigma: vec![0.0; dofs],
            likelihood: ControlPoints::new(kinematics, points.clone()),
            solver: MapSolver::new(points.len(), dofs),
            search: Scratch::default(),
            neighbours: Vec::with_capacity(k),
            local: vec![0.0; dofs],
            found: vec![0.0; dofs],
        })
    }

    /// A track that stands where a start pose of the database was put.
    pub fn track_from(&self, start: &StartPose) -> Track {
        let mut track = Track::blank(self.problem.database.num_dofs(), self.problem.parameters);
        self.place(start, &mut track);
        track
    }

    /// Makes `track` stand where a start pose of the database was put.
    pub fn place(&self, start: &StartPose, track: &mut Track) {
        // The shift was found for points, which hang from the root's offset.
        let turned = HeadingFrame::new(0.0, 0.0, start.turn);
        for (back, pose) in track.history.iter_mut().enumerate() {
            self.problem.database.copy_pose(start.pose - 1 - back, pose);
            pose[..3].iter_mut().for_each(|v| *v /= self.scale);
            pose.iter_mut().zip(&self.problem.zero_pose).for_each(|(v, o)| *v += o);
            let root = Vector3::new(pose[0], 0.0, pose[2]) + self.root_offset;
            let root = turned.world_from_local(&root) - self.root_offset;
            pose[0] = root.x + start.shift[0];
            pose[2] = root.z + start.shift[1];
            pose[kinematics::HEADING] += start.turn;
        }
        track.matches.clear();
    }

    /// Takes `track` one frame further with what was measured in that frame.
    pub fn step(&mut self, track: &mut Track, observed: Observed<'_>) -> Step {
        self.begin(FramePart::Query);
        let frame = HeadingFrame::from_coordinates(track.newest());
        self.query.measure(&frame, observed.now);
        if let Some((trajectories, now)) = observed.session {
            self.query.measure_around(&frame, trajectories, now);
        }
        self.find_neighbours(track);
        self.begin(FramePart::Prior);
        self.predict();
        let mut solution = self.solve();
        while self.relinearise(&solution) {
            solution = self.solve();
        }
        self.begin(FramePart::Rest);
        // The oldest pose makes room for the new one.
        track.history.rotate_right(1);
        let newest = &mut track.history[0];
        newest.copy_from_slice(self.solver.coordinates());
        frame.absolute(newest);
        self.problem.kinematics.parametrisation().wrap(newest);
        track.matches.clear();
        track.matches.extend(self.neighbours.iter().map(|n| n.row));
        let measured = 3 * self.query.measured.iter().flatten().count();
        let nearest = self.neighbours.first().map_or(f64::INFINITY, |n| n.distance_squared);
        Step { solution, measured, neighbour_distance: (nearest / self.query.inputs.len() as f64).sqrt() }
    }

    /// Tells the watcher, if there is one, that a part begins.
    #[inline]
    pub fn begin(&self, part: FramePart) {
        if let Some(watcher) = self.problem.watcher {
            watcher(part);
        }
    }

    /// The most probable pose between prediction and measurement.
    fn solve(&mut self) -> Solution {
        self.set_prior();
        self.begin(FramePart::Map);
        self.solver.solve(
            &self.problem.kinematics,
            &mut self.likelihood,
            &self.query.measured,
            &self.prior,
            &self.problem.parameters.solver(),
        )
    }

    /// Whether the prediction, seen from the pose found, has changed.
    fn relinearise(&mut self, solution: &Solution) -> bool {
        let neutral = self.solver.coordinates().iter().zip(&self.problem.zero_pose).map(|(x, o)| x - o);
        for ((out, x), factor) in self.found.iter_mut().zip(neutral).zip(&self.local) {
            *out = x / factor;
        }
        self.predictor.relinearise(&self.found, solution.likelihood_energy, &mut self.prediction)
    }

    /// Mean posterior standard deviation over the joint angles of the last step, radians; `all` receives every
    /// coordinate's, shape `[dofs]`. `before` is what was uncertain of the frames before.
    pub fn standard_deviations(&mut self, before: &mut Uncertainty, all: &mut [f64]) -> f64 {
        self.solver.standard_deviations(
            &self.problem.kinematics,
            &mut self.likelihood,
            &self.query.measured,
            &self.prior,
            all,
        );
        let dofs = all.len();
        before.update(|d| self.prior.covariance[d * dofs + d], all);
        let angles = &all[kinematics::ROOT_DOFS..];
        angles.iter().sum::<f64>() / angles.len().max(1) as f64
    }

    /// The same of a frame beside the last one in which nothing was measured: what was uncertain there, and the prior's
    /// variance again.
    pub fn unmeasured_deviations(&self, before: &mut Uncertainty, all: &mut [f64]) -> f64 {
        let dofs = all.len();
        for (d, sigma) in all.iter_mut().enumerate() {
            *sigma = self.prior.covariance[d * dofs + d].sqrt();
        }
        before.update(|d| self.prior.covariance[d * dofs + d], all);
        let angles = &all[kinematics::ROOT_DOFS..];
        angles.iter().sum::<f64>() / angles.len().max(1) as f64
    }

    /// Adds what the last frame tells about the performer's zero pose, beyond what is assumed of it, weighted by `share`.
    pub fn add_zero_pose_information(&mut self, share: f64, information: &mut ZeroPoseInformation) {
        let dofs = self.prior.mean.len();
        let controls = (!self.query.control_factors.is_empty()
            && self.problem.parameters.control_points_in_query)
            .then_some((&*self.problem.table, &self.query.control_factors[..]));
        let examples =
            self.examples.gather(self.problem.database, self.problem.index, &self.neighbours, controls);
        let mut weights = vec![0.0; examples.len()];
        regression::kernel_weights(
            examples.distances_squared,
            self.problem.parameters.bandwidth,
            &mut weights,
        );
        // The neighbours' poses: mean, and deviations times the roots of their weights.
        let pose = |k: usize| examples.target(k).iter().zip(&self.local).map(|(t, f)| t * f);
        let mut mean = DVector::<f64>::zeros(dofs);
        for (k, weight) in weights.iter().enumerate() {
            mean.iter_mut().zip(pose(k)).for_each(|(m, x)| *m += weight * x);
        }
        let mut spread = DMatrix::<f64>::zeros(examples.len() + dofs, dofs);
        for (k, weight) in weights.iter().enumerate() {
            for (d, x) in pose(k).enumerate() {
                spread[(k, d)] = weight.sqrt() * (x - mean[d]);
            }
        }
        for (d, per_unit) in self.problem.index.scale().per_dof.iter().enumerate() {
            spread[(examples.len() + d, d)] = self.problem.parameters.min_sigma_deg / per_unit;
        }
        let found = DVector::from_column_slice(self.solver.coordinates());
        let mut residuals = vec![0.0; 3 * self.query.measured.len()];
        let mut jacobian = vec![0.0; residuals.len() * dofs];
        let (rows, _) = self.likelihood.residuals(
            &self.problem.kinematics,
            self.solver.coordinates(),
            &self.query.measured,
            &mut residuals,
        );
        if rows == 0 {
            return;
        }
        self.likelihood.jacobian(&self.problem.kinematics, &self.query.measured, &mut jacobian);
        let jacobian = DMatrix::from_row_slice(rows, dofs, &jacobian[..rows * dofs]);
        let residual = DVector::from_column_slice(&residuals[..rows]) + &jacobian * (found - mean);
        let spread = &jacobian * spread.transpose();
        let mut covariance = &spread * spread.transpose();
        for (i, m) in self.query.measured.iter().flatten().enumerate() {
            for axis in 3 * i..3 * i + 3 {
                covariance[(axis, axis)] += m.sigma.max(MIN_ZERO_POSE_SIGMA_M).powi(2);
            }
        }
        let Some(factor) = covariance.cholesky() else { return };
        information.precision += share * jacobian.transpose() * factor.solve(&jacobian);
        information.vector += share * jacobian.transpose() * factor.solve(&residual);
    }

    fn find_neighbours(&mut self, track: &mut Track) {
        self.query.take_window(track);
        self.begin(FramePart::Search);
        let Problem { index, parameters, .. } = self.problem;
        let query = self.query.question(&track.matches);
        let (k, scratch, found) = (parameters.neighbours, &mut self.search, &mut self.neighbours);
        match parameters.search {
            Search::Exact => index.nearest(&query, k, scratch, found),
            Search::Fast => {
                index.nearest_fast(&query, k, scratch, found);
            }
        }
    }

    fn predict(&mut self) {
        let controls = self
            .problem
            .parameters
            .control_points_in_query
            .then_some((&*self.problem.table, &self.query.control_factors[..]));
        let examples =
            self.examples.gather(self.problem.database, self.problem.index, &self.neighbours, controls);
        let query = regression::Query { inputs: &self.query.inputs, recent: &self.query.recent };
        self.predictor.predict(
            &examples,
            &query,
            &self.problem.parameters.regression(),
            &mut self.prediction,
        );
    }

    /// The prediction as a prior: from degrees and centimetres at the database's scale to radians and metres at the
    /// performer's.
    fn set_prior(&mut self) {
        let dofs = self.prior.mean.len();
        for (d, per_unit) in self.problem.index.scale().per_dof.iter().enumerate() {
            let factor = if d < 3 { 1.0 / (per_unit * self.scale) } else { 1.0 / per_unit };
            self.local[d] = factor;
            self.prior.mean[d] = self.prediction.mean[d] * factor + self.problem.zero_pose[d];
            self.sigma[d] = self.prediction.sigma[d] * factor;
        }
        let residuals = &mut self.prediction.residuals[..self.prediction.rows * dofs];
        for row in residuals.chunks_exact_mut(dofs) {
            for (r, factor) in row.iter_mut().zip(&self.local) {
                *r *= factor;
            }
        }
        match self.problem.parameters.covariance {
            Covariance::Full => self.prior.set_full(residuals, &self.sigma),
            Covariance::Diagonal => self.prior.set_diagonal(residuals, &self.sigma),
        }
    }
}
