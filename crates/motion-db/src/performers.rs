//! What sets performers apart: recordings of two people, or of one person on two days, differ in the zero pose of their
//! joints by constant angles. They are larger than the differences between one walk and the next, and most of the error of
//! a performer whose motion is not in the database (docs/papers.md#zero-poses).

use faer::Mat;
use faer::linalg::solvers::{Llt, Solve};
use kinematics::HEADING;
use model::Skeleton;

use crate::database::proportions;
use crate::{FeatureScale, HeadingFrame, MotionDatabase};

/// Skeletons that differ by less in every number are one performer's, metres.
const SAME_SKELETON_M: f64 = 1e-3;
/// With fewer performers a zero pose cannot be told from a way of moving: none is learned.
const MIN_PERFORMERS: usize = 6;
/// Poses of a performer that are compared with those of others, at most.
const SAMPLES: usize = 100;
/// The same for all performers together: comparing takes the square of it.
const MAX_SAMPLES: usize = 4_000;
/// A pose is compared together with the one this many frames before, 0.1 s.
const LAG: usize = 6;
/// Matching and fitting alternate so often.
const ROUNDS: usize = 4;
/// The kernel's h² is this quantile of the squared distances of the matches: only close matches tell a zero pose from a
/// way of moving.
const CLOSE: f64 = 0.15;
/// Weight of "no offset" beside matches with one other performer, which weigh up to 2.
const SHRINKAGE: f64 = 2.0;
/// Skeletons that differ by so much (centimetres, root of the summed squares) have zero poses that have little to do with
/// each other.
const SKELETON_SPREAD_CM: f64 = 5.0;
/// Share of the covariances between joints that is believed: they come from few performers.
const BELIEVED_COVARIANCE: f64 = 0.5;
/// Standard deviation of an offset about which the performers agree, radians: 1°.
const MIN_SIGMA: f64 = std::f64::consts::PI / 180.0;

/// What is known of a performer's zero pose before any of their motion was seen: a Gaussian over the constants that
/// their coordinates have over those of an average performer, radians (0 for translations and the heading).
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroPosePrior {
    /// shape `[dofs]`
    pub mean: Vec<f64>,
    /// row-major, shape `[dofs, dofs]`
    pub covariance: Vec<f64>,
    /// whether the database holds recordings of this performer, so that `mean` was learned from them
    pub is_known: bool,
}

impl ZeroPosePrior {
    /// Variance of every offset, radians², shape `[dofs]`; 0 for a performer who is known.
    pub fn variances(&self) -> Vec<f64> {
        let dofs = self.mean.len();
        let variance = |d| if self.is_known { 0.0 } else { self.covariance[d * dofs + d] };
        (0..dofs).map(variance).collect()
    }
}

/// A pose with the one before it, degrees and centimetres.
struct Sample {
    recorded: Vec<f32>,
    /// without the performer's offsets
    neutral: Vec<f32>,
}

impl MotionDatabase {
    /// Index of the performer of every clip, and their number: clips of one skeleton are one performer's.
    pub fn performers(&self) -> (Vec<usize>, usize) {
        let mut first: Vec<&[f64]> = Vec::new();
        let mut by_clip = Vec::with_capacity(self.clips.len());
        for clip in &self.clips {
            let is_same = |other: &&[f64]| {
                other.iter().zip(&clip.proportions).all(|(a, b)| (a - b).abs() < SAME_SKELETON_M)
            };
            let found = first.iter().position(is_same);
            by_clip.push(found.unwrap_or(first.len()));
            if found.is_none() {
                first.push(&clip.proportions);
            }
        }
        let count = first.len();
        (by_clip, count)
    }

