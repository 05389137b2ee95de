use kinematics::ControlPoint;
use model::{PointTrajectories, Skeleton};
use motion_db::MotionDatabase;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::evidence::{Evidence, Observed, Value};
use crate::shapes::{SPAN, SPAN_FRAMES, Shapes};
use crate::{Error, FitSettings, LIMBS, Population, Result};

/// Most spans of a session that are looked at, spread evenly over it.
const MAX_SPANS: usize = 32;
/// Sizes of the whole body that are tried first, in steps of the logarithm of its scale.
const SIZE_STEP: f64 = 0.05;
/// Steps up and down.
const SIZE_STEPS: i32 = 6;
/// Steps of the ascent, at most.
const MAX_STEPS: usize = 25;
/// The ascent ends when all scales move by less (logarithm).
const CONVERGED: f64 = 2e-4;

/// How much longer the bones of one limb are than the database's mean.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LimbScale {
    /// factor on the length of the limb's bones
    pub scale: f64,
    /// its standard deviation
    pub sigma: f64,
}

/// A skeleton made for a performer of whom only the paths of some points are known.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedSkeleton {
    /// the skeleton
    pub skeleton: Skeleton,
    /// the control points on it
    pub points: Vec<ControlPoint>,
    /// scales of arms, legs and trunk, see [`LIMBS`]
    pub scales: [LimbScale; 3],
    /// distinct skeletons of the database, from whose mean it was made
    pub performers: usize,
    /// spans of the session that it was fitted to
    pub spans: usize,
}

/// Fits the lengths of a performer's arms, legs and trunk to the paths of some points, given how people of the database
/// move and are built: the most probable scales under [`Evidence`], with the uncertainty of its curvature.
///
/// `points` are on the database's own skeleton; `trajectories` has them in the same order, metres, y up with the floor at
/// 0, 60 frames a second. The same arguments always give the same bits.
///
/// # Errors
/// If the points are not the skeleton's or the trajectories', or no span has two measured points in each frame.
pub fn fit_skeleton(
    database: &MotionDatabase,
    points: &[ControlPoint],
    trajectories: &PointTrajectories,
    settings: &FitSettings,
) -> Result<FittedSkeleton> {
    let joints = database.skeleton().num_joints();
    if let Some(bad) = points.iter().find(|p| p.joint >= joints) {
        return Err(Error::Point { name: bad.name.clone(), joint: bad.joint, joints });
    }
    if trajectories.num_points() != points.len() {
        return Err(Error::Trajectories { found: trajectories.num_points(), expected: points.len() });
    }
    let population = Population::from_database(database)?;
    let points = on_mean(database.skeleton(), &population, points);
    let observed = observed(trajectories);
    let shapes = Shapes::new(database, &population.mean, &population.limbs, &points);
    if observed.is_empty() || shapes.num_spans() == 0 {
        return Err(Error::NothingToCompare { frames: SPAN_FRAMES + 1 });
    }
    let precision = population.covariance.try_inverse().unwrap_or_else(|| Matrix3::identity() * 1e3);
    let mut evidence = Evidence::new(&shapes, &observed, points.len(), precision, settings);
    let (theta, covariance) = climb(&mut evidence, population.covariance);
    let scales = theta.map(f64::exp);
    let scales = [scales.x, scales.y, scales.z];
    let skeleton = population.limbs.scaled(&population.mean, scales)?;
    let points = points.into_iter().map(|p| {
        let scale = scales[population.limbs.limb(p.joint) as usize];
        ControlPoint { offset: p.offset * scale, ..p }
    });
    let mut limb_scales = [LimbScale { scale: 1.0, sigma: 0.0 }; LIMBS.len()];
    for (i, limb) in limb_scales.iter_mut().enumerate() {
        *limb = LimbScale { scale: scales[i], sigma: scales[i] * covariance[(i, i)].max(0.0).sqrt() };
    }
    Ok(FittedSkeleton {
        points: points.collect(),
        skeleton,
        scales: limb_scales,
        performers: population.performers,
        spans: observed.len(),
    })
}

