use std::{fs, path::PathBuf};

use anyhow::{Context, bail};
use contacts::HoldSettings;
use evaluation::{
    ControlSet, FeetResult, FootNumbers, SkeletonResult, SkeletonSource, SkeletonTrial, at_database_rate,
    evaluate_feet, evaluate_skeletons,
};
use model::counted;
use motion_db::{Clip, MotionDatabase, WindowIndex};
use serde::Serialize;
use skeleton_fit::FitSettings;
use sparse::Parameters;

use super::sparse_command::{Part, chosen};
use crate::motions;

/// What both evaluations take.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders of motion for the database: ASF+AMC or BVH, also .zst
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    train: Vec<PathBuf>,
    /// Folders of trials to reconstruct
    #[arg(long, required = true, num_args = 1.., value_name = "DIR")]
    test: Vec<PathBuf>,
    /// Numbers of control points, 2 to 6
    #[arg(long, value_delimiter = ',', default_value = "4,6")]
    points: Vec<usize>,
    /// Only the first frames of each trial, at 60 a second
    #[arg(long, default_value_t = 120)]
    frames: usize,
    /// Only trials of these actions (column action of index.csv)
    #[arg(long, value_delimiter = ',', value_name = "ACTION")]
    actions: Vec<String>,
    /// Which of the trials: those the defaults were tuned on, the others, or all
    #[arg(long, value_enum, default_value_t = Part::All)]
    part: Part,
    /// Write the numbers of every trial to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs `marey evaluate skeleton`.
pub fn skeletons(args: &Args) -> anyhow::Result<()> {
    let train = motions::read(&args.train)?;
    let (test, _) = chosen(motions::read(&args.test)?, &args.actions, args.part)?;
    let parameters = Parameters::default();
    let mut results = Vec::new();
    let mut others: Option<(String, MotionDatabase, WindowIndex)> = None;
    for clip in &test {
        if others.as_ref().is_none_or(|(subject, ..)| *subject != clip.subject) {
            // Nothing of the performer is known, under whatever number.
            let is_other =
                |c: &&Clip| c.subject != clip.subject && c.motion.skeleton() != clip.motion.skeleton();
            let rest: Vec<Clip> = train.iter().filter(is_other).cloned().collect();
            if rest.is_empty() {
                bail!("trial {}: no recording of another performer is left", clip.name);
            }
            let database = MotionDatabase::build(&rest)?;
            let index = WindowIndex::new(&database, parameters.window)?;
            others = Some((clip.subject.clone(), database, index));
        }
        let Some((_, database, index)) = &others else { continue };
        let clip = Clip { motion: at_database_rate(database, &clip.motion, args.frames)?, ..clip.clone() };
        for &points in &args.points {
            let trial = SkeletonTrial { clip: &clip, database, index };
            let found = evaluate_skeletons(trial, names(points)?, &parameters, &FitSettings::default());
            results.extend(found.with_context(|| format!("trial {}", clip.name))?);
        }
    }
    println!("points  skeleton  height        arm           leg           joints   angles");
    for &points in &args.points {
        for source in
            [SkeletonSource::Own, SkeletonSource::First, SkeletonSource::Mean, SkeletonSource::Fitted]
        {
            let in_case: Vec<_> =
                results.iter().filter(|r| r.points == points && r.source == source).collect();
            print_skeleton_row(points, source, &in_case);
        }
    }
    println!("{}, each from recordings of other performers", counted(test.len(), "trial"));
    write(args, &results)
}