    /// Learns the zero pose of every performer and keeps it with their clips: from then on, poses, windows and searches are
    /// those of an average performer. With fewer than six performers nothing is learned.
    ///
    /// Poses are matched with the most similar ones of every other performer. Offsets `o` are chosen to make the
    /// differences of matched poses small, `Σ w ‖(q_i − o_p) − (q_j − o_r)‖² + λ Σ‖o_p‖²`, and the poses matched again.
    pub fn learn_zero_poses(&mut self) {
        let (by_clip, count) = self.performers();
        if count < MIN_PERFORMERS {
            self.clips.iter_mut().for_each(|c| c.zero_pose.clear());
            return;
        }
        let scale = FeatureScale::from_database(self);
        let dofs = self.num_dofs();
        let free: Vec<bool> = (0..dofs).map(|d| d > HEADING && self.parametrisation.is_angle(d)).collect();
        let mut samples = self.samples(&by_clip, count, &scale);
        let mut offsets = vec![vec![0.0; dofs]; count];
        for _ in 0..ROUNDS {
            for (samples, offset) in samples.iter_mut().zip(&offsets) {
                for sample in samples {
                    for (i, (n, r)) in sample.neutral.iter_mut().zip(&sample.recorded).enumerate() {
                        *n = r - offset[i % dofs] as f32;
                    }
                }
            }
            offsets = fit(&samples, &free);
        }
        for (clip, performer) in self.clips.iter_mut().zip(by_clip) {
            let radians = offsets[performer].iter().zip(&scale.per_dof);
            clip.zero_pose = radians.map(|(o, s)| (o / s) as f32).collect();
        }
    }

    /// Recorded poses of every performer, evenly over their clips.
    fn samples(&self, by_clip: &[usize], count: usize, scale: &FeatureScale) -> Vec<Vec<Sample>> {
        let dofs = self.num_dofs();
        let mut poses = vec![0; count];
        for (clip, &performer) in self.clips.iter().zip(by_clip) {
            poses[performer] += clip.num_poses;
        }
        let most = SAMPLES.min(MAX_SAMPLES / count).max(1);
        let mut samples: Vec<Vec<Sample>> = (0..count).map(|_| Vec::new()).collect();
        let double = |pose: usize| self.pose(pose).iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
        for (clip, &performer) in self.clips.iter().zip(by_clip) {
            let stride = poses[performer].div_ceil(most);
            for pose in (clip.first_pose + LAG..clip.first_pose + clip.num_poses).step_by(stride) {
                let frame = HeadingFrame::from_coordinates(&double(pose));
                let mut numbers = vec![0.0; 2 * dofs];
                for (at, out) in [pose, pose - LAG].into_iter().zip(numbers.chunks_exact_mut(dofs)) {
                    frame.relative(&double(at), out);
                    scale.scale(out);
                }
                let recorded: Vec<f32> = numbers.iter().map(|v| *v as f32).collect();
                samples[performer].push(Sample { neutral: recorded.clone(), recorded });
            }
        }
        samples
    }

    /// What the database tells about the zero pose of the performer whose skeleton this is (same structure): what was learned
    /// if their recordings are in it, otherwise that of performers with similar skeletons, and how performers differ.
    pub fn zero_pose_prior(&self, skeleton: &Skeleton) -> ZeroPosePrior {
        let dofs = self.num_dofs();
        let own = proportions(skeleton);
        let (by_clip, count) = self.performers();
        let mut mean = vec![0.0; dofs];
        let mut covariance = vec![0.0; dofs * dofs];
        let mut weights = 0.02;
        let mut known = None;
        for performer in 0..count {
            let Some(clip) = by_clip.iter().position(|p| *p == performer).map(|c| &self.clips[c]) else {
                continue;
            };
            if clip.zero_pose.is_empty() {
                continue;
            }
            let differences = || own.iter().zip(&clip.proportions).map(|(a, b)| a - b);
            if differences().all(|d| d.abs() < SAME_SKELETON_M) {
                known = Some(&clip.zero_pose);
            }
            let unlike_cm = 100.0 * differences().map(|d| d * d).sum::<f64>().sqrt();
            let weight = (-0.5 * (unlike_cm / SKELETON_SPREAD_CM).powi(2)).exp();
            weights += weight;
            for (d, o) in clip.zero_pose.iter().map(|o| f64::from(*o)).enumerate() {
                mean[d] += weight * o;
                for (e, other) in clip.zero_pose.iter().enumerate() {
                    let believed = if d == e { 1.0 } else { BELIEVED_COVARIANCE };
                    covariance[d * dofs + e] += believed * o * f64::from(*other) / count as f64;
                }
            }
        }
        mean.iter_mut().for_each(|m| *m /= weights);
        let is_learned = self.clips.iter().any(|c| !c.zero_pose.is_empty());
        let free = |d: &usize| is_learned && *d > HEADING && self.parametrisation.is_angle(*d);
        for d in (0..dofs).filter(free) {
            covariance[d * dofs + d] += MIN_SIGMA * MIN_SIGMA;
        }
        if let Some(known) = known {
            mean = known.iter().map(|o| f64::from(*o)).collect();
        }
        ZeroPosePrior { mean, covariance, is_known: known.is_some() }
    }
}

