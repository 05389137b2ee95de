//! Means over trials.

use serde::{Deserialize, Serialize};

use crate::{Calibration, Case, FootSlide, GapErrors, Protocol, TrialResult};

/// Name of the row over all actions.
pub const ALL: &str = "all";

/// Mean over the trials of one case and action.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// the case
    #[serde(flatten)]
    pub case: Case,
    /// protocol
    pub protocol: Protocol,
    /// action, `all` for the mean over all trials
    pub action: String,
    /// number of trials
    pub trials: usize,
    /// number of frames
    pub frames: usize,
    /// mean of the trials' RMS joint-angle errors, degrees
    pub rms_deg: f64,
    /// standard deviation of the trials' RMS errors, degrees
    pub rms_deg_std: f64,
    /// mean absolute joint-angle error, degrees
    pub mae_deg: f64,
    /// its standard deviation over trials, degrees
    pub mae_deg_std: f64,
    /// mean geodesic error of joint rotations, degrees
    pub geodesic_deg: f64,
    /// its standard deviation over trials, degrees
    pub geodesic_deg_std: f64,
    /// mean joint position error, centimetres
    pub mpjpe_cm: f64,
    /// its standard deviation over trials, centimetres
    pub mpjpe_cm_std: f64,
    /// mean joint position error with aligned roots, centimetres
    pub mpjpe_aligned_cm: f64,
    /// its standard deviation over trials, centimetres
    pub mpjpe_aligned_cm_std: f64,
    /// frames per second of one thread: search, regression, MAP and start; lower when trials ran side by side
    pub frames_per_second: f64,
    /// foot slide over all standing feet
    pub foot_slide: Option<FootSlide>,
    /// how often the truth was within the stated standard deviations
    pub calibration: Option<Calibration>,
    /// what gaps cost
    pub gap: Option<GapSummary>,
}

/// What gaps cost over several trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GapSummary {
    /// means over the trials; `recovery_s` is the median of those that recovered
    pub mean: GapErrors,
    /// trials with a gap
    pub trials: usize,
    /// trials that recovered before they ended
    pub recovered: usize,
}

/// Means by case and action, with `all` after the actions. Cases and trials come in the order of `results`.
pub fn summarise(results: &[TrialResult], protocol: Protocol) -> Vec<Row> {
    let mut cases: Vec<&Case> = Vec::new();
    for r in results {
        // Results of a case are neighbours.
        if cases.last() != Some(&&r.case) && !cases.contains(&&r.case) {
            cases.push(&r.case);
        }
    }
    let mut rows = Vec::new();
    for case in cases {
        let in_case: Vec<_> = results.iter().filter(|r| r.case == *case).collect();
        let mut actions: Vec<&str> =
            in_case.iter().map(|r| r.action.as_str()).filter(|a| !a.is_empty() && *a != ALL).collect();
        actions.sort_unstable();
        actions.dedup();
        for action in actions.into_iter().chain([ALL]) {
            let trials: Vec<_> =
                in_case.iter().copied().filter(|r| action == ALL || r.action == action).collect();
            rows.push(row(&trials, case, protocol, action));
        }
    }
    rows
}

fn row(trials: &[&TrialResult], case: &Case, protocol: Protocol, action: &str) -> Row {
    let (rms_deg, rms_deg_std) = spread(trials.iter().map(|t| t.comparison.errors.rms_deg));
    let (mae_deg, mae_deg_std) = spread(trials.iter().map(|t| t.comparison.errors.mae_deg));
    let (geodesic_deg, geodesic_deg_std) = spread(trials.iter().map(|t| t.comparison.errors.geodesic_deg));
    let (mpjpe_cm, mpjpe_cm_std) = spread(trials.iter().map(|t| t.comparison.errors.mpjpe_cm));
    let (mpjpe_aligned_cm, mpjpe_aligned_cm_std) =
        spread(trials.iter().map(|t| t.comparison.errors.mpjpe_aligned_cm));
    let frames: usize = trials.iter().map(|t| t.comparison.errors.frames).sum();
    let seconds: f64 = trials.iter().map(|t| t.seconds).sum();
    Row {
        case: case.clone(),
        protocol,
        action: action.to_owned(),
        trials: trials.len(),
        frames,
        rms_deg,
        rms_deg_std,
        mae_deg,
        mae_deg_std,
        geodesic_deg,
        geodesic_deg_std,
        mpjpe_cm,
        mpjpe_cm_std,
        mpjpe_aligned_cm,
        mpjpe_aligned_cm_std,
        frames_per_second: if seconds > 0.0 { frames as f64 / seconds } else { 0.0 },
        foot_slide: slide(trials),
        calibration: trials.iter().filter_map(|t| t.calibration.as_ref()).fold(None, |sum, one| {
            let mut sum: Calibration = sum.unwrap_or_default();
            sum.add(one);
            Some(sum)
        }),
        gap: gaps(trials),
    }
}

/// Mean and standard deviation (of the values themselves: divided by their number).
fn spread(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    (mean, (values.map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
}

/// Means over standing feet, not over trials: a trial counts as long as it stands.
fn slide(trials: &[&TrialResult]) -> Option<FootSlide> {
    let slides: Vec<FootSlide> = trials.iter().filter_map(|t| t.foot_slide).collect();
    if slides.is_empty() {
        return None;
    }
    let frames: usize = slides.iter().map(|s| s.contact_frames).sum();
    let own: usize = slides.iter().map(|s| s.own_contact_frames).sum();
    let mean = |value: &dyn Fn(&FootSlide) -> f64, count: usize| {
        slides.iter().map(value).sum::<f64>() / count.max(1) as f64
    };
    Some(FootSlide {
        contact_frames: frames,
        truth_cm_s: mean(&|s| s.truth_cm_s * s.contact_frames as f64, frames),
        found_cm_s: mean(&|s| s.found_cm_s * s.contact_frames as f64, frames),
        own_contact_frames: own,
        own_cm_s: mean(&|s| s.own_cm_s * s.own_contact_frames as f64, own),
    })
}

fn gaps(trials: &[&TrialResult]) -> Option<GapSummary> {
    let gaps: Vec<GapErrors> = trials.iter().filter_map(|t| t.gap_errors).collect();
    if gaps.is_empty() {
        return None;
    }
    let mean = |value: &dyn Fn(&GapErrors) -> f64| gaps.iter().map(value).sum::<f64>() / gaps.len() as f64;
    let mut recoveries: Vec<f64> = gaps.iter().filter_map(|g| g.recovery_s).collect();
    recoveries.sort_by(f64::total_cmp);
    Some(GapSummary {
        mean: GapErrors {
            inside_deg: mean(&|g| g.inside_deg),
            inside_undisturbed_deg: mean(&|g| g.inside_undisturbed_deg),
            inside_cm: mean(&|g| g.inside_cm),
            inside_undisturbed_cm: mean(&|g| g.inside_undisturbed_cm),
            after_deg: mean(&|g| g.after_deg),
            after_undisturbed_deg: mean(&|g| g.after_undisturbed_deg),
            recovery_s: recoveries.get(recoveries.len() / 2).copied(),
        },
        trials: gaps.len(),
        recovered: recoveries.len(),
    })
}
