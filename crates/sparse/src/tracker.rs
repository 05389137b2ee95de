use std::ops::Range;

use kinematics::Kinematics;
use model::Samples;
use motion_db::{
    ControlTable, HeadingFrame, MotionDatabase, Neighbour, Query, Scratch, SkeletonSize, StartPose,
    WindowIndex,
};
use nalgebra::Vector3;
use posterior::{ControlPoints, GaussianPrior, MapSolver, Measurement, Solution};
use regression::gplvm::TrainingOptions;
use regression::{Prediction, Predictor};

use crate::examples::ExampleBuffer;
use crate::methods::predictor;
use crate::{Covariance, Parameters, Reconstructor, Result, Stage};

/// Standard deviations of samples are taken into this range, metres: beyond it the solver's arithmetic ends.
const MIN_SIGMA_M: f64 = 1e-5;
const MAX_SIGMA_M: f64 = 1e3;
/// Standard deviation of a sample, metres, up to which it counts in full in the search and the regression; beyond, its
/// weight falls with the inverse. Neighbours are a few degrees away, which one centimetre of a control point is compared
/// with: two of noise do not lead the search astray.
const SEARCH_SIGMA_M: f64 = 0.02;

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
    watcher: Option<&'a (dyn Fn(Stage) + Sync)>,
}

impl<'a> Tracker<'a> {
    /// A tracker of the session, database and exclusions of `reconstructor`.
    ///
    /// # Errors
    /// If the method's model is missing.
    pub fn new(reconstructor: &'a Reconstructor<'_>) -> Result<Self> {
        let Reconstructor { database, index, session, parameters, kinematics, points, table, .. } =
            reconstructor;
        let dofs = database.num_dofs();
        let k = parameters.neighbours;
        let num_controls = 3 * points.len();
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
            let root = Vector3::new(pose[0], 0.0, pose[2]) + self.root_offset;
            let root = turned.world_from_local(&root) - self.root_offset;
            pose[0] = root.x + start.shift[0];
            pose[2] = root.z + start.shift[1];
            pose[kinematics::HEADING] += start.turn;
        }
        track.matches.clear();
    }

    /// Takes `track` one frame further with what was measured in that frame.
    pub fn step(&mut self, track: &mut Track, measured: Samples<'_>) -> Step {
        self.begin(Stage::Query);
        let frame = HeadingFrame::of(track.newest());
        self.measure(&frame, measured);
        self.find_neighbours(track);
        self.begin(Stage::Prior);
        self.predict();
        let mut solution = self.solve();
        while self.relinearise(&solution) {
            solution = self.solve();
        }
        self.begin(Stage::Rest);
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

    /// Tells the watcher, if there is one, that a stage begins.
    #[inline]
    pub fn begin(&self, stage: Stage) {
        if let Some(watcher) = self.watcher {
            watcher(stage);
        }
    }

    /// The most probable pose between prediction and measurement.
    fn solve(&mut self) -> Solution {
        self.set_prior();
        self.begin(Stage::Map);
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
        for ((out, x), factor) in self.found.iter_mut().zip(self.solver.coordinates()).zip(&self.local) {
            *out = x / factor;
        }
        self.predictor.relinearise(&self.found, solution.likelihood_energy, &mut self.prediction)
    }

    /// Mean posterior standard deviation over the joint angles of the last step, radians; `all` receives every
    /// coordinate's, shape `[dofs]`.
    pub fn standard_deviations(&mut self, all: &mut [f64]) -> f64 {
        self.solver.standard_deviations(
            self.kinematics,
            &mut self.likelihood,
            &self.measured,
            &self.prior,
            all,
        );
        let angles = &all[kinematics::ROOT_DOFS..];
        angles.iter().sum::<f64>() / angles.len().max(1) as f64
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
            let trust = if is_measured { (SEARCH_SIGMA_M / sigma).min(1.0) } else { 0.0 };
            let factor = trust * self.parameters.control_weight;
            for i in 0..3 {
                self.controls[3 * p + i] = (local[i] * 100.0) as f32;
                self.control_weights[3 * p + i] = (factor * factor) as f32;
                self.control_factors[3 * p + i] = factor;
            }
        }
    }

    fn find_neighbours(&mut self, track: &mut Track) {
        for (scaled, pose) in self.scaled_history.iter_mut().zip(&track.history) {
            scaled.copy_from_slice(pose);
            scaled[..3].iter_mut().for_each(|v| *v *= self.scale);
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
        self.begin(Stage::Search);
        self.index.nearest(&query, self.parameters.neighbours, &mut self.search, &mut self.neighbours);
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
            self.prior.mean[d] = self.prediction.mean[d] * factor;
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