/// Offsets of all performers (degrees) under which matched poses differ least.
fn fit(samples: &[Vec<Sample>], free: &[bool]) -> Vec<Vec<f64>> {
    let (count, dofs) = (samples.len(), free.len());
    let matches = matches(samples);
    let mut distances: Vec<f32> = matches.iter().map(|m| m.distance).collect();
    distances.sort_unstable_by(f32::total_cmp);
    let close = distances.get((distances.len() as f64 * CLOSE) as usize).copied().unwrap_or(1.0);
    let h_squared = f64::from(close).max(1e-6);
    // Normal equations: a Laplacian of the graph of performers, shared by all coordinates.
    let mut matrix = Mat::<f64>::zeros(count, count);
    let mut right = Mat::<f64>::zeros(count, dofs);
    for p in 0..count {
        matrix[(p, p)] = SHRINKAGE;
    }
    for m in &matches {
        let [p, r] = m.performers;
        let weight = (-0.5 * f64::from(m.distance) / h_squared).exp() / samples[p].len().max(20) as f64;
        for (a, b, sign) in [(p, r, 1.0), (r, p, -1.0)] {
            matrix[(a, a)] += weight;
            matrix[(a, b)] -= weight;
            let [i, j] = m.samples;
            let pairs = samples[p][i].recorded.iter().zip(&samples[r][j].recorded).zip(free);
            for (d, ((x, y), _)) in pairs.enumerate().filter(|(_, (_, is_free))| **is_free) {
                right[(a, d)] += sign * weight * within_half_turn(f64::from(x - y));
            }
        }
    }
    let Ok(factor) = Llt::new(matrix.as_ref(), faer::Side::Lower) else {
        return vec![vec![0.0; dofs]; count];
    };
    let solved = factor.solve(&right);
    (0..count).map(|p| (0..dofs).map(|d| solved[(p, d)]).collect()).collect()
}

fn within_half_turn(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

struct Match {
    performers: [usize; 2],
    samples: [usize; 2],
    /// squared
    distance: f32,
}

/// The most similar sample of every other performer, for every sample.
fn matches(samples: &[Vec<Sample>]) -> Vec<Match> {
    let mut matches = Vec::new();
    for (p, own) in samples.iter().enumerate() {
        for (r, others) in samples.iter().enumerate().filter(|(r, _)| *r != p) {
            for (i, sample) in own.iter().enumerate() {
                let mut best = Match { performers: [p, r], samples: [i, 0], distance: f32::INFINITY };
                for (j, other) in others.iter().enumerate() {
                    let distance = distance(&sample.neutral, &other.neutral, best.distance);
                    if distance < best.distance {
                        best.distance = distance;
                        best.samples[1] = j;
                    }
                }
                if best.distance.is_finite() {
                    matches.push(best);
                }
            }
        }
    }
    matches
}

/// Squared distance, or what was summed when it went past `limit`.
fn distance(a: &[f32], b: &[f32], limit: f32) -> f32 {
    let mut sum = 0.0;
    for (a, b) in a.chunks(32).zip(b.chunks(32)) {
        let mut lanes = [0.0f32; 8];
        let (a8, a_rest) = a.as_chunks::<8>();
        let (b8, b_rest) = b.as_chunks::<8>();
        for (x, y) in a8.iter().zip(b8) {
            for i in 0..8 {
                let d = x[i] - y[i];
                lanes[i] += d * d;
            }
        }
        sum += lanes.iter().sum::<f32>();
        sum += a_rest.iter().zip(b_rest).map(|(x, y)| (x - y) * (x - y)).sum::<f32>();
        if sum > limit {
            break;
        }
    }
    sum
}