/// The points on the mean skeleton: their offsets are scaled with their limb.
fn on_mean(template: &Skeleton, population: &Population, points: &[ControlPoint]) -> Vec<ControlPoint> {
    let from = population.limbs.lengths(template);
    let to = population.limbs.lengths(&population.mean);
    let moved = |p: &ControlPoint| {
        let tip = template.joints()[p.joint].tip;
        if p.offset == tip {
            return ControlPoint { offset: population.mean.joints()[p.joint].tip, ..p.clone() };
        }
        let limb = population.limbs.limb(p.joint) as usize;
        let scale = if from[limb] > 0.0 { to[limb] / from[limb] } else { 1.0 };
        ControlPoint { offset: p.offset * scale, ..p.clone() }
    };
    points.iter().map(moved).collect()
}

/// Spans with at least two measured points in every frame, spread over the session.
fn observed(trajectories: &PointTrajectories) -> Vec<Observed> {
    let has_two = |frame: usize| trajectories.frame(frame).iter().filter(|p| p.x.is_finite()).count() >= 2;
    let last = trajectories.num_frames().saturating_sub(SPAN_FRAMES);
    let usable: Vec<usize> = (0..last).filter(|first| SPAN.iter().all(|s| has_two(first + s))).collect();
    let count = MAX_SPANS.min(usable.len().div_ceil(SPAN_FRAMES / 2));
    let picked = (0..count).map(|i| usable[(2 * i + 1) * usable.len() / (2 * count)]);
    let points = trajectories.num_points();
    let span = |first: usize| {
        SPAN.iter().flat_map(|s| (0..points).map(move |p| trajectories.position(first + s, p))).collect()
    };
    picked.map(span).collect()
}

/// The top of the evidence, and the covariance of θ there. First the size of the whole body by a scan, then BFGS on all
/// scales from the best of it.
fn climb(evidence: &mut Evidence<'_>, prior: Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let sizes = (-SIZE_STEPS..=SIZE_STEPS).map(|i| Vector3::repeat(f64::from(i) * SIZE_STEP));
    let tried = sizes.map(|theta| (theta, evidence.at(&theta)));
    let best = tried.max_by(|a, b| a.1.log.total_cmp(&b.1.log));
    let (mut theta, mut value) =
        best.unwrap_or((Vector3::zeros(), Value { log: 0.0, gradient: Vector3::zeros() }));
    // Inverse of minus the Hessian, from what is known without looking.
    let mut inverse = prior * 0.1;
    for _ in 0..MAX_STEPS {
        let mut step = inverse * value.gradient;
        let longest = step.amax();
        if longest > SIZE_STEP {
            step *= SIZE_STEP / longest;
        }
        let mut next = evidence.at(&(theta + step));
        for _ in 0..8 {
            if next.log >= value.log + 1e-4 * value.gradient.dot(&step) {
                break;
            }
            step *= 0.4;
            next = evidence.at(&(theta + step));
        }
        // Also where it is not a number.
        let is_higher = next.log > value.log;
        if !is_higher {
            break;
        }
        let change = value.gradient - next.gradient;
        let curvature = change.dot(&step);
        if curvature > 1e-12 {
            let left = Matrix3::identity() - step * change.transpose() / curvature;
            inverse = left * inverse * left.transpose() + step * step.transpose() / curvature;
        }
        theta += step;
        value = next;
        if step.amax() < CONVERGED {
            break;
        }
    }
    (theta, covariance(evidence, &theta, prior))
}

/// Inverse of minus the Hessian, by differences of the gradient; no direction is less certain than the prior.
fn covariance(evidence: &mut Evidence<'_>, theta: &Vector3<f64>, prior: Matrix3<f64>) -> Matrix3<f64> {
    let step = 0.01;
    let mut hessian = Matrix3::zeros();
    for i in 0..3 {
        let mut d = Vector3::zeros();
        d[i] = step;
        let difference = evidence.at(&(theta - d)).gradient - evidence.at(&(theta + d)).gradient;
        hessian.set_column(i, &(difference / (2.0 * step)));
    }
    let symmetric = (hessian + hessian.transpose()) * 0.5;
    let floor = prior.try_inverse().unwrap_or_else(Matrix3::identity);
    let is_peak = symmetric.cholesky().is_some();
    let found = if is_peak { symmetric.try_inverse() } else { floor.try_inverse() };
    found.unwrap_or(prior)
}
