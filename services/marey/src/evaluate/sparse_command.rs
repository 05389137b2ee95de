use std::{fs, path::PathBuf, time::Instant};

use anyhow::{Context, bail};
use clap::ValueEnum;
use evaluation::{Protocol, Row, SparseEvaluation, evaluate_sparse, summarise, table};
use indicatif::{ProgressBar, ProgressStyle};
use motion_db::Clip;
use serde::Serialize;
use sparse::{Method, Parameters};

use super::{motions, papers};

/// Every n-th trial, in the order of names, is for tuning; the others are for reporting.
const TUNING_STEP: usize = 3;

/// `marey evaluate sparse`
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The control points are taken from each trial itself; its motion is reconstructed from them and compared.

  marey evaluate sparse --train walks/ --test walks/ --points 4,6
  marey evaluate sparse --train cmu/ --test cmu/ --actions walk,run,jump --part report --json errors.json

trial-out    everything but the trial itself is in the database (as in the papers)
subject-out  nothing of the trial's performer is in the database (what a new user gets)")]
pub struct Args {
    /// Folders of motion for the database: ASF+AMC or BVH, also .zst
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    train: Vec<PathBuf>,
    /// Folders of trials to reconstruct
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    test: Vec<PathBuf>,
    /// What the database may hold of a trial
    #[arg(long, value_enum, default_value_t = ProtocolName::TrialOut)]
    protocol: ProtocolName,
    /// Numbers of control points, 2 to 6
    #[arg(long, value_delimiter = ',', default_value = "2,3,4,5,6")]
    points: Vec<usize>,
    /// Methods: local-regression, nearest
    #[arg(long, value_delimiter = ',', default_value = "local-regression,nearest")]
    method: Vec<Method>,
    /// Window length, frames at 60 a second
    #[arg(long, value_name = "FRAMES")]
    window: Option<usize>,
    /// Number of nearest windows
    #[arg(long, value_name = "K")]
    neighbours: Option<usize>,
    /// Only the first frames of each trial, at 60 a second
    #[arg(long, default_value_t = 120)]
    frames: usize,
    /// Only trials of these actions (column action of index.csv)
    #[arg(long, value_delimiter = ',', value_name = "ACTION")]
    actions: Vec<String>,
    /// Which of the trials: those the defaults were tuned on, the others, or all
    #[arg(long, value_enum, default_value_t = Part::All)]
    part: Part,
    /// Any other parameter of a reconstruction, as JSON: '{"control_sigma_m": 0.003}'
    #[arg(long, value_name = "JSON")]
    parameters: Option<String>,
    /// Write the rows to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ProtocolName {
    TrialOut,
    SubjectOut,
}

/// Which part of the trials is reconstructed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// every third trial by name: parameters may be tuned on these
    Tune,
    /// all others
    Report,
    /// all
    All,
}

#[derive(Serialize)]
struct Report<'a> {
    rows: &'a [Row],
    parameters: &'a Parameters,
    database_trials: usize,
    database_poses: usize,
    tuning_trials: Vec<&'a str>,
    tested_trials: Vec<&'a str>,
    /// whether any of the motion was drawn from the sample motion, not recorded
    synthetic: bool,
}

/// Runs `marey evaluate sparse`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let parameters = parameters(args)?;
    let train = motions::read(&args.train)?;
    let mut candidates = motions::read(&args.test)?;
    if !args.actions.is_empty() {
        candidates.retain(|clip| args.actions.contains(&clip.action));
    }
    let is_tuning = |i: usize| i.is_multiple_of(TUNING_STEP);
    let tuning: Vec<&str> =
        candidates.iter().enumerate().filter(|(i, _)| is_tuning(*i)).map(|(_, c)| c.name.as_str()).collect();
    let in_part = |i: usize| match args.part {
        Part::Tune => is_tuning(i),
        Part::Report => !is_tuning(i),
        Part::All => true,
    };
    let test: Vec<Clip> =
        candidates.iter().enumerate().filter(|(i, _)| in_part(*i)).map(|(_, c)| c.clone()).collect();
    if test.is_empty() {
        bail!("no trial to reconstruct: found none of the actions {}", args.actions.join(", "));
    }
    let protocol = match args.protocol {
        ProtocolName::TrialOut => Protocol::TrialOut,
        ProtocolName::SubjectOut => Protocol::SubjectOut,
    };
    let evaluation = SparseEvaluation {
        train: &train,
        test: &test,
        protocol,
        points: &args.points,
        methods: &args.method,
        parameters: parameters.clone(),
        max_frames: args.frames,
    };
    let bar = ProgressBar::new(0)
        .with_style(ProgressStyle::with_template("{bar:30} {pos}/{len} trials  {eta} left")?);
    let begin = Instant::now();
    let mut progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let results = evaluate_sparse(&evaluation, &|| begin.elapsed().as_secs_f64(), &mut progress)?;
    bar.finish_and_clear();
    let rows = summarise(&results, protocol, &parameters);
    print!("{}", table(&rows));
    let synthetic = train.iter().chain(&test).any(is_synthetic);
    if synthetic {
        println!("\nThe motion is synthetic: it says nothing about recorded motion, nor beside the papers.");
    } else {
        print_papers(&rows);
    }
    let tested: Vec<&str> = test.iter().map(|c| c.name.as_str()).collect();
    println!("\nprotocol {protocol}; {} trials in the database; tested on {}:", train.len(), tested.len());
    println!("{}", tested.join(" "));
    if args.part == Part::Report {
        println!("the defaults were tuned on others: {}", tuning.join(" "));
    }
    if let Some(path) = &args.json {
        let report = Report {
            rows: &rows,
            parameters: &parameters,
            database_trials: train.len(),
            database_poses: train.iter().map(poses_at_60).sum(),
            tuning_trials: tuning.clone(),
            tested_trials: tested,
            synthetic,
        };
        fs::write(path, serde_json::to_vec_pretty(&report)?)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// Whether a clip was drawn from the sample motion, which names its skeletons so.
fn is_synthetic(clip: &Clip) -> bool {
    clip.motion.skeleton().name().to_ascii_lowercase().starts_with("synthetic")
}

fn poses_at_60(clip: &Clip) -> usize {
    (clip.motion.num_frames() as f64 * motion_db::FRAME_RATE / clip.motion.frame_rate()).ceil() as usize
}

fn parameters(args: &Args) -> anyhow::Result<Parameters> {
    let mut parameters: Parameters = match &args.parameters {
        Some(json) => serde_json::from_str(json).context("--parameters does not parse")?,
        None => Parameters::default(),
    };
    parameters.window = args.window.unwrap_or(parameters.window);
    parameters.neighbours = args.neighbours.unwrap_or(parameters.neighbours);
    parameters.check()?;
    Ok(parameters)
}

fn print_papers(rows: &[Row]) {
    println!("\nbeside the paper (local regression, trial out, its own database):");
    for row in rows.iter().filter(|r| r.action == "all" && r.method == Method::LocalRegression) {
        if let Some(paper) = papers::local_regression(row.points) {
            println!(
                "{} points: RMS {:.2}, mean absolute {:.2}, paper {paper:.2} degrees; {:.0} frames/s, paper {:.0}",
                row.points,
                row.rms_deg,
                row.mae_deg,
                row.frames_per_second,
                papers::FRAMES_PER_SECOND
            );
        }
    }
}
