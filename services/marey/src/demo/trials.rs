//! The part of the demo in which held-out trials are reconstructed from a few of their points.

use std::{fs, io::Write, path::Path};

use anyhow::Context;
use client::{Client, MotionDatabase, Run, Session};
use evaluation::{Picture, control_trajectories};
use formats::{BvhOptions, FileRole};
use model::{Motion, counted};
use serde::Deserialize;
use serde_json::json;

use crate::{
    results,
    take::{Recording, Take},
    upload,
    watch::{self, Display},
};

/// Control points of the sessions.
pub const POINT_SETS: [&[&str]; 2] = [
    &["left_wrist", "right_wrist", "left_ankle", "right_ankle"],
    &["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"],
];
/// Marey's method and the plain baseline.
pub const METHODS: [&str; 2] = ["local-regression", "nearest"];
/// Those of the reconstructions that are downloaded as a whole.
const SHOWN: (usize, &str) = (6, METHODS[0]);
/// File with everybody's errors.
pub const TABLE: &str = "trials.csv";
/// File with the picture.
pub const PICTURE: &str = "picture.svg";

/// What came of the trials.
#[derive(Debug)]
pub struct Outcome {
    /// every reconstruction
    pub errors: Vec<TrialErrors>,
    /// sessions that were uploaded
    pub num_sessions: usize,
    /// the trial in the picture, whose results were downloaded into a folder of that name
    pub shown: String,
    /// the motion found for it
    pub found: Motion,
}

/// How far one reconstruction is from the truth.
#[derive(Debug, Clone)]
pub struct TrialErrors {
    /// the trial
    pub trial: String,
    /// number of control points
    pub num_points: usize,
    /// one of [`METHODS`]
    pub method: &'static str,
    /// root mean square over frames and joint angles, degrees
    pub rms_deg: f64,
    /// mean distance of the joints from their true positions, centimetres
    pub mpjpe_cm: f64,
}

/// What is looked at of `evaluation.json`.
#[derive(Deserialize)]
struct Evaluation {
    rms_deg: f64,
    mpjpe_cm: f64,
}

/// A run that was started.
struct Started<'a> {
    take: &'a Take,
    num_points: usize,
    method: &'static str,
    run: String,
}

/// Uploads a session for each trial and set of points, reconstructs it by each method, and writes the errors, the results that
/// are shown, and a picture into `output`.
pub fn reconstruct(
    client: &Client,
    database: &MotionDatabase,
    takes: &[Take],
    output: &Path,
) -> anyhow::Result<Outcome> {
    let num_sessions = takes.len() * POINT_SETS.len();
    println!(
        "Reconstructing {} from 4 and from 6 points: {num_sessions} sessions, {} runs",
        counted(takes.len(), "trial"),
        num_sessions * METHODS.len()
    );
    let mut started = Vec::new();
    for take in takes {
        let recording = take.read()?;
        for points in POINT_SETS {
            let session = upload_session(client, &take.name, points, &recording)?;
            for method in METHODS {
                let request = json!({ "motion_database": database.id, "method": method });
                let run: Run = client.post(&format!("/v1/sessions/{}/runs", session.id), &request)?;
                started.push(Started { take, num_points: points.len(), method, run: run.id });
            }
        }
    }
    let errors = wait(client, &started)?;
    write_table(&errors, &output.join(TABLE))?;
    let shown = median_trial(&errors).context("no trial was reconstructed")?;
    let found = started.iter().find(|run| run.take.name == shown && (run.num_points, run.method) == SHOWN);
    let found = download(client, found.context("no run of the trial to be shown")?, &errors, output)?;
    Ok(Outcome { errors, num_sessions, shown, found })
}

