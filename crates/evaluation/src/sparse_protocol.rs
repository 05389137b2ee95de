//! Trials reconstructed from their own control points.

use std::sync::atomic::{AtomicUsize, Ordering};

use contacts::{HoldSettings, hold_feet};
use kinematics::control_points;
use model::Motion;
use motion_db::{Clip, ClipInfo, MotionDatabase, WindowIndex};
use rayon::prelude::*;
use serde::Serialize;
use sparse::{Parameters, Reconstruction, Reconstructor, Session};

use crate::{
    Calibration, Case, Comparison, ContactThresholds, ControlSet, Error, FootPaths, FootSlide, Gap,
    GapErrors, SparseEvaluation, at_database_rate, compare_in_detail, control_trajectories,
    disturbance::disturbed, foot_slide, gap::gap_errors, models::Models, subset::first_clips,
};

/// One trial in one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialResult {
    /// the case
    #[serde(flatten)]
    pub case: Case,
    /// name of the trial
    pub trial: String,
    /// who moved
    pub subject: String,
    /// what was done in it
    pub action: String,
    /// its errors, by frame and by joint
    #[serde(flatten)]
    pub comparison: Comparison,
    /// how far its feet slide; `None` where the skeleton has no feet of known names
    pub foot_slide: Option<FootSlide>,
    /// whether errors are as large as stated
    pub calibration: Option<Calibration>,
    /// where points were hidden
    pub gap: Option<Gap>,
    /// what that cost
    pub gap_errors: Option<GapErrors>,
    /// seconds that the frames took: search, regression and MAP, start included
    pub seconds: f64,
}

/// Reconstructs every trial from its own control points, in every case of the sweep, and compares. Results are in the
/// order of databases, variants, points, noises, gaps, methods and trials. A trial too short for a gap is left out of the cases with it.
///
/// `seconds` reads a clock (this crate has none); `progress` is called after each trial with the number done and the number in all.
///
/// # Errors
/// If the sweep asks for what there is not, the database cannot be built, or a trial cannot be reconstructed.
pub fn evaluate_sparse(
    evaluation: &SparseEvaluation<'_>,
    seconds: &(dyn Fn() -> f64 + Sync),
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<TrialResult>, Error> {
    let sweep = &evaluation.sweep;
    sweep.check()?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(evaluation.threads.max(1))
        .build()
        .map_err(|error| Error::Threads { wanted: evaluation.threads, problem: error.to_string() })?;
    let total = sweep.database_sizes.len() * sweep.cases_per_database() * evaluation.test.len();
    let done = AtomicUsize::new(0);
    let mut results = Vec::with_capacity(total);
    for &size in &sweep.database_sizes {
        let (clips, poses) = first_clips(evaluation.train, size.unwrap_or(usize::MAX));
        let database = MotionDatabase::build(clips)?;
        let models = Models::train(evaluation, &database, &pool)?;
        let cases = sweep.cases(poses);
        let mut size_results: Vec<Option<TrialResult>> = Vec::new();
        size_results.resize_with(cases.len() * evaluation.test.len(), || None);
        let mut windows: Vec<usize> = cases.iter().map(|(case, _)| case.window).collect();
        windows.sort_unstable();
        windows.dedup();
        for window in windows {
            let bench = Bench { evaluation, database: &database, window, models: &models, seconds };
            let after_each = || progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
            for (task, result) in pool.install(|| bench.run_all(&cases, &after_each)) {
                let in_trial = |source| Error::Trial { trial: task.clip.name.clone(), source };
                size_results[task.place] = result.map_err(in_trial)?;
            }
        }
        results.extend(size_results.into_iter().flatten());
    }
    compare_gaps(&mut results);
    Ok(results)
}

/// One trial to be reconstructed in one case.
#[derive(Debug, Clone, Copy)]
struct Task<'a> {
    /// where its result belongs
    place: usize,
    case: &'a Case,
    parameters: &'a Parameters,
    /// which of the trials
    trial: usize,
    clip: &'a Clip,
}

/// What all trials of one database and window share.
struct Bench<'a> {
    evaluation: &'a SparseEvaluation<'a>,
    /// with all clips
    database: &'a MotionDatabase,
    window: usize,
    models: &'a Models,
    seconds: &'a (dyn Fn() -> f64 + Sync),
}

/// What may be used for one trial.
struct Allowed {
    database: MotionDatabase,
    index: WindowIndex,
}

impl<'a> Bench<'a> {
    /// Runs all cases with this window, on the threads of the current pool.
    fn run_all(
        &self,
        cases: &'a [(Case, usize)],
        after_each: &(dyn Fn() + Sync),
    ) -> Vec<(Task<'a>, Result<Option<TrialResult>, sparse::Error>)> {
        let groups = self.tasks(cases);
        let found: Vec<Vec<_>> = groups
            .par_iter()
            .map(|tasks| {
                let allowed = self.allowed(tasks[0].clip);
                tasks
                    .par_iter()
                    .map(|task| {
                        let result = match &allowed {
                            Ok(allowed) => self.run(task, allowed),
                            Err(error) => Err(error.clone().into()),
                        };
                        after_each();
                        (*task, result)
                    })
                    .collect()
            })
            .collect();
        found.into_iter().flatten().collect()
    }

