//! `marey bench live`: how long a pose takes, from sending the frame to having it.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use anyhow::{Context, bail, ensure};
use client::{
    Client, Latency, MotionDatabase, Server, ServerArgs,
    live::{Connection, frame_message},
    numbers::{at_least_one, positive},
    outputs,
    parameters::values,
};
use model::{counted, shown_rate};
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::json;
use tokio::time::MissedTickBehavior;

use crate::motions;

const POINTS: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
/// How long a server may take to start.
const START_WAIT: Duration = Duration::from_secs(60);

/// Measure the latency of live streams, gateway included
///
/// Streams control points over WebSockets, as many performers at once would send them, and times every frame from being
/// sent to having its pose. Starts are part of it. Without --database a server is started as a process of its own, on a
/// folder that is thrown away, with a database built from --train (synthetic motion where none is given).
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey bench live --streams 8 --seconds 20
  marey bench live --train recordings/ --test more/ --streams 4 --seconds 10 --json live.json
  marey bench live --database walks --test more/ --streams 2 --seconds 10")]
pub struct Args {
    /// Performers at once
    #[arg(long, default_value_t = 8, value_parser = at_least_one)]
    streams: usize,
    /// Frames a second of each
    #[arg(long, default_value_t = 60.0, value_parser = positive)]
    fps: f64,
    /// How long, after all streams were opened
    #[arg(long, default_value_t = 20.0, value_parser = positive)]
    seconds: f64,
    /// Control points, 2 to 6
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u8).range(2..=6))]
    points: u8,
    /// Folders of motion for the database: ASF+AMC or BVH, also .zst
    #[arg(long, num_args = 1.., value_name = "DIR", conflicts_with = "database")]
    train: Vec<PathBuf>,
    /// Folders of motion that is streamed; trials follow one another without a pause, so that performers jump
    #[arg(long, num_args = 1.., value_name = "DIR")]
    test: Vec<PathBuf>,
    /// Use this database, on a running server
    #[arg(long)]
    database: Option<String>,
    /// Parameter of the method: NAME=VALUE; may be given several times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    parameters: Vec<String>,
    /// Send the frames of all streams at the same moment, instead of evenly spread
    #[arg(long)]
    aligned: bool,
    /// Write the numbers to this file too; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

/// What was measured.
#[derive(Debug, Serialize)]
struct Report {
    streams: usize,
    fps: f64,
    seconds: f64,
    points: u8,
    aligned: bool,
    poses_in_database: Option<u64>,
    frames: u64,
    dropped: u64,
    p50_ms: f64,
    p95_ms: f64,
    p99_ms: f64,
    max_ms: f64,
}

/// Runs `marey bench live`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    outputs::check(&[], &[("--json", args.json.as_ref())])?;
    let folder = tempfile::tempdir()?;
    let performers = performers(args, folder.path())?;
    let (server, database, _process) = match &args.database {
        Some(name) => (args.server.server()?, name.clone(), None),
        None => {
            let (server, process) = OwnServer::start(folder.path())?;
            build(&server, &args.train, folder.path())?;
            (server, "bench".to_owned(), Some(process))
        }
    };
    let client = Client::new(server.clone());
    let built: MotionDatabase = client.get(&format!("/v1/motion-databases/{}", client::encode(&database)))?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    let runtime = runtime.context("the runtime can't be started")?;
    let latency = runtime.block_on(stream_all(args, &server, &database, performers))?;
    let report = Report {
        streams: args.streams,
        fps: args.fps,
        seconds: args.seconds,
        points: args.points,
        aligned: args.aligned,
        poses_in_database: built.num_poses,
        frames: latency.frames,
        dropped: latency.dropped,
        p50_ms: latency.quantile_ms(0.5),
        p95_ms: latency.quantile_ms(0.95),
        p99_ms: latency.quantile_ms(0.99),
        max_ms: latency.quantile_ms(1.0),
    };
    println!(
        "{} at {} frames/s for {} s, {} points, {} poses in the database",
        counted(args.streams, "stream"),
        shown_rate(args.fps),
        args.seconds,
        args.points,
        built.num_poses.unwrap_or_default()
    );
    println!("{latency}");
    if let Some(path) = &args.json {
        let json = serde_json::to_vec_pretty(&report)?;
        std::fs::write(path, json).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// What one performer's markers do.
#[derive(Debug, Clone)]
struct Performer {
    skeleton_asf: String,
    /// shape `[frames][points]`, 60 frames a second
    frames: Vec<Vec<Vector3<f64>>>,
}

/// One for each stream, of the trials in turn.
fn performers(args: &Args, folder: &Path) -> anyhow::Result<Vec<Performer>> {
    let mut test = args.test.clone();
    if test.is_empty() {
        let samples = folder.join("test");
        draw_trials(&samples, args.streams, 1000)?;
        test.push(samples);
    }
    let names = &POINTS[..usize::from(args.points)];
    let mut trials = Vec::new();
    for clip in motions::read(&test)? {
        let paths = evaluation::control_trajectories(&clip.motion, names)?;
        let step = (paths.frame_rate() / 60.0).round().max(1.0) as usize;
        let frames: Vec<_> = (0..paths.num_frames()).step_by(step).map(|f| paths.frame(f).to_vec()).collect();
        trials.push(Performer { skeleton_asf: formats::asf::write(clip.motion.skeleton()), frames });
    }
    // Trials of one performer follow one another; another performer's would need another skeleton.
    let performer = |stream: usize| trials[stream % trials.len()].clone();
    Ok((0..args.streams).map(performer).collect())
}

/// Another command of this program, which says on standard output only what this one does not.
fn marey(arguments: &[&OsStr]) -> anyhow::Result<Command> {
    let mut command = Command::new(std::env::current_exe().context("this program")?);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null());
    Ok(command)
}

