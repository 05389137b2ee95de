use std::{num::NonZeroUsize, path::PathBuf, time::Instant};

use anyhow::{Context, bail};
use clap::ValueEnum;
use evaluation::{Protocol, SparseEvaluation, evaluate_sparse, shuffle_by_name, summarise};
use motion_db::{Augment, Clip};

use super::{
    sweep::SweepArgs,
    written::{Outcome, Written},
};
use crate::{motions, progress::Progress};

/// Every n-th trial, in the order of names, is for tuning; the others are for reporting.
const TUNING_STEP: usize = 3;

/// `marey evaluate sparse`
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The control points are taken from each trial itself; its motion is reconstructed from them and compared.

trial-out    everything but the trial itself is in the database (as in the papers)
subject-out  nothing of the trial's performer is in the database (what a new user gets)
trial-in     the trial itself is in the database: an upper bound, not a result

Examples:
  marey evaluate sparse --train recordings/ --test recordings/ --points 4,6 --html report.html
  marey evaluate sparse --train recordings/ --test recordings/ --actions walk --json errors.json
  marey evaluate sparse --train recordings/ --test recordings/ --points 6 --window 1,2,3,4
  marey evaluate sparse --train recordings/ --test recordings/ --points 6 --occlusion one:0.5s")]
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
    /// Add to the database what is made of its motion: mirror, warp (0.8 and 1.25 times the speed)
    #[arg(long, value_enum, value_delimiter = ',', value_name = "WAY")]
    augment: Vec<Augmentation>,
    #[command(flatten)]
    sweep: SweepArgs,
    /// Only the first frames of each trial, at 60 a second
    #[arg(long, default_value_t = 120, value_parser = client::numbers::at_least_one)]
    frames: usize,
    /// Only trials of these actions (column action of index.csv)
    #[arg(long, value_delimiter = ',', value_name = "ACTION")]
    actions: Vec<String>,
    /// Which of the trials: those the defaults were tuned on, the others, or all
    #[arg(long, value_enum, default_value_t = Part::All)]
    part: Part,
    /// Trials reconstructed at once [default: as many as there are processors]; the errors do not depend on it, frames/s are those of
    /// one trial and only meaningful with 1 thread
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    #[command(flatten)]
    written: Written,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ProtocolName {
    TrialOut,
    SubjectOut,
    TrialIn,
}

impl From<ProtocolName> for Protocol {
    fn from(name: ProtocolName) -> Self {
        match name {
            ProtocolName::TrialOut => Self::TrialOut,
            ProtocolName::SubjectOut => Self::SubjectOut,
            ProtocolName::TrialIn => Self::TrialIn,
        }
    }
}

/// How more motion is made of recorded motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Augmentation {
    /// left and right exchanged
    Mirror,
    /// played at 0.8 and 1.25 times the speed
    Warp,
}

/// Which part of the trials is reconstructed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Part {
    /// every third trial by name: parameters may be tuned on these
    Tune,
    /// all others
    Report,
    /// all
    All,
}

/// Runs `marey evaluate sparse`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    args.written.check()?;
    let sweep = args.sweep.sweep()?;
    let mut train = augmented(motions::read(&args.train)?, &args.augment)?;
    if sweep.database_sizes != [None] {
        shuffle_by_name(&mut train);
    }
    let (test, tuning) = chosen(motions::read(&args.test)?, &args.actions, args.part)?;
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let threads = args.threads.map_or(cores, NonZeroUsize::get);
    let evaluation = SparseEvaluation {
        train: &train,
        test: &test,
        protocol: args.protocol.into(),
        sweep,
        max_frames: args.frames,
        threads,
    };
    let bar = Progress::new(0, "trials")?;
    let begin = Instant::now();
    let results = evaluate_sparse(&evaluation, &|| begin.elapsed().as_secs_f64(), &|done, total| {
        bar.set(done, total);
    })?;
    bar.finish();
    let rows = summarise(&results, evaluation.protocol);
    if rows.is_empty() {
        bail!("no trial is long enough for the gap with half a second before and after it");
    }
    let outcome = Outcome {
        synthetic: train.iter().chain(&test).any(is_synthetic),
        evaluation: &evaluation,
        results: &results,
        rows: &rows,
        tuning: if args.part == Part::Report { &tuning } else { &[] },
        seconds: begin.elapsed().as_secs_f64(),
    };
    outcome.print();
    args.written.write(&outcome)
}

/// The clips and what is made of them.
fn augmented(clips: Vec<Clip>, ways: &[Augmentation]) -> anyhow::Result<Vec<Clip>> {
    if ways.is_empty() {
        return Ok(clips);
    }
    let speeds = if ways.contains(&Augmentation::Warp) { Augment::warps() } else { Vec::new() };
    let augment = Augment { mirror: ways.contains(&Augmentation::Mirror), speeds };
    let mut all = Vec::new();
    for clip in &clips {
        all.extend(augment.clips(clip).with_context(|| format!("trial {}", clip.name))?);
    }
    Ok(all)
}

/// The trials to be reconstructed, and the names of those that are for tuning.
pub(super) fn chosen(
    mut candidates: Vec<Clip>,
    actions: &[String],
    part: Part,
) -> anyhow::Result<(Vec<Clip>, Vec<String>)> {
    if !actions.is_empty() {
        candidates.retain(|clip| actions.contains(&clip.action));
    }
    let (mut test, mut tuning) = (Vec::new(), Vec::new());
    for (i, clip) in candidates.into_iter().enumerate() {
        let is_tuning = i.is_multiple_of(TUNING_STEP);
        if is_tuning {
            tuning.push(clip.name.clone());
        }
        if part == Part::All || is_tuning == (part == Part::Tune) {
            test.push(clip);
        }
    }
    if test.is_empty() {
        bail!("no trial to reconstruct: found none of the actions {}", actions.join(", "));
    }
    Ok((test, tuning))
}

/// Whether a clip was drawn from the sample motion, which names its skeletons so.
fn is_synthetic(clip: &Clip) -> bool {
    clip.motion.skeleton().name().to_ascii_lowercase().starts_with("synthetic")
}
