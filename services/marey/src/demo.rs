//! `marey demo`: the whole way, once, on motion whose truth is known.

mod cameras;

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, bail};
use client::{Client, MotionDatabase, Run, Session};
use serde_json::{Value, json};
use service::config::{TelemetryConfig, Variables, environment};

use crate::{
    database, results,
    sample::Trials,
    serve::runtime,
    take::Take,
    up::{self, Everything},
    upload, watch,
};

/// Where the demo keeps its things.
const FOLDER: &str = ".marey/demo";
/// Trials that are drawn when there is no data.
const NUM_SAMPLES: u32 = 120;
/// Trials that are held out and reconstructed.
const NUM_HELD_OUT: usize = 2;
/// Control points of the sessions.
const POINT_SETS: [&[&str]; 2] = [
    &["left_wrist", "right_wrist", "left_ankle", "right_ankle"],
    &["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"],
];
/// Marey's method, and the baseline it is compared with.
const METHODS: [&str; 2] = ["local-regression", "nearest"];

/// Show what Marey does, on motion of its own or on yours
///
/// Starts everything, builds a motion database, and reconstructs trials that are not in it from 4 and 6 of their points;
/// then follows a synthetic person through the silhouettes of six cameras. Says how far the results are from the truth,
/// and how far those of a plain baseline are. Without --data, all of it is shown on synthetic motion.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder with recordings: ASF and AMC, or BVH, also .zst or .gz
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Leave it running when all is shown, until Ctrl-C
    #[arg(long)]
    keep: bool,
}

/// Runs `marey demo`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut telemetry = TelemetryConfig::from_variables(&Variables::new(&environment))?;
    telemetry.filter.get_or_insert_with(|| "error".into());
    service::telemetry::start(&telemetry)?;
    runtime()?.block_on(async {
        let shutdown = service::shutdown::on_signal()?;
        let begin = Instant::now();
        let folder = Path::new(FOLDER);
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        step("Starting PostgreSQL, the gateway and all services");
        let up = up::Args { data_dir: folder.to_owned(), listen: ([127, 0, 0, 1], 0).into(), workers: None };
        let Some(everything) = Everything::start(&up, shutdown.clone()).await? else { return Ok(()) };
        let client = Client::new(everything.server.clone());
        println!("  listening at {}, database in {}", client.url(), everything.cluster_dir.display());
        let data = args.data.clone();
        let show = tokio::task::spawn_blocking(move || show(&client, data.as_deref(), folder));
        // Ctrl-C ends the services, and so whatever waits for them
        let shown = tokio::select! {
            shown = show => shown?,
            () = shutdown.cancelled() => Err(anyhow::anyhow!("stopped before the end")),
        };
        if shown.is_ok() {
            println!("\nDone in {:.0} s.", begin.elapsed().as_secs_f64());
            if args.keep {
                println!("Still running at {}; Ctrl-C stops it.", everything.server.url);
                shutdown.cancelled().await;
            }
        }
        shutdown.cancel();
        everything.until_stopped(shutdown).await?;
        shown
    })
}

/// One reconstruction.
struct Asked<'a> {
    take: &'a Take,
    num_points: usize,
    method: &'static str,
}

impl Asked<'_> {
    /// Name of the folder with its results.
    fn folder(&self) -> String {
        format!("{}-{}-points-{}", self.take.name, self.num_points, self.method)
    }
}

/// What came of it.
struct Row<'a> {
    asked: Asked<'a>,
    report: Value,
    errors: Value,
}

fn show(client: &Client, data: Option<&Path>, folder: &Path) -> anyhow::Result<()> {
    let recordings = match data {
        Some(data) => data.to_owned(),
        None => {
            step("Drawing synthetic trials (walking, running, jumping, boxing)");
            let samples = folder.join("sample-motion");
            remove(&samples)?;
            Trials { count: NUM_SAMPLES, seed: 1, action: None, frames: 240, points: None }
                .write(&samples)?;
            println!("  {NUM_SAMPLES} trials in {}: {}", samples.display(), sample_motion::NOTICE);
            samples
        }
    };
    let takes = Take::find_all(&recordings)?;
    let (held_out, rest) = hold_out(&takes)?;
    step("Building a motion database of all trials but those to be reconstructed");
    let files =
        rest.iter().flat_map(|take| take.indices.iter().chain([&take.motion]).chain(&take.skeleton).cloned());
    let mut files: Vec<PathBuf> = files.collect();
    files.sort();
    files.dedup();
    let database = build(client, &files)?;
    println!("  {} poses of {} clips", database.num_poses.unwrap_or(0), database.num_clips.unwrap_or(0));

    let output = folder.join("results");
    remove(&output)?;
    let mut rows = Vec::new();
    for take in &held_out {
        let recording = take.read()?;
        for points in POINT_SETS {
            let name = format!("{} from {} points", take.name, points.len());
            step(&format!("Session {name:?}: uploading and reconstructing"));
            let session = upload_session(client, &name, points, &recording)?;
            for method in METHODS {
                let asked = Asked { take, num_points: points.len(), method };
                rows.push(reconstruct(client, &session, &database, asked, &output)?);
            }
        }
    }
    print_table(&rows);
    let synthetic = if data.is_none() { " The motion is synthetic; recorded motion is harder." } else { "" };
    println!("\nErrors are against the true motion, which was not used.{synthetic}");
    cameras::show(client, folder, &output)?;
    println!("\nEverything is in {}:", output.canonicalize().unwrap_or(output.clone()).display());
    for row in &rows {
        println!("  {}", row.asked.folder());
    }
    println!("  {}", cameras::FOLDER);
    println!(
        "To look at one: in Blender, File > Import > Motion Capture (.bvh), then take its motion.bvh and press play."
    );
    Ok(())
}

