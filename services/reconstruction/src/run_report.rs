//! `run.json`: all that decided the result, and what it took.

use crate::feet::{Finished, FootReport};
use formats::FileRole;
use jobs::{
    InputFile, JobReport,
    motion_database::MotionDatabaseFile,
    sparse::{FittedReport, MergeChunks},
};
use serde::Serialize;
use sparse::{FrameQuality, Parameters};
use std::collections::BTreeMap;
use uuid::Uuid;

/// Name of the result.
pub(crate) const RUN: &str = "run.json";

#[derive(Serialize)]
pub(crate) struct RunReport<'a> {
    run_id: Uuid,
    kind: &'static str,
    code: Code,
    session: SessionReport<'a>,
    motion_database: &'a MotionDatabaseFile,
    parameters: &'a Parameters,
    /// Nothing in this method is drawn at random.
    seeds: [u64; 0],
    /// The skeleton that was fitted, if the session came without one.
    fitted_skeleton: Option<&'a FittedReport>,
    quality: Summary,
    /// Feet, where they were looked for and found.
    feet: Option<&'a FootReport>,
    warnings: Vec<String>,
    timings: Timings<'a>,
}

#[derive(Serialize)]
struct Code {
    version: &'static str,
    /// Commit that it was built from, when the build said so.
    commit: Option<&'static str>,
}

#[derive(Serialize)]
struct SessionReport<'a> {
    id: Uuid,
    name: &'a str,
    frames: usize,
    frame_rate_hz: f64,
    points: &'a [String],
    mapping: &'a BTreeMap<String, String>,
    files: Vec<FileReport<'a>>,
}

#[derive(Serialize)]
struct FileReport<'a> {
    name: &'a str,
    role: FileRole,
    bytes: u64,
    blake3: &'a str,
}

#[derive(Serialize)]
struct Summary {
    mean_residual_m: f64,
    max_residual_m: f64,
    mean_sigma_rad: f64,
    frames_without_measurement: usize,
}

#[derive(Serialize)]
struct Timings<'a> {
    plan: &'a JobReport,
    chunks: &'a [JobReport],
    merge: &'a JobReport,
    /// Computed frames a second over all chunks, warm-up and blending included.
    frames_per_second: f64,
}

impl<'a> RunReport<'a> {
    /// Of a run that has just been merged.
    pub fn new(
        run_id: Uuid,
        job: &'a MergeChunks,
        finished: &'a Finished,
        chunks: &'a [JobReport],
        merge: &'a JobReport,
    ) -> Self {
        let request = &job.request;
        let file =
            |f: &'a InputFile| FileReport { name: &f.name, role: f.role, bytes: f.bytes, blake3: &f.blake3 };
        let seconds: f64 = chunks.iter().map(|c| c.seconds).sum();
        let frames: usize = chunks.iter().map(|c| c.frames).sum();
        Self {
            run_id,
            kind: "reconstruction",
            code: Code { version: env!("CARGO_PKG_VERSION"), commit: option_env!("MAREY_COMMIT") },
            session: SessionReport {
                id: request.session_id,
                name: &request.session_name,
                frames: finished.merged.quality.len(),
                frame_rate_hz: motion_db::FRAME_RATE,
                points: &job.points,
                mapping: &request.mapping,
                files: request.files.iter().map(file).collect(),
            },
            motion_database: &request.motion_database,
            parameters: &request.parameters,
            seeds: [],
            fitted_skeleton: job.fitted.as_ref(),
            quality: summary(&finished.merged.quality),
            feet: finished.feet.as_ref().map(|feet| &feet.report),
            warnings: [&job.warnings[..], &doubts(&finished.merged.quality, request.parameters.lost_energy)]
                .concat(),
            timings: Timings {
                plan: &job.plan,
                chunks,
                merge,
                frames_per_second: if seconds > 0.0 { frames as f64 / seconds } else { 0.0 },
            },
        }
    }
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
    let count = quality.len().max(1) as f64;
    Summary {
        mean_residual_m: quality.iter().map(|q| q.residual_m).sum::<f64>() / count,
        max_residual_m: quality.iter().map(|q| q.residual_m).fold(0.0, f64::max),
        mean_sigma_rad: quality.iter().map(|q| q.sigma_rad).sum::<f64>() / count,
        frames_without_measurement: quality.iter().filter(|q| q.measured_points == 0).count(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(energy: f64, measured_points: usize) -> FrameQuality {
        FrameQuality { residual_m: 0.0, sigma_rad: 0.1, energy, neighbour_distance_deg: 3.0, measured_points }
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
