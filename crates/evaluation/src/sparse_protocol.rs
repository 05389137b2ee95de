use kinematics::{Kinematics, Parametrisation, PointSet, control_points};
use model::{Motion, PointTrajectories};
use motion_db::{Clip, FRAME_RATE, MotionDatabase, WindowIndex};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use sparse::{Method, Parameters, Reconstruction, Reconstructor, Session};

use crate::metrics::{Errors, compare};

/// The papers' sets of control points, by their number.
pub struct ControlSet;

impl ControlSet {
    /// Names of the set of `count` points, 2 to 6 (method §1); `None` for other numbers.
    pub fn names(count: usize) -> Option<&'static [&'static str]> {
        const ALL: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
        match count {
            2 => Some(&["left_wrist", "right_ankle"]),
            3 => Some(&["left_wrist", "left_ankle", "right_ankle"]),
            4..=6 => Some(&ALL[..count]),
            _ => None,
        }
    }
}

/// What of the database a trial may be reconstructed from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// everything but the trial itself: the papers' protocol
    TrialOut,
    /// nothing of the trial's subject: what a new user gets
    SubjectOut,
}

impl std::fmt::Display for Protocol {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TrialOut => "trial-out",
            Self::SubjectOut => "subject-out",
        })
    }
}

/// Why an evaluation cannot run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number of control points without a set.
    #[error("found no set of {found} control points, expected 2 to 6")]
    Points {
        /// number asked for
        found: usize,
    },
    /// A trial cannot be reconstructed.
    #[error("trial {trial}: {source}")]
    Trial {
        /// name of the trial
        trial: String,
        /// what is wrong
        source: sparse::Error,
    },
    /// The database cannot be built.
    #[error(transparent)]
    Database(#[from] motion_db::Error),
}

/// What is evaluated.
#[derive(Debug, Clone)]
pub struct SparseEvaluation<'a> {
    /// motion the database is built from
    pub train: &'a [Clip],
    /// trials to be reconstructed
    pub test: &'a [Clip],
    /// what the database may hold of a trial
    pub protocol: Protocol,
    /// numbers of control points
    pub points: &'a [usize],
    /// methods
    pub methods: &'a [Method],
    /// the rest of the parameters
    pub parameters: Parameters,
    /// only the first frames of each trial, at 60 a second
    pub max_frames: usize,
}

/// One trial under one method.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialResult {
    /// method
    pub method: Method,
    /// number of control points
    pub points: usize,
    /// name of the trial
    pub trial: String,
    /// what was done in it
    pub action: String,
    /// its errors
    pub errors: Errors,
    /// seconds that the frames took: search, regression and MAP, start included
    pub seconds: f64,
}

/// Trajectories (metres) of a skeleton's control points in a motion, exact.
///
/// # Errors
/// If the skeleton lacks one of the points.
pub fn control_trajectories(motion: &Motion, names: &[&str]) -> Result<PointTrajectories, sparse::Error> {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let points = PointSet::new(&kinematics, control_points(skeleton, names)?);
    let mut state = kinematics.state();
    let mut positions = vec![Vector3::zeros(); points.len() * motion.num_frames()];
    for (pose, out) in motion.poses().zip(positions.chunks_exact_mut(points.len())) {
        points.positions(&kinematics, pose, &mut state, out);
    }
    let names = names.iter().map(|n| (*n).to_owned()).collect();
    Ok(PointTrajectories::new(names, motion.frame_rate(), positions)?)
}