fn upload_session(
    client: &Client,
    trial: &str,
    points: &[&str],
    recording: &Recording,
) -> anyhow::Result<Session> {
    let session = client.create_session(&format!("{trial} from {} points", points.len()))?;
    let trajectories = control_trajectories(&recording.motion, points)?;
    let put = |name: &str, role: FileRole, content: &[u8]| -> anyhow::Result<()> {
        let mut file = tempfile::tempfile()?;
        file.write_all(content)?;
        std::io::Seek::rewind(&mut file)?;
        upload::send(client, &session, name, Some(role), file).map(|_| ())
    };
    put("points.csv", FileRole::ControlPoints, formats::points_csv::write(&trajectories).as_bytes())?;
    match &recording.skeleton_text {
        Some(skeleton) => {
            put("skeleton.asf", FileRole::Skeleton, skeleton)?;
            put("truth.amc", FileRole::GroundTruth, &recording.motion_text)?;
        }
        None => {
            put("skeleton.bvh", FileRole::Skeleton, &recording.motion_text)?;
            put("truth.bvh", FileRole::GroundTruth, &recording.motion_text)?;
        }
    }
    Ok(session)
}

/// The errors of all runs, when they have ended.
fn wait(client: &Client, started: &[Started]) -> anyhow::Result<Vec<TrialErrors>> {
    let mut display = Display::new();
    let mut errors = Vec::with_capacity(started.len());
    for (index, run) in started.iter().enumerate() {
        let Started { take, num_points, method, run } = run;
        let ended = watch::until_end_with(client, run, |_| ());
        ended.with_context(|| format!("{} from {num_points} points by {method}", take.name))?;
        let Evaluation { rms_deg, mpjpe_cm } =
            client.get(&format!("/v1/runs/{run}/results/evaluation.json"))?;
        let trial = take.name.clone();
        errors.push(TrialErrors { trial, num_points: *num_points, method, rms_deg, mpjpe_cm });
        display.show((index + 1) as f64 / started.len() as f64, "running");
    }
    display.close();
    Ok(errors)
}

fn write_table(errors: &[TrialErrors], path: &Path) -> anyhow::Result<()> {
    let mut table = String::from("trial,points,method,joint_angles_rms_deg,joint_positions_cm\n");
    for TrialErrors { trial, num_points, method, rms_deg, mpjpe_cm } in errors {
        table.push_str(&format!("{trial},{num_points},{method},{rms_deg:.4},{mpjpe_cm:.4}\n"));
    }
    fs::write(path, table).with_context(|| path.display().to_string())
}

/// The trial that is neither good nor bad among those that are shown.
fn median_trial(errors: &[TrialErrors]) -> Option<String> {
    let mut shown: Vec<_> = errors.iter().filter(|e| (e.num_points, e.method) == SHOWN).collect();
    shown.sort_by(|a, b| a.rms_deg.total_cmp(&b.rms_deg));
    Some(shown.get(shown.len() / 2)?.trial.clone())
}

/// Downloads the results of a run beside the true motion, and draws both; the motion found.
fn download(
    client: &Client,
    run: &Started<'_>,
    errors: &[TrialErrors],
    output: &Path,
) -> anyhow::Result<Motion> {
    let folder = output.join(&run.take.name);
    results::download(client, &run.run, &folder)?;
    let recording = run.take.read()?;
    let truth_file = folder.join("truth.bvh");
    fs::write(&truth_file, formats::bvh::write(&recording.motion))
        .with_context(|| truth_file.display().to_string())?;

    let read =
        |name: &str| fs::read(folder.join(name)).with_context(|| folder.join(name).display().to_string());
    let found = formats::bvh::read(&read("motion.bvh")?, &BvhOptions::default())?.value;
    let points = control_trajectories(&recording.motion, POINT_SETS[1])?;
    let own = errors.iter().find(|e| e.trial == run.take.name && (e.num_points, e.method) == SHOWN);
    let own = own.context("no errors of the trial to be shown")?;
    let caption = format!(
        "six measured points (red), the motion found (blue) and the true one (grey): {}, the median of the trials, {:.1}° RMS, {:.1} cm",
        own.trial, own.rms_deg, own.mpjpe_cm
    );
    let svg = Picture { truth: &recording.motion, found: &found, points: &points, caption: &caption }.svg();
    let picture = output.join(PICTURE);
    fs::write(&picture, svg).with_context(|| picture.display().to_string())?;
    Ok(found)
}