    /// A database without what the protocol leaves out for this trial: nothing in it, nor what is learned of performers,
    /// has seen the trial.
    fn allowed(&self, clip: &Clip) -> Result<Allowed, motion_db::Error> {
        let leaves_out =
            |other: &ClipInfo| self.evaluation.protocol.leaves_out(&clip.name, &clip.subject, other);
        let database = self.database.without(leaves_out)?;
        let index = WindowIndex::new(&database, self.window)?;
        Ok(Allowed { database, index })
    }

    /// Tasks by what is left out of the database for them.
    fn tasks(&self, cases: &'a [(Case, usize)]) -> Vec<Vec<Task<'a>>> {
        let SparseEvaluation { test, sweep, protocol, .. } = self.evaluation;
        let mut groups: Vec<Vec<Task<'a>>> = Vec::new();
        let has_window = |(_, (case, _)): &(usize, &'a (Case, usize))| case.window == self.window;
        for (c, (case, variant)) in cases.iter().enumerate().filter(has_window) {
            let parameters = &sweep.variants[*variant].parameters;
            for (trial, clip) in test.iter().enumerate() {
                let task = Task { place: c * test.len() + trial, case, parameters, trial, clip };
                let is_like = |group: &&mut Vec<Task<'a>>| protocol.leaves_out_the_same(group[0].clip, clip);
                match groups.iter_mut().find(is_like) {
                    Some(group) => group.push(task),
                    None => groups.push(vec![task]),
                }
            }
        }
        groups
    }

    /// `None` if the trial is too short for the case's gap.
    fn run(&self, task: &Task<'_>, allowed: &Allowed) -> Result<Option<TrialResult>, sparse::Error> {
        let Self { evaluation, models, seconds, .. } = self;
        let Allowed { database, index } = allowed;
        let Task { case, parameters, clip, .. } = *task;
        let names = ControlSet::names(case.points).unwrap_or_default();
        let noise_m = case.noise_mm / 1e3;
        let parameters = Parameters { method: case.method, ..parameters.clone() };
        let truth = at_database_rate(database, &clip.motion, evaluation.max_frames)?;
        let gap = match case.occlusion {
            Some(occlusion) => match occlusion.gap(&clip.name, truth.num_frames(), names.len()) {
                None => return Ok(None),
                gap => gap,
            },
            None => None,
        };
        let exact = control_trajectories(&truth, names)?;
        let mut measured = disturbed(&exact, &clip.name, noise_m, gap.as_ref())?;
        if evaluation.sweep.noise_is_known && noise_m > 0.0 {
            let samples = measured.num_frames() * measured.num_points();
            measured = measured.with_sigmas(vec![parameters.control_sigma_m.hypot(noise_m); samples])?;
        }
        let points = control_points(truth.skeleton(), names)?;
        let session = Session::new(truth.skeleton().clone(), points, &measured)?;
        let mut reconstructor = Reconstructor::new(database, index, &session, &parameters)?;
        if let Some(model) = models.for_trial(task.trial) {
            reconstructor = reconstructor.with_model(model)?;
        }
        reconstructor.learn_zero_pose()?;
        let begin = seconds();
        let found = reconstructor
            .reconstruct(0..session.num_frames(), &mut |_| std::ops::ControlFlow::Continue(()))?;
        let end = seconds();
        let motion = to_motion(database, &session, &parameters, &found)?;
        let slide = FootPaths::from_motion(&truth)
            .zip(FootPaths::from_motion(&motion))
            .and_then(|(truth, found)| foot_slide(&truth, &found, &ContactThresholds::default()));
        Ok(Some(TrialResult {
            case: case.clone(),
            trial: clip.name.clone(),
            subject: clip.subject.clone(),
            action: clip.action.clone(),
            comparison: compare_in_detail(&truth, &motion),
            foot_slide: slide,
            calibration: calibration(database, &truth, &found),
            gap,
            gap_errors: None,
            seconds: end - begin,
        }))
    }
}

/// A reconstruction of a whole session in one piece, in the file's channels, as a run would give it: its feet held if the parameters
/// say so.
fn to_motion(
    database: &MotionDatabase,
    session: &Session,
    parameters: &Parameters,
    found: &Reconstruction,
) -> Result<Motion, sparse::Error> {
    let uncut = Parameters { chunk_frames: session.num_frames().max(60), ..parameters.clone() };
    let motion = sparse::merge(database, session, &uncut, std::slice::from_ref(found))?.motion;
    if !parameters.foot_contacts {
        return Ok(motion);
    }
    let settings = HoldSettings::default();
    let held =
        hold_feet(&motion, database.parametrisation(), &session.points, &session.trajectories, &settings);
    Ok(held.map_or(motion, |held| held.motion))
}

/// Compares errors with the standard deviations stated.
fn calibration(database: &MotionDatabase, truth: &Motion, found: &Reconstruction) -> Option<Calibration> {
    let Reconstruction { coordinates, sigmas, .. } = found;
    Some(Calibration::measure(truth, database.parametrisation(), coordinates, sigmas))
}

/// Sets every trial with a gap beside the same without.
fn compare_gaps(results: &mut [TrialResult]) {
    let costs: Vec<Option<GapErrors>> = results
        .iter()
        .map(|occluded| {
            let gap = occluded.gap.as_ref()?;
            let case = occluded.case.without_gap();
            let undisturbed = results.iter().find(|r| r.trial == occluded.trial && r.case == case)?;
            Some(gap_errors(&occluded.comparison, &undisturbed.comparison, gap))
        })
        .collect();
    for (result, costs) in results.iter_mut().zip(costs) {
        result.gap_errors = costs;
    }
}
