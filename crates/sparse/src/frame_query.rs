use model::{PointTrajectories, Samples};
use motion_db::{HeadingFrame, Query};
use nalgebra::Vector3;
use posterior::Measurement;

use crate::problem::Problem;
use crate::track::Track;

/// Standard deviations of samples are taken into this range, metres: beyond it the solver's arithmetic ends.
const MIN_SIGMA_M: f64 = 1e-5;
const MAX_SIGMA_M: f64 = 1e3;
/// Standard deviation of a sample, metres, up to which it counts in full in the search and the regression; beyond, its
/// weight falls with the inverse. Neighbours are a few degrees away, which one centimetre of a control point is compared
/// with: two of noise do not lead the search astray.
const SEARCH_SIGMA_M: f64 = 0.02;
/// What a point in a frame around counts for in search and regression, relative to one in the frame itself.
const AROUND_WEIGHT: f64 = 0.5;

/// What is looked for in a frame: the window of the last poses and the measured points, in the heading frame of the last
/// pose.
pub(crate) struct FrameQuery<'a> {
    problem: &'a Problem<'a>,
    /// database translation per session translation
    scale: f64,
    root_offset: Vector3<f64>,
    scaled_history: Vec<Vec<f64>>,
    features: Vec<f64>,
    /// the window in the units and the frame of the targets
    pub recent: Vec<f64>,
    /// window features and, if they join, control points
    pub inputs: Vec<f64>,
    window_single: Vec<f32>,
    controls: Vec<f32>,
    control_weights: Vec<f32>,
    pub control_factors: Vec<f64>,
    /// shape `[points]`
    pub measured: Vec<Option<Measurement>>,
}

impl<'a> FrameQuery<'a> {
    /// Room for the queries of a problem; `width` numbers are the inputs of an example, `scale` is database translation per
    /// session translation.
    pub fn new(problem: &'a Problem<'a>, width: usize, scale: f64) -> Self {
        let (dofs, points) = (problem.database.num_dofs(), problem.points.len());
        let num_controls = problem.num_controls();
        let mut control_weights = vec![0.0; num_controls + 1];
        control_weights[num_controls] = problem.parameters.skeleton_weight.powi(2) as f32;
        Self {
            problem,
            scale,
            root_offset: problem.session.skeleton.joints()[0].offset,
            scaled_history: vec![vec![0.0; dofs]; problem.parameters.window],
            features: vec![0.0; problem.index.width()],
            recent: vec![0.0; problem.index.width()],
            inputs: vec![0.0; width],
            window_single: vec![0.0; problem.index.width()],
            controls: vec![0.0; num_controls + 1],
            control_weights,
            control_factors: vec![0.0; num_controls],
            measured: vec![None; points],
        }
    }

    /// Brings the measurements into the heading frame, for the solver and for the search.
    pub fn measure(&mut self, frame: &HeadingFrame, samples: Samples<'_>) {
        let floor = Vector3::new(self.root_offset.x, 0.0, self.root_offset.z);
        for (p, world) in samples.positions.iter().enumerate() {
            let is_measured = world.x.is_finite();
            let local = if is_measured { frame.local_from_world(&(world - floor)) } else { Vector3::zeros() };
            let sigma = samples.sigma(p).unwrap_or(self.problem.parameters.control_sigma_m);
            let sigma = sigma.clamp(MIN_SIGMA_M, MAX_SIGMA_M);
            self.measured[p] = is_measured.then(|| Measurement { position: local + floor, sigma });
            self.compare(p, &local, is_measured.then_some(sigma), self.problem.parameters.control_weight);
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
    pub fn measure_around(&mut self, frame: &HeadingFrame, trajectories: &PointTrajectories, now: usize) {
        let floor = Vector3::new(self.root_offset.x, 0.0, self.root_offset.z);
        let points = self.measured.len();
        for (block, away) in self.problem.around.iter().enumerate() {
            let at = now.checked_add_signed(*away as isize).filter(|f| *f < trajectories.num_frames());
            for p in 0..points {
                let position = at.and_then(|f| trajectories.position(f, p));
                let local = position.map_or_else(Vector3::zeros, |w| frame.local_from_world(&(w - floor)));
                let sigma = at
                    .and_then(|f| trajectories.sigma(f, p))
                    .unwrap_or(self.problem.parameters.control_sigma_m);
                let weight = AROUND_WEIGHT * self.problem.parameters.control_weight;
                self.compare(points * (1 + block) + p, &local, position.map(|_| sigma), weight);
            }
        }
    }

    /// The window of a track joins what was measured; the successors of its last matches become the hints.
    pub fn take_window(&mut self, track: &mut Track) {
        let Problem { index, parameters, zero_pose, .. } = self.problem;
        for (scaled, pose) in self.scaled_history.iter_mut().zip(&track.history) {
            scaled.copy_from_slice(pose);
            scaled[..3].iter_mut().for_each(|v| *v *= self.scale);
            scaled.iter_mut().zip(zero_pose).for_each(|(v, o)| *v -= o);
        }
        let mut poses: [&[f64]; 16] = [&[]; 16];
        for (slot, pose) in poses.iter_mut().zip(&self.scaled_history) {
            *slot = pose;
        }
        let (window, controls) = self.inputs.split_at_mut(index.width());
        index.query_features(&poses[..parameters.window], &mut self.features, window);
        index.scale().window_features(&poses[..parameters.window], &mut self.recent);
        for ((out, c), f) in controls.iter_mut().zip(&self.controls).zip(&self.control_factors) {
            *out = f64::from(*c) * f;
        }
        for (single, v) in self.window_single.iter_mut().zip(window) {
            *single = *v as f32;
        }
        // The successors of the last matches are near now.
        track.matches.iter_mut().for_each(|row| *row += 1);
        track.matches.sort_unstable();
        if !parameters.control_points_in_query {
            let points = self.control_weights.len() - 1;
            self.control_weights[..points].fill(0.0);
        }
    }

    /// What the search is asked, near `hints`.
    pub fn question<'q>(&'q self, hints: &'q [usize]) -> Query<'q> {
        let controls = Some((&*self.problem.table, &self.controls[..], &self.control_weights[..]));
        Query { features: &self.window_single, controls, exclude: &self.problem.exclude_rows, hints }
    }
}
