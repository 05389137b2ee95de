use std::ops::Range;

use kinematics::Kinematics;
use model::{PointTrajectories, Samples};
use motion_db::{
    ControlTable, HeadingFrame, MotionDatabase, Neighbour, Query, Scratch, SkeletonSize, StartPose,
    WindowIndex,
};
use nalgebra::{DMatrix, DVector, Vector3};
use posterior::{ControlPoints, GaussianPrior, MapSolver, Measurement, Solution};
use regression::gplvm::TrainingOptions;
use regression::{Prediction, Predictor};

use crate::examples::ExampleBuffer;
use crate::methods::predictor;
use crate::uncertainty::Uncertainty;
use crate::zero_pose::Information;
use crate::{Covariance, FramePart, Parameters, Reconstructor, Result, Search};

/// Standard deviations of samples are taken into this range, metres: beyond it the solver's arithmetic ends.
const MIN_SIGMA_M: f64 = 1e-5;
const MAX_SIGMA_M: f64 = 1e3;
/// Standard deviation of a sample, metres, up to which it counts in full in the search and the regression; beyond, its
/// weight falls with the inverse. Neighbours are a few degrees away, which one centimetre of a control point is compared
/// with: two of noise do not lead the search astray.
const SEARCH_SIGMA_M: f64 = 0.02;
/// Least standard deviation of a point, metres, where a zero pose is learned: bone lengths are no better known.
const MIN_ZERO_POSE_SIGMA_M: f64 = 0.005;
/// What a point in a frame around counts for in search and regression, relative to one in the frame itself.
const AROUND_WEIGHT: f64 = 0.5;

/// What was measured at a frame.
#[derive(Debug, Clone, Copy)]
pub struct Observed<'a> {
    pub now: Samples<'a>,
    /// all that was measured, and the index of the frame, where the frames around it join the search
    pub session: Option<(&'a PointTrajectories, usize)>,
}

/// What is known of the person at a frame: the last m poses, newest first, in world coordinates (metres, radians,
/// the performer's scale), and the rows that matched last.
#[derive(Debug, Clone)]
pub struct Track {
    pub history: Vec<Vec<f64>>,
    pub matches: Vec<usize>,
}

impl Track {
    /// Room for a track under `parameters`; it stands nowhere yet.
    pub fn blank(dofs: usize, parameters: &Parameters) -> Self {
        Self {
            history: vec![vec![0.0; dofs]; parameters.window],
            matches: Vec::with_capacity(parameters.neighbours),
        }
    }

    pub fn newest(&self) -> &[f64] {
        &self.history[0]
    }

    /// Becomes a copy of `other`, a track with as many poses, in the memory there is.
    pub fn copy_from(&mut self, other: &Self) {
        for (to, from) in self.history.iter_mut().zip(&other.history) {
            to.copy_from_slice(from);
        }
        self.matches.clone_from(&other.matches);
    }
}

/// One frame's outcome.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    pub solution: Solution,
    /// coordinates that were measured, three a point
    pub measured: usize,
    /// distance of the nearest window, degrees and centimetres per root of the number of features
    pub neighbour_distance: f64,
}

impl Step {
    /// Energy per measured coordinate: about 1 when measurement and prediction agree within their uncertainties.
    pub fn energy(&self) -> f64 {
        if self.measured == 0 {
            return 0.0;
        }
        (self.solution.likelihood_energy + self.solution.prior_energy) / self.measured as f64
    }
}

/// The pieces that take a [`Track`] one frame further, with all their memory.
pub struct Tracker<'a> {
    database: &'a MotionDatabase,
    index: &'a WindowIndex,
    pub table: &'a ControlTable,
    parameters: &'a Parameters,
    kinematics: &'a Kinematics,
    /// the performer's, radians
    zero_pose: &'a [f64],
    around: &'a [i32],
    /// database translation per session translation
    scale: f64,
    root_offset: Vector3<f64>,
    exclude: &'a [Range<usize>],
    predictor: Box<dyn Predictor + 'a>,
    prediction: Prediction,
    examples: ExampleBuffer,
    prior: GaussianPrior,
    sigma: Vec<f64>,
    likelihood: ControlPoints,
    solver: MapSolver,
    search: Scratch,
    neighbours: Vec<Neighbour>,
    // Query: window features in double and single precision, control points.
    scaled_history: Vec<Vec<f64>>,
    features: Vec<f64>,
    /// the window in the units and the frame of the targets
    recent: Vec<f64>,
    query: Vec<f64>,
    query_single: Vec<f32>,
    controls: Vec<f32>,
    control_weights: Vec<f32>,
    control_factors: Vec<f64>,
    measured: Vec<Option<Measurement>>,
    local: Vec<f64>,
    found: Vec<f64>,
    watcher: Option<&'a (dyn Fn(FramePart) + Sync)>,
}