fn print_skeleton_row(points: usize, source: SkeletonSource, results: &[&SkeletonResult]) {
    let mean = |value: &dyn Fn(&SkeletonResult) -> f64| {
        results.iter().map(|r| value(r)).sum::<f64>() / results.len().max(1) as f64
    };
    let length = |i: usize| {
        let (cm, percent) = (mean(&|r| 100.0 * r.error_m[i].abs()), mean(&|r| r.error_percent[i].abs()));
        format!("{cm:.1} cm {percent:.1} %")
    };
    let name = format!("{source:?}").to_lowercase();
    print!("{points:<8}{name:<10}{:<14}{:<14}{:<14}", length(0), length(1), length(2));
    print!("{:.2} cm  {:.2}°", mean(&|r| r.mpjpe_cm), mean(&|r| r.rms_deg));
    if results.iter().any(|r| r.deviations.is_some()) {
        let within =
            mean(&|r| r.deviations.map_or(0.0, |d| d.iter().filter(|d| d.abs() < 1.0).count() as f64 / 3.0));
        print!("  {:.0} % of limbs within 1 σ", 100.0 * within);
    }
    println!();
}

#[derive(Serialize)]
struct FeetTrial<'a> {
    trial: &'a str,
    points: usize,
    #[serde(flatten)]
    result: FeetResult,
}

/// Runs `marey evaluate feet`.
pub fn feet(args: &Args) -> anyhow::Result<()> {
    let train = motions::read(&args.train)?;
    let (test, _) = chosen(motions::read(&args.test)?, &args.actions, args.part)?;
    let parameters = Parameters::default();
    let database = MotionDatabase::build(&train)?;
    let index = WindowIndex::new(&database, parameters.window)?;
    let mut results = Vec::new();
    println!(
        "points  motion  angles   joints    slide in true contacts   balls in found   acceleration   largest"
    );
    for &points in &args.points {
        let first = results.len();
        for clip in &test {
            let truth = at_database_rate(&database, &clip.motion, args.frames)?;
            let result = evaluate_feet(
                &truth,
                &database,
                &index,
                |other| other.name == clip.name,
                names(points)?,
                &parameters,
                &HoldSettings::default(),
            );
            let result = result.with_context(|| format!("trial {}", clip.name))?;
            results.extend(result.map(|result| FeetTrial { trial: &clip.name, points, result }));
        }
        let found = &results[first..];
        let row = |name: &str, pick: &dyn Fn(&FeetResult) -> FootNumbers| {
            let mean = |value: &dyn Fn(FootNumbers) -> f64| {
                found.iter().map(|t| value(pick(&t.result))).sum::<f64>() / found.len().max(1) as f64
            };
            let largest = format!("{:.1} m/s²", mean(&|n| n.largest_acceleration));
            println!(
                "{points:<8}{name:<8}{:.3}°   {:.3} cm  {:<25}{:<17}{:<15}{}",
                mean(&|n| n.rms_deg),
                mean(&|n| n.mpjpe_cm),
                format!("{:.2} cm/s", mean(&|n| n.slide_cm_s)),
                format!("{:.2} cm/s", mean(&|n| n.own_slide_cm_s)),
                format!("{:.2} m/s²", mean(&|n| n.acceleration)),
                largest,
            );
        };
        row("true", &|r| r.truth);
        row("free", &|r| r.free);
        row("held", &|r| r.held);
        let mean = |value: &dyn Fn(&FeetResult) -> f64| {
            100.0 * found.iter().map(|t| value(&t.result)).sum::<f64>() / found.len().max(1) as f64
        };
        println!(
            "        {} of {} trials stand; {:.0} % of standing frames found, {:.0} % of those found are true",
            found.len(),
            test.len(),
            mean(&|r| r.recall),
            mean(&|r| r.precision)
        );
    }
    write(args, &results)
}

fn names(points: usize) -> anyhow::Result<&'static [&'static str]> {
    ControlSet::names(points)
        .with_context(|| format!("{} asked for, expected 2 to 6", counted(points, "control point")))
}

fn write(args: &Args, results: &impl Serialize) -> anyhow::Result<()> {
    let Some(path) = &args.json else { return Ok(()) };
    fs::write(path, serde_json::to_vec_pretty(results)?)
        .with_context(|| format!("cannot write {}", path.display()))
}
