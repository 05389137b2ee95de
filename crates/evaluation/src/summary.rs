use std::fmt::Write;

use serde::{Deserialize, Serialize};
use sparse::{Method, Parameters};

use crate::{Protocol, TrialResult};

/// Mean over trials of one method, number of points and action.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// method
    pub method: Method,
    /// number of control points
    pub points: usize,
    /// window length, frames
    pub window: usize,
    /// number of neighbours
    pub neighbours: usize,
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
    /// mean geodesic error of joint rotations, degrees
    pub geodesic_deg: f64,
    /// mean joint position error, centimetres
    pub mpjpe_cm: f64,
    /// mean joint position error with aligned roots, centimetres
    pub mpjpe_aligned_cm: f64,
    /// frames per second on one thread: search, regression, MAP and start
    pub frames_per_second: f64,
}

/// Means by method, number of points and action, with `all` after the actions.
pub fn summarise(results: &[TrialResult], protocol: Protocol, parameters: &Parameters) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut cases: Vec<(usize, Method)> = Vec::new();
    for r in results {
        if !cases.contains(&(r.points, r.method)) {
            cases.push((r.points, r.method));
        }
    }
    for (points, method) in cases {
        let of_case: Vec<_> = results.iter().filter(|r| r.points == points && r.method == method).collect();
        let mut actions: Vec<&str> =
            of_case.iter().map(|r| r.action.as_str()).filter(|a| !a.is_empty()).collect();
        actions.sort_unstable();
        actions.dedup();
        for action in actions.into_iter().chain(["all"]) {
            let trials: Vec<_> =
                of_case.iter().copied().filter(|r| action == "all" || r.action == action).collect();
            rows.push(row(&trials, protocol, parameters, action));
        }
    }
    rows
}

fn row(trials: &[&TrialResult], protocol: Protocol, parameters: &Parameters, action: &str) -> Row {
    let count = trials.len() as f64;
    let mean = |value: &dyn Fn(&TrialResult) -> f64| trials.iter().map(|t| value(t)).sum::<f64>() / count;
    let rms_deg = mean(&|t| t.errors.rms_deg);
    let frames: usize = trials.iter().map(|t| t.errors.frames).sum();
    let seconds: f64 = trials.iter().map(|t| t.seconds).sum();
    Row {
        method: trials[0].method,
        points: trials[0].points,
        window: parameters.window,
        neighbours: parameters.neighbours,
        protocol,
        action: action.to_owned(),
        trials: trials.len(),
        frames,
        rms_deg,
        rms_deg_std: mean(&|t| (t.errors.rms_deg - rms_deg).powi(2)).sqrt(),
        mae_deg: mean(&|t| t.errors.mae_deg),
        geodesic_deg: mean(&|t| t.errors.geodesic_deg),
        mpjpe_cm: mean(&|t| t.errors.mpjpe_cm),
        mpjpe_aligned_cm: mean(&|t| t.errors.mpjpe_aligned_cm),
        frames_per_second: if seconds > 0.0 { frames as f64 / seconds } else { 0.0 },
    }
}

/// The rows as a table in plain text.
pub fn table(rows: &[Row]) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<17} {:>6} {:<8} {:>6} {:>6} {:>14} {:>7} {:>8} {:>8} {:>11} {:>8}",
        "method",
        "points",
        "action",
        "trials",
        "frames",
        "RMS deg (sd)",
        "MAE deg",
        "geod deg",
        "MPJPE cm",
        "aligned cm",
        "frames/s"
    );
    for r in rows {
        let rms = format!("{:.2} ({:.2})", r.rms_deg, r.rms_deg_std);
        let _ = writeln!(
            out,
            "{:<17} {:>6} {:<8} {:>6} {:>6} {rms:>14} {:>7.2} {:>8.2} {:>8.2} {:>11.2} {:>8.0}",
            r.method.to_string(),
            r.points,
            r.action,
            r.trials,
            r.frames,
            r.mae_deg,
            r.geodesic_deg,
            r.mpjpe_cm,
            r.mpjpe_aligned_cm,
            r.frames_per_second
        );
    }
    out
}
