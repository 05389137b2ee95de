//! What `run.json` says of a run from control points, beside what it says of all runs.

use crate::feet::{Finished, FootReport};
use jobs::{
    JobReport,
    run_json::{Origin, RunReport, Timings},
    sparse::{FittedReport, MergeChunks},
};
use queue::JobError;
use results::ResultFile;
use serde::Serialize;
use sparse::FrameQuality;

#[derive(Serialize)]
struct Own<'a> {
    /// The skeleton that was fitted, if the session came without one.
    fitted_skeleton: Option<&'a FittedReport>,
    quality: Summary,
    /// Feet, where they were looked for and found.
    feet: Option<&'a FootReport>,
}

#[derive(Serialize)]
struct Summary {
    /// Over the frames in which something was measured; none without such.
    mean_residual_m: Option<f64>,
    max_residual_m: Option<f64>,
    mean_sigma_rad: Option<f64>,
    frames_without_measurement: usize,
}

/// `run.json` of a run that has just been merged.
///
/// # Errors
/// To be tried again if it is no JSON.
pub(crate) fn file(
    origin: Origin,
    job: &MergeChunks,
    finished: &Finished,
    chunks: &[JobReport],
    merge: &JobReport,
) -> Result<ResultFile, JobError> {
    let quality = &finished.merged.quality;
    let warnings = [&job.warnings[..], &doubts(quality, job.request.parameters.lost_energy)].concat();
    // warm-up and blending are counted too
    let timings =
        Timings::default().one("plan", &job.plan).all("chunks", chunks).one("merge", merge).speed(chunks);
    let report = RunReport {
        origin,
        warnings: &warnings,
        timings,
        frames: Some((quality.len(), motion_db::FRAME_RATE)),
        points: Some(job.points.iter().map(String::as_str).collect()),
    };
    let own = Own {
        fitted_skeleton: job.fitted.as_ref(),
        quality: summary(quality),
        feet: finished.feet.as_ref().map(|feet| &feet.report),
    };
    results::run_json(&report, &job.request, own)
}

/// Frames that fit badly or were not measured, from a twentieth of all on.
const MANY: usize = 20;

/// What a user should know of the result. `lost_energy`: energy from which on a frame fits badly.
fn doubts(quality: &[FrameQuality], lost_energy: f64) -> Vec<String> {
    let share = |count: usize| 100.0 * count as f64 / quality.len().max(1) as f64;
    let bad = quality.iter().filter(|q| q.energy > lost_energy).count();
    let unmeasured = quality.iter().filter(|q| q.measured_points == 0).count();
    let mut doubts = Vec::new();
    if bad * MANY > quality.len() {
        doubts.push(format!(
            "{:.0} % of the frames fit the measured points badly (energy above {lost_energy}): is another axis up, is a point \
             named wrongly, is the motion unlike all in the database? see quality.csv",
            share(bad)
        ));
    }
    if unmeasured * MANY > quality.len() {
        doubts.push(format!(
            "in {:.0} % of the frames no point was measured: they are guessed",
            share(unmeasured)
        ));
    }
    doubts
}

fn summary(quality: &[FrameQuality]) -> Summary {
    let residuals: Vec<f64> =
        quality.iter().filter(|q| q.measured_points > 0).map(|q| q.residual_m).collect();
    let mean = |sum: f64, count: usize| (count > 0).then(|| sum / count as f64);
    Summary {
        mean_residual_m: mean(residuals.iter().sum(), residuals.len()),
        max_residual_m: residuals.iter().copied().reduce(f64::max),
        mean_sigma_rad: mean(quality.iter().map(|q| q.sigma_rad).sum(), quality.len()),
        frames_without_measurement: quality.len() - residuals.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(energy: f64, measured_points: usize) -> FrameQuality {
        FrameQuality { residual_m: 0.0, sigma_rad: 0.1, energy, neighbour_distance_deg: 3.0, measured_points }
    }

    #[test]
    fn frames_without_measurement_do_not_better_the_residual() {
        let measured = FrameQuality { residual_m: 0.002, ..frame(1.0, 4) };
        let found = summary(&[vec![measured; 10], vec![frame(0.0, 0); 30]].concat());
        assert!((found.mean_residual_m.unwrap() - 0.002).abs() < 1e-12);
        assert_eq!(found.frames_without_measurement, 30);
        assert_eq!(summary(&[frame(0.0, 0)]).mean_residual_m, None);
    }

    #[test]
    fn a_run_that_fits_badly_or_guesses_much_says_so() {
        let good = vec![frame(1.0, 4); 100];
        assert!(doubts(&good, 20.0).is_empty());
        let bad = [vec![frame(90.0, 4); 30], vec![frame(1.0, 0); 20], good[..50].to_vec()].concat();
        let said = doubts(&bad, 20.0);
        assert!(said[0].starts_with("30 % of the frames fit"), "{said:?}");
        assert!(said[1].starts_with("in 20 % of the frames no point"), "{said:?}");
    }
}
