//! What people get of a run by inverse kinematics, beside the motion.

use std::fmt::Write as _;

use inverse_kinematics::sequence::Solved;
use jobs::{
    JobReport,
    inverse_kinematics::SolveInverseKinematics,
    multi_view::{CameraReport, timings},
    run_json::{Origin, RunReport},
};
use queue::JobError;
use results::ResultFile;
use serde_json::json;

use super::finished::Finished;

/// Root mean square distance of the measured points beyond which a frame fits badly, metres.
const BAD_M: f64 = 0.05;
/// Frames that fit badly are spoken of from this share of all on.
const MANY: f64 = 0.05;
/// Support in silhouettes below which limbs lie outside them.
const BAD_OVERLAP: f64 = 0.0;

/// One frame: how far points are from where they were measured, how well limbs lie in the silhouettes (empty where there is
/// nothing to say).
pub(super) fn quality_csv(solved: &[Solved], measured: &[usize], frame_rate: f64) -> String {
    let mut out = String::from("frame,time,measured_points,residual_m,overlap,steps\n");
    let cell = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.7}"));
    for (frame, (solved, measured)) in solved.iter().zip(measured).enumerate() {
        let _ = writeln!(
            out,
            "{frame},{:.6},{measured},{},{},{}",
            frame as f64 / frame_rate,
            cell(solved.residual_m),
            cell(solved.overlap),
            solved.steps
        );
    }
    out
}

/// What a user should know of a result that did not fail.
pub(super) fn doubts(solved: &[Solved]) -> Vec<String> {
    let share = |is: &dyn Fn(&Solved) -> bool| {
        solved.iter().filter(|solved| is(solved)).count() as f64 / solved.len().max(1) as f64
    };
    let mut doubts = Vec::new();
    let bad = share(&|solved| solved.residual_m.is_some_and(|m| m > BAD_M));
    if bad > MANY {
        doubts.push(format!(
            "in {:.0} % of the frames the body is more than 5 cm off the measured points: check the stature, the point names and \
             which axis is up; see quality.csv",
            100.0 * bad
        ));
    }
    let outside = share(&|solved| solved.overlap.is_some_and(|overlap| overlap < BAD_OVERLAP));
    if outside > MANY {
        doubts.push(format!(
            "in {:.0} % of the frames limbs lie outside the silhouettes: check that cameras and points have the same origin, axes \
             and start; see quality.csv",
            100.0 * outside
        ));
    }
    let unmeasured = share(&|solved| solved.residual_m.is_none());
    if unmeasured > MANY {
        doubts.push(format!("in {:.0} % of the frames no point was measured", 100.0 * unmeasured));
    }
    doubts
}

/// `run.json`.
///
/// # Errors
/// To be tried again if it is no JSON.
pub(super) fn run_json(
    origin: Origin,
    request: &SolveInverseKinematics,
    cameras: &[CameraReport],
    finished: &Finished,
    job: &JobReport,
) -> Result<ResultFile, JobError> {
    let Finished { solved, shape, model, .. } = finished;
    let mean = |value: &dyn Fn(&Solved) -> Option<f64>| {
        let found: Vec<f64> = solved.iter().filter_map(value).collect();
        (!found.is_empty()).then(|| found.iter().sum::<f64>() / found.len() as f64)
    };
    let residuals = solved.iter().filter_map(|solved| solved.residual_m);
    let measurements = shape.measurements(model);
    let own = json!({
        "body": {
            "alpha": shape.alpha,
            "stature_m": measurements.stature_m,
            "mass_kg": measurements.mass_kg,
        },
        "cameras": cameras.iter().map(CameraReport::summary).collect::<Vec<_>>(),
        "quality": {
            "mean_residual_m": mean(&|solved| solved.residual_m),
            "max_residual_m": residuals.reduce(f64::max),
            "mean_overlap": mean(&|solved| solved.overlap),
            "frames_without_measurement": solved.iter().filter(|s| s.residual_m.is_none()).count(),
        },
    });
    let plan = request.cameras.as_ref().map(|planned| &planned.plan);
    let timings = timings(plan, cameras).one("solve", job).speed([job]);
    let report = RunReport {
        origin,
        warnings: &finished.warnings,
        timings,
        frames: Some((solved.len(), finished.frame_rate)),
        points: Some(finished.points.iter().map(String::as_str).collect()),
    };
    results::run_json(&report, request, own)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(residual_m: Option<f64>, overlap: Option<f64>) -> Solved {
        Solved { x: Vec::new(), positions: Vec::new(), residual_m, overlap, steps: 15 }
    }

    #[test]
    fn quality_has_a_row_a_frame_and_empty_cells_where_nothing_is_known() {
        let text = quality_csv(&[frame(Some(0.01), None), frame(None, Some(0.5))], &[6, 0], 50.0);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[1..], ["0,0.000000,6,0.0100000,,15", "1,0.020000,0,,0.5000000,15"]);
    }

    #[test]
    fn a_run_that_fits_badly_says_so() {
        let good = vec![frame(Some(0.002), Some(0.9)); 100];
        assert!(doubts(&good).is_empty());
        let bad = [vec![frame(Some(0.2), Some(-0.5)); 20], vec![frame(None, None); 20]].concat();
        let said = doubts(&bad);
        assert!(said[0].starts_with("in 50 % of the frames the body"), "{said:?}");
        assert!(said[1].starts_with("in 50 % of the frames limbs") && said.len() == 3, "{said:?}");
    }
}
