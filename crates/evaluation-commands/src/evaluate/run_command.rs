//! `marey evaluate run`.

use std::{fs, path::PathBuf};

use anyhow::{Context, bail};
use client::{Client, ResultFile, ServerArgs, encode, outputs};
use evaluation::{
    Comparison, ContactThresholds, FootPaths, FootSlide, at_60_hz, compare_in_detail, foot_slide,
    report::{About, run_errors, run_report},
};
use formats::{BvhOptions, FileRole, archive, points_csv, session, session::MotionFormat};
use kinematics::{Parametrisation, References};
use model::{Motion, counted};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tempfile::TempDir;

use super::{
    run_joints,
    run_truth::{File, only, true_motion},
    written::{command, write},
};

/// Most bytes of an unpacked file.
const MAX_BYTES: u64 = 2 << 30;

/// `marey evaluate run`
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The truth is the session's file of ground truth (an AMC on the session's skeleton, or a BVH), also when it was uploaded after the \
run. Runs on cameras and by inverse kinematics have a body of their own: their joints are compared, by name, with true ones.

Examples:
  marey upload \"take 3\" truth.amc
  marey evaluate run \"take 3\" --html report.html
  marey evaluate run \"take 3\" --truth truth.amc
  marey evaluate run \"synthetic walk\" --truth capture/groundtruth/joints.json")]
pub struct Args {
    /// The run: its id, or a session's name for its newest run
    run: String,
    /// The true motion: AMC or BVH, also .zst; true joints for a run on cameras: .json, .csv, .trc or .c3d [default: the
    /// session's ground-truth file]
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Write a report to this file, one page with tables and plots, to be opened in a browser; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write the errors, by frame and by joint, to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

/// What is looked at of a run.
#[derive(Debug, Deserialize)]
struct Run {
    id: String,
    kind: String,
    state: String,
    session_id: Option<String>,
    parameters: Value,
}

/// What is looked at of a session's file.
#[derive(Debug, Deserialize)]
struct SessionFile {
    name: String,
    role: FileRole,
    blake3: String,
}

#[derive(Serialize)]
struct Json<'a> {
    run: &'a str,
    truth: &'a str,
    #[serde(flatten)]
    comparison: &'a Comparison,
    foot_slide: Option<FootSlide>,
}

/// Runs `marey evaluate run`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    outputs::check(
        &[("--truth", args.truth.as_ref())],
        &[("--html", args.html.as_ref()), ("--json", args.json.as_ref())],
    )?;
    let client = Client::new(args.server.server()?);
    let run: Run = client.get(&format!("/v1/runs/{}", client.find_run(&args.run)?))?;
    if run.state != "succeeded" {
        let state = match run.state.as_str() {
            "failed" => "failed".to_owned(),
            "cancelled" => "was cancelled".to_owned(),
            state => format!("is {state}, not finished yet"),
        };
        bail!("run {} {state}; see `marey status {}`", run.id, run.id);
    }
    let downloads = Downloads { client: &client, folder: tempfile::tempdir()? };
    match run.kind.as_str() {
        "sparse" => {}
        "multi-view" | "inverse-kinematics" => return joints(args, &downloads, &run),
        kind => bail!("run {} ({kind}) produces no motion", run.id),
    }
    let session = run.session_id.as_deref().context("the run's session has been deleted")?;
    let files = inputs(args, &downloads, session)?;
    let Some(truth) = only(&files, FileRole::GroundTruth)? else {
        bail!(
            "run {} can't be compared: its session has no file of ground truth; upload the true motion on the session's \
             skeleton (`marey upload {session} truth.amc`, or a .bvh), or give it: `marey evaluate run {} --truth FILE`",
            run.id,
            run.id
        );
    };
    let name = &truth.name;
    let found = downloads.motion(&run.id, MotionFormat::from_name(name) == Some(MotionFormat::Bvh))?;
    let mut reading = session::Options::default();
    if let Some(metres) = run.parameters["bvh_metres_per_unit"].as_f64() {
        reading.bvh.metres_per_unit = metres;
    }
    let truth = true_motion(truth, only(&files, FileRole::Skeleton)?, &found, &reading)?;
    if !truth.skeleton().same_structure(found.skeleton()) {
        bail!("the joints of {name} are not those of the result, so they can't be compared");
    }
    let rest = References::rest(truth.skeleton());
    let truth = at_60_hz(&Parametrisation::smooth(truth.skeleton(), &rest)?, &truth, usize::MAX)?;
    let comparison = compare_in_detail(&truth, &found);
    let slide = FootPaths::from_motion(&truth)
        .zip(FootPaths::from_motion(&found))
        .and_then(|(truth, found)| foot_slide(&truth, &found, &ContactThresholds::default()));
    let table = run_errors(&comparison, slide.as_ref());
    println!("run {} compared with {name}\n{}", run.id, table.text().trim_end());
    if truth.num_frames() != found.num_frames() {
        println!(
            "the truth has {} at 60 a second, the result {}: the frames that both have were compared",
            counted(truth.num_frames(), "frame"),
            found.num_frames()
        );
    }
    if let Some(path) = &args.json {
        let json = Json { run: &run.id, truth: name, comparison: &comparison, foot_slide: slide };
        write(path, serde_json::to_vec_pretty(&json)?)?;
    }
    if let Some(path) = &args.html {
        write(path, run_report(&about(&run, name), &comparison, slide.as_ref()).into_bytes())?;
    }
    Ok(())
}

