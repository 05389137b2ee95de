//! `marey bench reconstruct`: what a frame takes, and which part of it.

use std::{
    fs,
    ops::ControlFlow,
    path::PathBuf,
    sync::{Mutex, PoisonError},
    time::Instant,
};

use anyhow::{Context, bail};
use client::outputs;
use evaluation::{ControlSet, control_trajectories};
use motion_db::{Clip, MotionDatabase, WindowIndex, trial_name};
use serde::Serialize;
use sparse::{FramePart, Parameters, Reconstructor, Session, control_points};

use crate::motions;

/// Frames a second that the paper prints for windows of 1 to 4 frames, on one core of 2.8 GHz
/// (docs/papers.md#sparse-constraints, table 1).
const PAPER: [f64; 4] = [84.0, 59.0, 34.0, 20.0];
/// Parts of a frame, in the order of the table.
const PARTS: [(&str, FramePart); 5] = [
    ("query", FramePart::Query),
    ("search", FramePart::Search),
    ("prior", FramePart::Prior),
    ("MAP", FramePart::Map),
    ("rest", FramePart::Rest),
];

/// Measure how long one frame of a reconstruction takes on one thread, and each part of it
///
/// Trials of the query folders are reconstructed from their own control points with a database of the training folders, from
/// which the trial itself is left out. Frames that needed a new start are counted separately from steady ones.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
query   measurements in the performer's frame, window features in principal axes
search  the nearest windows
prior   neighbours gathered, local regression, covariance of its leave-one-out residuals
MAP     the most probable pose between prediction and measurement
rest    the pose back in the world, its standard deviations, bookkeeping
start   candidates sought over the whole database and run over the first frames

Examples:
  marey bench reconstruct --train recordings/ --query recordings/
  marey bench reconstruct --train recordings/ --query more/ --windows 2 --json speed.json")]
pub struct Args {
    /// Folders of motion for the database: ASF+AMC or BVH, also .zst
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    train: Vec<PathBuf>,
    /// Folders of trials to reconstruct; a trial that the database holds is left out of it
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    query: Vec<PathBuf>,
    /// Lengths of windows m, frames at 60 a second
    #[arg(long, value_delimiter = ',', default_value = "1,2,3,4", value_parser = clap::value_parser!(u8).range(1..=16))]
    windows: Vec<u8>,
    /// Number of nearest windows K
    #[arg(long, default_value_t = 64, value_name = "K")]
    neighbours: usize,
    /// Number of control points, 2 to 6
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u8).range(2..=6))]
    points: u8,
    /// Only the first frames of each trial, at 60 a second
    #[arg(long, default_value_t = 120)]
    frames: usize,
    /// At most this many trials, spread evenly over their names
    #[arg(long, default_value_t = 24)]
    trials: usize,
    /// Write the numbers to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Mean and median of a time.
#[derive(Debug, Clone, Copy, Serialize)]
struct Time {
    mean_us: f64,
    median_us: f64,
}

impl Time {
    fn from_seconds(mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
        let median = seconds.get(seconds.len() / 2).copied().unwrap_or(0.0);
        Self { mean_us: 1e6 * mean, median_us: 1e6 * median }
    }
}

/// One window length.
#[derive(Debug, Serialize)]
struct Row {
    window: u8,
    /// steady frames that were timed
    frames: usize,
    /// of steady frames: the inverse of their mean time
    frames_per_second: f64,
    /// of all frames, starts among them
    frames_per_second_with_start: f64,
    paper_frames_per_second: Option<f64>,
    /// the whole frame
    frame: Time,
    query: Time,
    search: Time,
    prior: Time,
    map: Time,
    rest: Time,
    /// a frame with the search for a start, or for another start
    start: Time,
    starts: usize,
}

#[derive(Serialize)]
struct Report<'a> {
    rows: &'a [Row],
    poses: usize,
    trials: Vec<&'a str>,
    points: u8,
    neighbours: usize,
    threads: usize,
}

/// Takes the times of parts as they begin, frame by frame.
struct Watch {
    frame_began: Instant,
    part_began: Instant,
    part: Option<FramePart>,
    has_start: bool,
    now: [f64; PARTS.len()],
    steady: Vec<(f64, [f64; PARTS.len()])>,
    starts: Vec<f64>,
}

impl Watch {
    fn new() -> Self {
        let now = Instant::now();
        Self {
            frame_began: now,
            part_began: now,
            part: None,
            has_start: false,
            now: [0.0; PARTS.len()],
            steady: Vec::new(),
            starts: Vec::new(),
        }
    }

    /// A trial begins: what went before is no frame's.
    fn begin_trial(&mut self) {
        self.begin_frame(Instant::now());
    }

    fn begin_frame(&mut self, at: Instant) {
        (self.frame_began, self.part_began, self.part) = (at, at, None);
        (self.has_start, self.now) = (false, [0.0; PARTS.len()]);
    }

    fn end_part(&mut self, at: Instant) {
        if let Some(slot) = PARTS.iter().position(|(_, part)| Some(*part) == self.part) {
            self.now[slot] += (at - self.part_began).as_secs_f64();
        }
    }

