use std::ops::ControlFlow;

use kinematics::{ControlPoint, control_points};
use model::{Motion, Skeleton};
use motion_db::{Clip, MotionDatabase, WindowIndex};
use serde::Serialize;
use skeleton_fit::{FitSettings, Limbs, Population, Sizes, fit_skeleton};
use sparse::{Parameters, Reconstructor, Session};

use super::positions::mean_distance_cm;
use crate::{compare, control_trajectories};

/// Where the skeleton of a reconstruction came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SkeletonSource {
    /// the performer's own, from a file
    Own,
    /// the first of the database
    First,
    /// the mean of the database's
    Mean,
    /// fitted to the control points
    Fitted,
}

/// One trial reconstructed on one skeleton.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SkeletonResult {
    /// name of the trial
    pub trial: String,
    /// who moved
    pub subject: String,
    /// number of control points
    pub points: usize,
    /// which skeleton
    pub source: SkeletonSource,
    /// errors of height, arm and leg length, metres
    pub error_m: [f64; 3],
    /// the same, percent of the true length
    pub error_percent: [f64; 3],
    /// errors of the scales of arms, legs and trunk over their standard deviations; of a fitted skeleton
    pub deviations: Option<[f64; 3]>,
    /// mean distance of the joints from their true positions, centimetres
    pub mpjpe_cm: f64,
    /// root mean square error of the joint angles, degrees
    pub rms_deg: f64,
}

/// A trial whose performer is unknown: the database has nothing of them.
#[derive(Clone, Copy)]
pub struct SkeletonTrial<'a> {
    /// the trial, its motion at 60 frames a second
    pub clip: &'a Clip,
    /// recordings of other people
    pub database: &'a MotionDatabase,
    /// its windows
    pub index: &'a WindowIndex,
}

/// Reconstructs a trial from its control points `names` on the performer's own skeleton, on the database's first and mean
/// one, and on one fitted to the points, and compares lengths and poses with the truth.
///
/// # Errors
/// If the trial does not fit the database or cannot be reconstructed.
pub fn evaluate_skeletons(
    trial: SkeletonTrial<'_>,
    names: &[&str],
    parameters: &Parameters,
    settings: &FitSettings,
) -> Result<Vec<SkeletonResult>, sparse::Error> {
    let SkeletonTrial { clip, database, .. } = trial;
    let truth = &clip.motion;
    let trajectories = control_trajectories(truth, names)?;
    let population = Population::from_database(database).map_err(unfit)?;
    let own = truth.skeleton().as_ref().clone();
    let base = control_points(database.skeleton(), names)?;
    let fitted = fit_skeleton(database, &base, &trajectories, settings).map_err(unfit)?;
    let on = |skeleton: &Skeleton| control_points(skeleton, names);
    let limbs = Limbs::from_skeleton(&own);
    let (true_lengths, found_lengths) = (limbs.lengths(&own), limbs.lengths(&fitted.skeleton));
    let mut deviations = [0.0; 3];
    for (i, d) in deviations.iter_mut().enumerate() {
        let scale = fitted.scales[i];
        *d = (found_lengths[i] / true_lengths[i]).ln() / (scale.sigma / scale.scale);
    }
    let cases: [(SkeletonSource, Skeleton, Vec<ControlPoint>); 4] = [
        (SkeletonSource::Own, own.clone(), on(&own)?),
        (SkeletonSource::First, database.skeleton().as_ref().clone(), base),
        (SkeletonSource::Mean, population.mean.clone(), on(&population.mean)?),
        (SkeletonSource::Fitted, fitted.skeleton, fitted.points),
    ];
    let sizes = lengths(&own);
    let mut results = Vec::with_capacity(cases.len());
    for (source, skeleton, points) in cases {
        let found = lengths(&skeleton);
        let session = Session::new(skeleton.into(), points, &trajectories)?;
        let motion = reconstruct(trial, &session, source, parameters)?;
        let error_m: [f64; 3] = std::array::from_fn(|i| found[i] - sizes[i]);
        let error_percent: [f64; 3] = std::array::from_fn(|i| 100.0 * error_m[i] / sizes[i].max(1e-9));
        results.push(SkeletonResult {
            trial: clip.name.clone(),
            subject: clip.subject.clone(),
            points: names.len(),
            source,
            error_m,
            error_percent,
            deviations: (source == SkeletonSource::Fitted).then_some(deviations),
            mpjpe_cm: mean_distance_cm(truth, &motion),
            rms_deg: compare(truth, &motion).rms_deg,
        });
    }
    Ok(results)
}

fn lengths(skeleton: &Skeleton) -> [f64; 3] {
    let sizes = Sizes::from_skeleton(skeleton);
    [sizes.height_m, sizes.arm_m, sizes.leg_m]
}

fn unfit(error: skeleton_fit::Error) -> sparse::Error {
    sparse::Error::Skeleton { difference: error.to_string() }
}

fn reconstruct(
    trial: SkeletonTrial<'_>,
    session: &Session,
    source: SkeletonSource,
    parameters: &Parameters,
) -> Result<Motion, sparse::Error> {
    // Whose clips have a skeleton like a borrowed one says nothing: what a run without a skeleton does.
    let borrowed = Parameters { skeleton_weight: 0.0, start_skeleton_weight: 0.0, ..parameters.clone() };
    let parameters = if source == SkeletonSource::Own { parameters } else { &borrowed };
    let reconstructor = Reconstructor::new(trial.database, trial.index, session, parameters)?;
    let found = reconstructor.reconstruct(0..session.num_frames(), &mut |_| ControlFlow::Continue(()))?;
    let uncut = Parameters { chunk_frames: session.num_frames().max(60), ..parameters.clone() };
    Ok(sparse::merge(trial.database, session, &uncut, std::slice::from_ref(&found))?.motion)
}