/// How a run that has a body of its own found it.
fn used(kind: &str) -> &'static str {
    if kind == "multi-view" { "used cameras" } else { "used inverse kinematics" }
}

/// The joints of a run that has a body of its own, beside true ones.
fn joints(args: &Args, downloads: &Downloads<'_>, run: &Run) -> anyhow::Result<()> {
    let Some(path) = &args.truth else {
        bail!(
            "run {} {}: give the true joints by --truth FILE (.json of `marey sample-capture`, .csv, .trc or .c3d)",
            run.id,
            used(&run.kind)
        );
    };
    if args.html.is_some() {
        bail!("--html is for runs from control points only; run {} {}", run.id, used(&run.kind));
    }
    let truth = run_joints::read_truth(path)?;
    let found = points_csv::read(&downloads.result(&run.id, "joints.csv")?)?.value;
    let first = run.parameters["parameters"]["first_frame"].as_u64().unwrap_or(0) as usize;
    let report = run_joints::compare(&found, &truth, first)?;
    println!(
        "run {} compared with {}, {}\n{}",
        run.id,
        path.display(),
        counted(report.frames, "frame"),
        report.text().trim_end()
    );
    if let Some(path) = &args.json {
        write(path, serde_json::to_vec_pretty(&report)?)?;
    }
    Ok(())
}

/// The files that tell the truth: the session's skeleton, and its ground truth or the file given.
fn inputs(args: &Args, downloads: &Downloads<'_>, session: &str) -> anyhow::Result<Vec<File>> {
    let session = format!("/v1/sessions/{}/files", encode(session));
    let listed: Vec<SessionFile> = downloads.client.get(&session)?;
    let mut files = Vec::new();
    for file in listed {
        if file.role == FileRole::Skeleton || (file.role == FileRole::GroundTruth && args.truth.is_none()) {
            let bytes = downloads.get(&format!("{session}/{}", encode(&file.name)), &file.blake3)?;
            files.push(File { name: file.name, role: file.role, bytes });
        }
    }
    if let Some(path) = &args.truth {
        let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        files.push(File { name, role: FileRole::GroundTruth, bytes });
    }
    for file in &mut files {
        let unpacked = archive::unpacked(&file.name, &file.bytes, MAX_BYTES);
        if let Some(bytes) = unpacked.with_context(|| file.name.clone())? {
            file.bytes = bytes;
        }
    }
    Ok(files)
}

/// Downloads with their checksums checked, kept no longer than needed.
struct Downloads<'a> {
    client: &'a Client,
    folder: TempDir,
}

impl Downloads<'_> {
    fn get(&self, path: &str, blake3: &str) -> anyhow::Result<Vec<u8>> {
        let to = self.folder.path().join("download");
        self.client.download(path, blake3, &to)?;
        Ok(fs::read(to)?)
    }

    /// A result of a run.
    fn result(&self, run: &str, name: &str) -> anyhow::Result<Vec<u8>> {
        let results = format!("/v1/runs/{}/results", encode(run));
        let listed: Vec<ResultFile> = self.client.get(&results)?;
        let found = listed.iter().find(|file| file.name == name);
        let found = found.with_context(|| format!("run {run} has no result {name}"))?;
        self.get(&format!("{results}/{name}"), &found.blake3)
    }

    /// A run's motion: as BVH beside a BVH, whose joints have that file's channels; else as AMC with its skeleton.
    fn motion(&self, run: &str, as_bvh: bool) -> anyhow::Result<Motion> {
        let file = |name: &str| self.result(run, name);
        if as_bvh {
            return Ok(formats::bvh::read(&file("motion.bvh")?, &BvhOptions::default())?.value);
        }
        let acclaim = formats::asf::read(&file("skeleton.asf")?)?.value;
        Ok(formats::amc::read(&file("motion.amc")?, &acclaim, motion_db::FRAME_RATE)?.value)
    }
}

fn about(run: &Run, truth: &str) -> About {
    let word = |value: &Value| value.as_str().map_or(value.to_string(), str::to_owned);
    let parameters = run.parameters["parameters"].as_object().into_iter().flatten();
    About {
        title: format!("Run {}", run.id),
        introduction: format!("A reconstructed motion compared with the true one, {truth}."),
        facts: vec![
            ("session".to_owned(), word(&run.parameters["session_name"])),
            ("motion database".to_owned(), word(&run.parameters["motion_database"]["name"])),
        ],
        command: command(),
        parameters: parameters.map(|(name, value)| (name.clone(), word(value))).collect(),
        warning: String::new(),
    }
}