    fn begin(&mut self, part: FramePart) {
        let at = Instant::now();
        self.end_part(at);
        self.has_start |= part == FramePart::Start;
        (self.part, self.part_began) = (Some(part), at);
    }

    fn end_frame(&mut self) {
        let at = Instant::now();
        self.end_part(at);
        let whole = (at - self.frame_began).as_secs_f64();
        if self.has_start {
            self.starts.push(whole);
        } else {
            self.steady.push((whole, self.now));
        }
        self.begin_frame(Instant::now());
    }

    fn row(self, window: u8) -> Row {
        let part =
            |slot: usize| Time::from_seconds(self.steady.iter().map(|(_, parts)| parts[slot]).collect());
        let frame = Time::from_seconds(self.steady.iter().map(|(whole, _)| *whole).collect());
        let seconds = self.steady.iter().map(|(whole, _)| whole).chain(&self.starts).sum::<f64>();
        let [query, search, prior, map, rest] = [0, 1, 2, 3, 4].map(part);
        Row {
            window,
            frames: self.steady.len(),
            frames_per_second: 1e6 / frame.mean_us,
            frames_per_second_with_start: (self.steady.len() + self.starts.len()) as f64 / seconds,
            paper_frames_per_second: PAPER.get(usize::from(window) - 1).copied(),
            frame,
            query,
            search,
            prior,
            map,
            rest,
            starts: self.starts.len(),
            start: Time::from_seconds(self.starts),
        }
    }
}

/// Runs `marey bench reconstruct`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    outputs::check(&[], &[("--json", args.json.as_ref())])?;
    let clips = motions::read(&args.query)?;
    let step = clips.len().div_ceil(args.trials.max(1)).max(1);
    let trials: Vec<Clip> = clips.into_iter().step_by(step).collect();
    let database = MotionDatabase::build(&motions::read(&args.train)?)?;
    println!(
        "{} poses in the database, {} trials, {} points, {} neighbours, one thread; times in microseconds",
        database.num_poses(),
        trials.len(),
        args.points,
        args.neighbours
    );
    println!(
        "{:>2} {:>9} {:>10} {:>6} {:>8} {:>8} {:>7} {:>7} {:>7} {:>7} {:>7} {:>9}",
        "m",
        "frames/s",
        "with start",
        "paper",
        "frame",
        "median",
        "query",
        "search",
        "prior",
        "MAP",
        "rest",
        "start"
    );
    let mut rows = Vec::new();
    for &window in &args.windows {
        let row = measure(args, &database, &trials, window)?;
        let paper = row.paper_frames_per_second.map_or("-".to_owned(), |paper| paper.to_string());
        println!(
            "{:>2} {:>9.0} {:>10.0} {:>6} {:>8.1} {:>8.1} {:>7.1} {:>7.1} {:>7.1} {:>7.1} {:>7.1} {:>9.0}",
            row.window,
            row.frames_per_second,
            row.frames_per_second_with_start,
            paper,
            row.frame.mean_us,
            row.frame.median_us,
            row.query.mean_us,
            row.search.mean_us,
            row.prior.mean_us,
            row.map.mean_us,
            row.rest.mean_us,
            row.start.mean_us
        );
        rows.push(row);
    }
    println!(
        "\npaper: frames/s on one core of 2.8 GHz, its own database. frames/s: steady frames, from the mean."
    );
    if let Some(path) = &args.json {
        let report = Report {
            rows: &rows,
            poses: database.num_poses(),
            trials: trials.iter().map(|c| c.name.as_str()).collect(),
            points: args.points,
            neighbours: args.neighbours,
            threads: 1,
        };
        fs::write(path, serde_json::to_vec_pretty(&report)?)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

fn measure(args: &Args, database: &MotionDatabase, trials: &[Clip], window: u8) -> anyhow::Result<Row> {
    let parameters =
        Parameters { window: usize::from(window), neighbours: args.neighbours, ..Parameters::default() };
    let index = WindowIndex::new(database, parameters.window)?;
    let Some(names) = ControlSet::names(usize::from(args.points)) else {
        bail!("--points is {}, expected 2 to 6", args.points);
    };
    let watch = Mutex::new(Watch::new());
    let locked = || watch.lock().unwrap_or_else(PoisonError::into_inner);
    for trial in trials {
        let skeleton = trial.motion.skeleton().clone();
        let points = control_points(&skeleton, names)?;
        let session = Session::new(skeleton, points, &control_trajectories(&trial.motion, names)?)?;
        let watcher = |part| locked().begin(part);
        let mut reconstructor =
            Reconstructor::new(database, &index, &session, &parameters)?.watched(&watcher);
        reconstructor.exclude(|clip| trial_name(&clip.name) == trial_name(&trial.name));
        let frames = session.num_frames().min(args.frames);
        locked().begin_trial();
        reconstructor
            .reconstruct(0..frames, &mut |_| {
                locked().end_frame();
                ControlFlow::Continue(())
            })
            .with_context(|| format!("trial {}", trial.name))?;
    }
    let watch = watch.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(watch.row(window))
}