impl<'a> Tracker<'a> {
    /// A tracker of the session, database and exclusions of `reconstructor`.
    ///
    /// # Errors
    /// If the method's model is missing.
    pub fn new(reconstructor: &'a Reconstructor<'_>) -> Result<Self> {
        let Reconstructor { database, index, session, parameters, kinematics, points, table, .. } =
            reconstructor;
        let around = reconstructor.around;
        let dofs = database.num_dofs();
        let k = parameters.neighbours;
        let num_controls = 3 * points.len() * (1 + around.len());
        let width = index.width() + if parameters.control_points_in_query { num_controls } else { 0 };
        let mut control_weights = vec![0.0; num_controls + 1];
        control_weights[num_controls] = parameters.skeleton_weight.powi(2) as f32;
        Ok(Self {
            scale: database.leg_length() / SkeletonSize::leg_length(&session.skeleton),
            root_offset: session.skeleton.joints()[0].offset,
            predictor: predictor(reconstructor, width)?,
            prediction: Prediction::new(k.max(TrainingOptions::MOST_LATENT_DIMS), dofs),
            examples: ExampleBuffer::new(k, width, dofs),
            prior: GaussianPrior::new(dofs),
            sigma: vec![0.0; dofs],
            likelihood: ControlPoints::new(kinematics, points.clone()),
            solver: MapSolver::new(points.len(), dofs),
            search: Scratch::default(),
            neighbours: Vec::with_capacity(k),
            scaled_history: vec![vec![0.0; dofs]; parameters.window],
            features: vec![0.0; index.width()],
            recent: vec![0.0; index.width()],
            query: vec![0.0; width],
            query_single: vec![0.0; index.width()],
            controls: vec![0.0; num_controls + 1],
            control_weights,
            control_factors: vec![0.0; num_controls],
            measured: vec![None; points.len()],
            local: vec![0.0; dofs],
            found: vec![0.0; dofs],
            database,
            index,
            table,
            parameters,
            kinematics,
            zero_pose: &reconstructor.zero_pose,
            around,
            exclude: &reconstructor.exclude_rows,
            watcher: reconstructor.watcher,
        })
    }

    /// A track that stands where a start pose of the database was put.
    pub fn track_from(&self, start: &StartPose) -> Track {
        let mut track = Track::blank(self.database.num_dofs(), self.parameters);
        self.place(start, &mut track);
        track
    }