/// Takes to be reconstructed and takes to learn from, of performers who have both; the same every time.
fn hold_out(takes: &[Take]) -> anyhow::Result<(Vec<Take>, Vec<Take>)> {
    let mut performers: Vec<&[Take]> =
        takes.chunk_by(|a, b| a.performer() == b.performer()).filter(|of_one| of_one.len() > 2).collect();
    if performers.is_empty() && takes.len() > 2 {
        performers.push(takes);
    }
    let stride = (performers.len() / NUM_HELD_OUT).max(1);
    let chosen = performers.into_iter().step_by(stride).take(NUM_HELD_OUT).enumerate();
    // not each performer's last: where actions come in turn, these would be of one kind
    let held_out: Vec<Take> = chosen
        .map(|(i, of_one)| of_one[(of_one.len() + i).saturating_sub(4) % of_one.len()].clone())
        .collect();
    if held_out.is_empty() {
        bail!("found {} trials (ASF with AMC, or BVH), expected at least 3", takes.len());
    }
    let rest =
        takes.iter().filter(|take| held_out.iter().all(|h| h.motion != take.motion)).cloned().collect();
    Ok((held_out, rest))
}

fn build(client: &Client, files: &[PathBuf]) -> anyhow::Result<MotionDatabase> {
    let (database, run) = database::build(client, "demo", files)?;
    watch::until_end(client, &run.id)?;
    client.get(&format!("/v1/motion-databases/{}", database.id))
}

fn upload_session(
    client: &Client,
    name: &str,
    points: &[&str],
    recording: &crate::take::Recording,
) -> anyhow::Result<Session> {
    let session = client.create_session(name)?;
    let trajectories = evaluation::control_trajectories(&recording.motion, points)?;
    let put = |name: &str, role: &str, content: &[u8]| -> anyhow::Result<()> {
        let mut file = tempfile::tempfile()?;
        file.write_all(content)?;
        std::io::Seek::rewind(&mut file)?;
        upload::put(client, &session, name, Some(role), file)
    };
    put("points.csv", "control-points", formats::points_csv::write(&trajectories).as_bytes())?;
    match &recording.skeleton_text {
        Some(skeleton) => {
            put("skeleton.asf", "skeleton", skeleton)?;
            put("truth.amc", "ground-truth", &recording.motion_text)?;
        }
        None => {
            put("skeleton.bvh", "skeleton", &recording.motion_text)?;
            put("truth.bvh", "ground-truth", &recording.motion_text)?;
        }
    }
    Ok(session)
}

fn reconstruct<'a>(
    client: &Client,
    session: &Session,
    database: &MotionDatabase,
    asked: Asked<'a>,
    output: &Path,
) -> anyhow::Result<Row<'a>> {
    let request = json!({ "motion_database": database.id, "method": asked.method });
    let run: Run = client.post(&format!("/v1/sessions/{}/runs", session.id), &request)?;
    watch::until_end(client, &run.id)?;
    let to = output.join(asked.folder());
    results::download(client, &run.id, &to)?;
    let read = |name: &str| -> anyhow::Result<Value> {
        let path = to.join(name);
        let text = fs::read(&path).with_context(|| path.display().to_string())?;
        serde_json::from_slice(&text).with_context(|| path.display().to_string())
    };
    Ok(Row { report: read("run.json")?, errors: read("evaluation.json")?, asked })
}

fn print_table(rows: &[Row]) {
    println!("\n{:<16} {:>6}  {:<17} {:>9} {:>12} {:>9} {:>9}", "", "", "", "joint", "joint", "", "");
    println!(
        "{:<16} {:>6}  {:<17} {:>9} {:>12} {:>9} {:>9}",
        "trial", "points", "method", "angles °", "positions cm", "frames", "frames/s"
    );
    for row in rows {
        let error = |name: &str| row.errors[name].as_f64().unwrap_or(f64::NAN);
        println!(
            "{:<16} {:>6}  {:<17} {:>9.2} {:>12.2} {:>9} {:>9.0}",
            row.asked.take.name,
            row.asked.num_points,
            row.asked.method,
            error("rms_deg"),
            error("mpjpe_cm"),
            row.report["session"]["frames"].as_u64().unwrap_or(0),
            row.report["timings"]["frames_per_second"].as_f64().unwrap_or(f64::NAN),
        );
    }
}

fn step(what: &str) {
    println!("\n{what}");
}

fn remove(folder: &Path) -> anyhow::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| folder.display().to_string())
        }
        _ => Ok(()),
    }
}