fn run_to_its_end(mut command: Command) -> anyhow::Result<()> {
    let status = command.status().context("this program")?;
    ensure!(
        status.success(),
        "`marey {}` ended with {status}",
        command.get_args().collect::<Vec<_>>().join(OsStr::new(" ")).display()
    );
    Ok(())
}

/// Synthetic trials of ten seconds.
fn draw_trials(folder: &Path, count: usize, seed: u64) -> anyhow::Result<()> {
    let mut command = marey(&["sample".as_ref(), "--out".as_ref(), folder.as_os_str()])?;
    command.args(["--frames", "600", "--count", &count.to_string(), "--seed", &seed.to_string()]);
    run_to_its_end(command)
}

/// Has a database built from the folders given, else from synthetic trials.
fn build(server: &Server, train: &[PathBuf], folder: &Path) -> anyhow::Result<()> {
    let mut train = train.to_vec();
    if train.is_empty() {
        let samples = folder.join("train");
        draw_trials(&samples, 40, 1)?;
        train.push(samples);
    }
    let mut command = marey(&["db", "build", "bench"].map(OsStr::new))?;
    command.args(&train).arg("--watch");
    command.env("MAREY_URL", &server.url).env("MAREY_API_KEY", &server.api_key);
    run_to_its_end(command)
}

async fn stream_all(
    args: &Args,
    server: &Server,
    database: &str,
    performers: Vec<Performer>,
) -> anyhow::Result<Latency> {
    let mut streams = Vec::new();
    for performer in performers {
        let points = &POINTS[..usize::from(args.points)];
        let mut start = json!({ "type": "start", "points": points, "skeleton_asf": performer.skeleton_asf });
        start["parameters"] = values(&args.parameters)?.into();
        streams.push((Connection::open(server, database, &start).await?, performer.frames));
    }
    let begin = Instant::now() + Duration::from_millis(100);
    let period = Duration::from_secs_f64(1.0 / args.fps);
    let count = (args.seconds * args.fps) as u64;
    let number = streams.len();
    let tasks: Vec<_> = streams
        .into_iter()
        .enumerate()
        .map(|(i, (connection, frames))| {
            let share = if args.aligned { 0.0 } else { i as f64 / number as f64 };
            tokio::spawn(stream(connection, frames, begin + period.mul_f64(share), period, count))
        })
        .collect();
    let (mut latencies, mut dropped) = (Vec::new(), 0);
    for task in tasks {
        let (seconds, lost) = task.await??;
        latencies.extend(seconds);
        dropped += lost;
    }
    Ok(Latency::from_seconds(latencies, count * number as u64, dropped))
}

/// Sends `count` frames, one a period; how long each pose took, seconds, and how many frames had none.
async fn stream(
    connection: Connection,
    frames: Vec<Vec<Vector3<f64>>>,
    begin: Instant,
    period: Duration,
    count: u64,
) -> anyhow::Result<(Vec<f64>, u64)> {
    let Connection { mut sender, mut receiver, .. } = connection;
    let sending = tokio::spawn(async move {
        let mut clock = tokio::time::interval_at(begin.into(), period);
        clock.set_missed_tick_behavior(MissedTickBehavior::Burst);
        for (number, points) in (1..=count).zip(frames.iter().cycle()) {
            clock.tick().await;
            let time = begin.elapsed().as_secs_f64();
            sender.send(frame_message(number, time, points.as_slice().into())).await?;
        }
        sender.send(json!({ "type": "end" }).to_string()).await
    });
    let (mut latencies, mut dropped) = (Vec::new(), 0);
    while let Some(message) = receiver.next().await? {
        match message["type"].as_str() {
            Some("pose") => {
                let sent = message["time"].as_f64().unwrap_or(f64::NAN);
                latencies.push(begin.elapsed().as_secs_f64() - sent);
                dropped = message["dropped"].as_u64().unwrap_or(dropped);
            }
            Some("error") => bail!("{}", message["message"].as_str().unwrap_or_default()),
            _ => {}
        }
    }
    sending.await??;
    Ok((latencies, dropped))
}

/// `marey up` as a process that does not outlive the bench.
struct OwnServer(Child);

impl OwnServer {
    fn start(folder: &Path) -> anyhow::Result<(Server, Self)> {
        let data = folder.join("server");
        let mut command = marey(&["up".as_ref(), "--data-dir".as_ref(), data.as_os_str()])?;
        let child = command.args(["--listen", "127.0.0.1:0"]).spawn().context("marey up")?;
        let mut own = Self(child);
        let begin = Instant::now();
        loop {
            if let Some(server) = Server::in_data_dir(&data).ok().flatten() {
                return Ok((server, own));
            }
            if let Some(status) = own.0.try_wait()? {
                bail!("marey up ended with {status}");
            }
            if begin.elapsed() > START_WAIT {
                bail!("marey up has not started within {START_WAIT:?}");
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for OwnServer {
    fn drop(&mut self) {
        // SIGTERM, so that its PostgreSQL ends too.
        if let Some(pid) = rustix::process::Pid::from_raw(self.0.id() as i32) {
            let _ = rustix::process::kill_process(pid, rustix::process::Signal::TERM);
        }
        let _ = self.0.wait();
    }
}