    /// Makes `track` stand where a start pose of the database was put.
    pub fn place(&self, start: &StartPose, track: &mut Track) {
        // The shift was found for points, which hang from the root's offset.
        let turned = HeadingFrame::new(0.0, 0.0, start.turn);
        for (back, pose) in track.history.iter_mut().enumerate() {
            self.database.copy_pose(start.pose - 1 - back, pose);
            pose[..3].iter_mut().for_each(|v| *v /= self.scale);
            pose.iter_mut().zip(self.zero_pose).for_each(|(v, o)| *v += o);
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
        self.measure(&frame, observed.now);
        if let Some((trajectories, now)) = observed.session {
            self.measure_around(&frame, trajectories, now);
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
        self.kinematics.parametrisation().wrap(newest);
        track.matches.clear();
        track.matches.extend(self.neighbours.iter().map(|n| n.row));
        let measured = 3 * self.measured.iter().flatten().count();
        let nearest = self.neighbours.first().map_or(f64::INFINITY, |n| n.distance_squared);
        Step { solution, measured, neighbour_distance: (nearest / self.query.len() as f64).sqrt() }
    }

    /// Tells the watcher, if there is one, that a part begins.
    #[inline]
    pub fn begin(&self, part: FramePart) {
        if let Some(watcher) = self.watcher {
            watcher(part);
        }
    }

    /// The most probable pose between prediction and measurement.
    fn solve(&mut self) -> Solution {
        self.set_prior();
        self.begin(FramePart::Map);
        self.solver.solve(
            self.kinematics,
            &mut self.likelihood,
            &self.measured,
            &self.prior,
            &self.parameters.solver(),
        )
    }

    /// Whether the prediction, seen from the pose found, has changed.
    fn relinearise(&mut self, solution: &Solution) -> bool {
        let neutral = self.solver.coordinates().iter().zip(self.zero_pose).map(|(x, o)| x - o);
        for ((out, x), factor) in self.found.iter_mut().zip(neutral).zip(&self.local) {
            *out = x / factor;
        }
        self.predictor.relinearise(&self.found, solution.likelihood_energy, &mut self.prediction)
    }

    /// Mean posterior standard deviation over the joint angles of the last step, radians; `all` receives every
    /// coordinate's, shape `[dofs]`. `before` is what was uncertain of the frames before.
    pub fn standard_deviations(&mut self, before: &mut Uncertainty, all: &mut [f64]) -> f64 {
        self.solver.standard_deviations(
            self.kinematics,
            &mut self.likelihood,
            &self.measured,
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

    /// Adds what the last frame says of the performer's zero pose, beside what is assumed of it, counted `share` times.
    pub fn add_zero_pose_information(&mut self, share: f64, information: &mut Information) {
        let dofs = self.prior.mean.len();
        let controls = (!self.control_factors.is_empty() && self.parameters.control_points_in_query)
            .then_some((self.table, &self.control_factors[..]));
        let examples = self.examples.gather(self.database, self.index, &self.neighbours, controls);
        let mut weights = vec![0.0; examples.len()];
        regression::kernel_weights(examples.distances_squared, self.parameters.bandwidth, &mut weights);
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
        for (d, per_unit) in self.index.scale().per_dof.iter().enumerate() {
            spread[(examples.len() + d, d)] = self.parameters.min_sigma_deg / per_unit;
        }
        let found = DVector::from_column_slice(self.solver.coordinates());
        let mut residuals = vec![0.0; 3 * self.measured.len()];
        let mut jacobian = vec![0.0; residuals.len() * dofs];
        let (rows, _) = self.likelihood.residuals(
            self.kinematics,
            self.solver.coordinates(),
            &self.measured,
            &mut residuals,
        );
        if rows == 0 {
            return;
        }
        self.likelihood.jacobian(self.kinematics, &self.measured, &mut jacobian);
        let jacobian = DMatrix::from_row_slice(rows, dofs, &jacobian[..rows * dofs]);
        let residual = DVector::from_column_slice(&residuals[..rows]) + &jacobian * (found - mean);
        let spread = &jacobian * spread.transpose();
        let mut covariance = &spread * spread.transpose();
        for (i, m) in self.measured.iter().flatten().enumerate() {
            for axis in 3 * i..3 * i + 3 {
                covariance[(axis, axis)] += m.sigma.max(MIN_ZERO_POSE_SIGMA_M).powi(2);
            }
        }
        let Some(factor) = covariance.cholesky() else { return };
        information.precision += share * jacobian.transpose() * factor.solve(&jacobian);
        information.vector += share * jacobian.transpose() * factor.solve(&residual);
    }

    /// Brings the measurements into the heading frame, for the solver and for the search.
    fn measure(&mut self, frame: &HeadingFrame, samples: Samples<'_>) {
        let floor = Vector3::new(self.root_offset.x, 0.0, self.root_offset.z);
        for (p, world) in samples.positions.iter().enumerate() {
            let is_measured = world.x.is_finite();
            let local = if is_measured { frame.local_from_world(&(world - floor)) } else { Vector3::zeros() };
            let sigma = samples.sigma(p).unwrap_or(self.parameters.control_sigma_m);
            let sigma = sigma.clamp(MIN_SIGMA_M, MAX_SIGMA_M);
            self.measured[p] = is_measured.then(|| Measurement { position: local + floor, sigma });
            self.compare(p, &local, is_measured.then_some(sigma), self.parameters.control_weight);
        }
    }

    /// Puts a point (metres, relative to the heading frame) into slot `slot` of the query.
    fn compare(&mut self, slot: usize, local: &Vector3<f64>, sigma: Option<f64>, weight: f64) {
        let trust = sigma.map_or(0.0, |sigma| (SEARCH_SIGMA_M / sigma).min(1.0));
        let factor = trust * weight;
        for i in 0..3 {
            self.controls[3 * slot + i] = (local[i] * 100.0) as f32;
            self.control_weights[3 * slot + i] = (factor * factor) as f32;
            self.control_factors[3 * slot + i] = factor;
        }
    }

    /// What was measured in the frames around frame `now` joins the query.
    fn measure_around(&mut self, frame: &HeadingFrame, trajectories: &PointTrajectories, now: usize) {
        let floor = Vector3::new(self.root_offset.x, 0.0, self.root_offset.z);
        let points = self.measured.len();
        for (block, away) in self.around.iter().enumerate() {
            let at = now.checked_add_signed(*away as isize).filter(|f| *f < trajectories.num_frames());
            for p in 0..points {
                let position = at.and_then(|f| trajectories.position(f, p));
                let local = position.map_or_else(Vector3::zeros, |w| frame.local_from_world(&(w - floor)));
                let sigma =
                    at.and_then(|f| trajectories.sigma(f, p)).unwrap_or(self.parameters.control_sigma_m);
                let weight = AROUND_WEIGHT * self.parameters.control_weight;
                self.compare(points * (1 + block) + p, &local, position.map(|_| sigma), weight);
            }
        }
    }

    fn find_neighbours(&mut self, track: &mut Track) {
        for (scaled, pose) in self.scaled_history.iter_mut().zip(&track.history) {
            scaled.copy_from_slice(pose);
            scaled[..3].iter_mut().for_each(|v| *v *= self.scale);
            scaled.iter_mut().zip(self.zero_pose).for_each(|(v, o)| *v -= o);
        }
        let mut poses: [&[f64]; 16] = [&[]; 16];
        for (slot, pose) in poses.iter_mut().zip(&self.scaled_history) {
            *slot = pose;
        }
        let (window, controls) = self.query.split_at_mut(self.index.width());
        self.index.query_features(&poses[..self.parameters.window], &mut self.features, window);
        self.index.scale().window_features(&poses[..self.parameters.window], &mut self.recent);
        for ((out, c), f) in controls.iter_mut().zip(&self.controls).zip(&self.control_factors) {
            *out = f64::from(*c) * f;
        }
        for (single, v) in self.query_single.iter_mut().zip(window) {
            *single = *v as f32;
        }
        // The successors of the last matches are near now.
        track.matches.iter_mut().for_each(|row| *row += 1);
        track.matches.sort_unstable();
        if !self.parameters.control_points_in_query {
            let points = self.control_weights.len() - 1;
            self.control_weights[..points].fill(0.0);
        }
        let controls = Some((self.table, &self.controls[..], &self.control_weights[..]));
        let query =
            Query { features: &self.query_single, controls, exclude: self.exclude, hints: &track.matches };
        self.begin(FramePart::Search);
        let (k, scratch, found) = (self.parameters.neighbours, &mut self.search, &mut self.neighbours);
        match self.parameters.search {
            Search::Exact => self.index.nearest(&query, k, scratch, found),
            Search::Fast => {
                self.index.nearest_fast(&query, k, scratch, found);
            }
        }
    }

    fn predict(&mut self) {
        let controls =
            self.parameters.control_points_in_query.then_some((self.table, &self.control_factors[..]));
        let examples = self.examples.gather(self.database, self.index, &self.neighbours, controls);
        let query = regression::Query { inputs: &self.query, recent: &self.recent };
        self.predictor.predict(&examples, &query, &self.parameters.regression(), &mut self.prediction);
    }

    /// The prediction as a prior: from degrees and centimetres at the database's scale to radians and metres at the
    /// performer's.
    fn set_prior(&mut self) {
        let dofs = self.prior.mean.len();
        for (d, per_unit) in self.index.scale().per_dof.iter().enumerate() {
            let factor = if d < 3 { 1.0 / (per_unit * self.scale) } else { 1.0 / per_unit };
            self.local[d] = factor;
            self.prior.mean[d] = self.prediction.mean[d] * factor + self.zero_pose[d];
            self.sigma[d] = self.prediction.sigma[d] * factor;
        }
        let residuals = &mut self.prediction.residuals[..self.prediction.rows * dofs];
        for row in residuals.chunks_exact_mut(dofs) {
            for (r, factor) in row.iter_mut().zip(&self.local) {
                *r *= factor;
            }
        }
        match self.parameters.covariance {
            Covariance::Full => self.prior.set_full(residuals, &self.sigma),
            Covariance::Diagonal => self.prior.set_diagonal(residuals, &self.sigma),
        }
    }
}