/// Reconstructs every trial from its own control points and compares. `seconds` reads a clock (this crate has none);
/// `progress` is called before each trial with the number done and the number in all.
///
/// # Errors
/// If the database cannot be built or a trial cannot be reconstructed.
pub fn evaluate_sparse(
    evaluation: &SparseEvaluation<'_>,
    seconds: &dyn Fn() -> f64,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Vec<TrialResult>, Error> {
    let database = MotionDatabase::build(evaluation.train)?;
    let index = WindowIndex::new(&database, evaluation.parameters.window)?;
    let total = evaluation.points.len() * evaluation.methods.len() * evaluation.test.len();
    let mut results = Vec::with_capacity(total);
    for &points in evaluation.points {
        let names = ControlSet::names(points).ok_or(Error::Points { found: points })?;
        for clip in evaluation.test {
            for &method in evaluation.methods {
                progress(results.len(), total);
                let parameters = Parameters { method, ..evaluation.parameters.clone() };
                let result = run_trial(evaluation, &database, &index, clip, names, &parameters, seconds)
                    .map_err(|source| Error::Trial { trial: clip.name.clone(), source })?;
                results.push(TrialResult { points, ..result });
            }
        }
    }
    Ok(results)
}

fn run_trial(
    evaluation: &SparseEvaluation<'_>,
    database: &MotionDatabase,
    index: &WindowIndex,
    clip: &Clip,
    names: &[&str],
    parameters: &Parameters,
    seconds: &dyn Fn() -> f64,
) -> Result<TrialResult, sparse::Error> {
    let truth = at_database_rate(database, &clip.motion, evaluation.max_frames)?;
    let trajectories = control_trajectories(&truth, names)?;
    let points = control_points(truth.skeleton(), names)?;
    let session = Session::new(truth.skeleton().clone(), points, &trajectories)?;
    let mut reconstructor = Reconstructor::new(database, index, &session, parameters)?;
    reconstructor.exclude(|other| match evaluation.protocol {
        Protocol::TrialOut => other.name == clip.name,
        Protocol::SubjectOut => other.subject == clip.subject,
    });
    let begin = seconds();
    let found =
        reconstructor.reconstruct(0..session.num_frames(), &mut |_| std::ops::ControlFlow::Continue(()))?;
    let end = seconds();
    let motion = to_motion(database, &session, &found)?;
    Ok(TrialResult {
        method: parameters.method,
        points: names.len(),
        trial: clip.name.clone(),
        action: clip.action.clone(),
        errors: compare(&truth, &motion),
        seconds: end - begin,
    })
}

/// A reconstruction of a whole session in one piece, in the file's channels.
fn to_motion(
    database: &MotionDatabase,
    session: &Session,
    found: &Reconstruction,
) -> Result<Motion, sparse::Error> {
    let uncut = Parameters { chunk_frames: session.num_frames().max(60), ..Parameters::default() };
    Ok(sparse::merge(database, session, &uncut, std::slice::from_ref(found))?.motion)
}

/// The first frames of a motion at 60 a second, in the file's channels. `database` gives the coordinates in which
/// frames are interpolated where the rate is no multiple of 60.
///
/// # Errors
/// If the skeleton has another structure than the database's.
pub fn at_database_rate(
    database: &MotionDatabase,
    motion: &Motion,
    max_frames: usize,
) -> Result<Motion, sparse::Error> {
    let skeleton = motion.skeleton();
    if let Some(difference) = database.structure_difference(skeleton) {
        return Err(sparse::Error::Skeleton { difference });
    }
    let dofs = skeleton.num_dofs();
    let ratio = motion.frame_rate() / FRAME_RATE;
    let whole = ratio.round();
    if whole >= 1.0 && (ratio - whole).abs() < 0.01 * whole {
        let frames = motion.poses().step_by(whole as usize).take(max_frames);
        return Ok(Motion::new(skeleton.clone(), FRAME_RATE, frames.flatten().copied().collect())?);
    }
    let parametrisation = database.parametrisation();
    let coordinates = motion_db::resample(motion, parametrisation);
    let frames = (coordinates.len() / dofs).min(max_frames);
    let mut values = vec![0.0; frames * dofs];
    for frame in 0..frames {
        let (done, rest) = values.split_at_mut(frame * dofs);
        let previous = (frame > 0).then(|| &done[(frame - 1) * dofs..]);
        let x = &coordinates[frame * dofs..][..dofs];
        parametrisation.pose_from_coordinates(skeleton, x, previous, &mut rest[..dofs]);
    }
    Ok(Motion::new(skeleton.clone(), FRAME_RATE, values)?)
}
