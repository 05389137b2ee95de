//! `marey evaluate ik`.

use std::{path::PathBuf, time::Instant};

use anyhow::{Context, bail};
use body::{BodyModel, Shape};
use client::outputs;
use evaluation::Recording;
use evaluation::limbs::{LimbErrors, Limbs, Method, Still, run_all};
use model::{Motion, Silhouette, counted};
use motion_db::Clip;
use sample_motion::{Action, DrawOptions, Model};
use serde::Serialize;
use vision::scene::SilhouetteNoise;

use super::written::write;
use crate::{motions, progress::Progress};

/// `marey evaluate ik`
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Motion drives the body model, which is rendered for two cameras. For arms of boxers and legs of walkers the \
solver is given the shoulders and wrists, or hips and ankles, and the silhouettes; the elbows and knees found are compared with \
the true ones.

Motion must be on the CMU skeleton, ASF+AMC or BVH, also .zst; the skeleton of an AMC file is looked for beside it. Without any, \
motion is sampled from the model of motion that comes with Marey: it is synthetic.

Examples:
  marey evaluate ik --frames 20
  marey evaluate ik --data recordings/ --frames 20 --json errors.json")]
pub struct Args {
    /// Motion files of people who box
    #[arg(long, num_args = 1.., value_name = "FILE")]
    boxing: Vec<PathBuf>,
    /// Motion files of people who walk
    #[arg(long, num_args = 1.., value_name = "FILE")]
    walking: Vec<PathBuf>,
    /// Folder of motion with an index.csv: its trials whose action is boxing or walk, except those that were tuned on
    #[arg(long, value_name = "DIR", conflicts_with_all = ["boxing", "walking"])]
    data: Option<PathBuf>,
    /// Only the first frames of each trial, at 30 a second
    #[arg(long, default_value_t = 400, value_name = "N")]
    frames: usize,
    /// Write the errors to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Trials that widths and weights were tuned on.
const TUNED_ON: [&str; 2] = ["13_17", "07_01"];
/// Frames of a second of a recording that are looked at.
const FRAME_RATE: f64 = 30.0;
/// Most frames of a trial of the sample motion, and their rate.
const SAMPLED: (usize, f64) = (2000, 60.0);

/// One test of the paper: what moves, and its errors of inner joints in table 2, mm, without and with images.
struct Test {
    action: &'static str,
    limbs: Limbs,
    paper_mm: [f64; 2],
}

const TESTS: [Test; 2] = [
    Test { action: "boxing", limbs: Limbs::Arms, paper_mm: [47.72, 21.39] },
    Test { action: "walk", limbs: Limbs::Legs, paper_mm: [40.69, 16.35] },
];

/// One method in one test.
#[derive(Debug, Serialize)]
struct Row {
    /// `boxing` or `walk`
    action: &'static str,
    /// `exact` or `noisy`
    silhouettes: &'static str,
    method: String,
    /// distance of the found from the true elbows or knees, millimetres
    inner_joint_mean_mm: f64,
    inner_joint_median_mm: f64,
    inner_joint_p95_mm: f64,
    /// mean distance of wrists or ankles from where they were measured, millimetres
    end_effector_mean_mm: f64,
    /// mean of the inner joints, divided by that of plain inverse kinematics
    share_of_plain: f64,
    /// the paper's mean, of other motion: plain inverse kinematics, and two views
    paper_mm: Option<f64>,
}

/// How fast one thread solves.
#[derive(Debug, Serialize)]
struct Speed {
    views: usize,
    steps: usize,
    solves_per_second: f64,
}

/// The trials of an action.
#[derive(Debug, Serialize)]
struct Trials {
    action: &'static str,
    names: Vec<String>,
    frames: usize,
}

#[derive(Debug, Serialize)]
struct Json {
    rows: Vec<Row>,
    speed: Vec<Speed>,
    trials: Vec<Trials>,
    /// trials that widths and weights were tuned on; `--data` leaves them out
    tuned_on: [&'static str; 2],
    /// whether motion was sampled, not recorded
    synthetic: bool,
    seconds: f64,
}

/// Runs `marey evaluate ik`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    outputs::check(&[], &[("--json", args.json.as_ref())])?;
    let began = Instant::now();
    let model = BodyModel::shipped();
    let shape = model.shape(&[]);
    let is_drawn = args.data.is_none() && args.boxing.is_empty() && args.walking.is_empty();
    let found = args.data.iter().cloned().collect::<Vec<_>>();
    let clips = motions::read(&found)?;
    let (mut rows, mut speed, mut trials) = (Vec::new(), Vec::new(), Vec::new());
    for test in TESTS {
        let chosen = if is_drawn {
            sample(test.limbs, args.frames)?
        } else if args.data.is_some() {
            recorded(&clips, test.action)?
        } else {
            let files = if test.limbs == Limbs::Arms { &args.boxing } else { &args.walking };
            motions::read_files(files)?.into_iter().map(|clip| (clip.name, clip.motion)).collect()
        };
        if chosen.is_empty() {
            continue;
        }
        let mut recordings = Vec::new();
        for (name, motion) in &chosen {
            let step = (motion.frame_rate() / FRAME_RATE).round().max(1.0) as usize;
            let mut recording =
                Recording::new(&model, &shape, motion, step).with_context(|| format!("trial {name}"))?;
            recording.poses.truncate(args.frames);
            recordings.push((recording, test.limbs));
        }
        let frames = recordings.iter().map(|(recording, _)| recording.poses.len()).sum();
        // of two cameras, exact and noisy
        let bar = Progress::new(4 * frames, "silhouettes")?;
        bar.note(test.action.to_owned());
        let shown = |silhouette: Silhouette, _, _| {
            bar.inc();
            silhouette
        };
        let exact = run_all(&model, &shape, &recordings, Method::all, &shown)?;
        rows.extend(rows_of(&test, "exact", &exact));
        let with_noise = |silhouette, frame, camera| noisy(shown(silhouette, frame, camera), frame, camera);
        let noisy = run_all(&model, &shape, &recordings, Method::all, &with_noise)?;
        rows.extend(rows_of(&test, "noisy", &noisy));
        bar.finish();
        if let (true, Some(pose)) = (speed.is_empty(), recordings.iter().find_map(|(r, _)| r.poses.first())) {
            speed = speeds(&model, &shape, pose, test.limbs)?;
        }
        let names = chosen.into_iter().map(|(name, _)| name).collect();
        trials.push(Trials { action: test.action, names, frames });
    }
    let seconds = began.elapsed().as_secs_f64();
    let json = Json { rows, speed, trials, tuned_on: TUNED_ON, synthetic: is_drawn, seconds };
    print(&json);
    if let Some(path) = &args.json {
        write(path, serde_json::to_vec_pretty(&json)?)?;
    }
    Ok(())
}

/// The trials of an action that nothing was tuned on.
fn recorded(clips: &[Clip], action: &str) -> anyhow::Result<Vec<(String, Motion)>> {
    let usable = clips.iter().filter(|c| c.action == action && !TUNED_ON.contains(&c.name.as_str()));
    let chosen: Vec<_> = usable.map(|c| (c.name.clone(), c.motion.clone())).collect();
    if chosen.is_empty() {
        bail!(
            "found no trial of action {action} (column action of index.csv) beside {}",
            TUNED_ON.join(" and ")
        );
    }
    Ok(chosen)
}

/// Four trials of the sample motion.
fn sample(limbs: Limbs, frames: usize) -> anyhow::Result<Vec<(String, Motion)>> {
    let action = match limbs {
        Limbs::Arms => Action::Boxing,
        Limbs::Legs => Action::Walk,
    };
    let (most, rate) = SAMPLED;
    let frames = (frames.min(most) as f64 * rate / FRAME_RATE) as usize;
    let options = |subject| DrawOptions { frames: frames.clamp(1, most), subject };
    let draw = |subject| {
        Ok((format!("sample {subject}"), Model::bundled().draw(action, subject, &options(subject))?))
    };
    (1..=4).map(draw).collect()
}

fn noisy(mut seen: Silhouette, frame: usize, camera: usize) -> Silhouette {
    SilhouetteNoise::default().add_to(&mut seen, frame as u64, camera as u64);
    shape_fit::cleaned(&seen)
}

/// One row a method, over all trials.
fn rows_of(test: &Test, silhouettes: &'static str, trials: &[Vec<LimbErrors>]) -> Vec<Row> {
    let num_methods = trials.first().map_or(0, Vec::len);
    let mut plain = f64::NAN;
    let row = |method: usize| {
        let all = || trials.iter().map(|errors| &errors[method]);
        let mut inner_mm: Vec<f64> = all().flat_map(|errors| errors.inner_mm.iter().copied()).collect();
        inner_mm.sort_by(f64::total_cmp);
        let count = inner_mm.len().max(1) as f64;
        let at = |share: f64| inner_mm.get((share * count) as usize).copied().unwrap_or(f64::NAN);
        let mean = inner_mm.iter().sum::<f64>() / count;
        let ends = all().map(|errors| errors.residual_mm * errors.inner_mm.len() as f64).sum::<f64>();
        plain = if method == 0 { mean } else { plain };
        Row {
            action: test.action,
            silhouettes,
            method: trials[0][method].method.clone(),
            inner_joint_mean_mm: mean,
            inner_joint_median_mm: at(0.5),
            inner_joint_p95_mm: at(0.95),
            end_effector_mean_mm: ends / count,
            share_of_plain: mean / plain,
            // the paper's test is of two views
            paper_mm: match method {
                0 => Some(test.paper_mm[0]),
                _ if method + 1 == num_methods => Some(test.paper_mm[1]),
                _ => None,
            },
        }
    };
    (0..num_methods).map(row).collect()
}

/// Solves a second without images, with one view and with two, on this thread: the best of several times.
fn speeds(model: &BodyModel, shape: &Shape, pose: &[f64], limbs: Limbs) -> anyhow::Result<Vec<Speed>> {
    // short times, so that some are not disturbed by other programs
    const SOLVES: usize = 20;
    const TIMES: usize = 200;
    let methods = [Method::plain(), Method::image(limbs, &[0]), Method::image(limbs, &[0, 1])];
    let mut speeds = Vec::new();
    for method in methods {
        let mut still = Still::new(model, shape, pose, limbs, &method)?;
        let mut best = f64::INFINITY;
        let mut steps = 0;
        for _ in 0..TIMES {
            let began = Instant::now();
            for _ in 0..SOLVES {
                steps = still.solve()?.steps;
            }
            best = best.min(began.elapsed().as_secs_f64());
        }
        let solves_per_second = SOLVES as f64 / best;
        speeds.push(Speed { views: method.cameras.len(), steps, solves_per_second });
    }
    Ok(speeds)
}

fn print(json: &Json) {
    println!("distance of elbows of boxers and knees of walkers from the true ones, mm\n");
    println!("action  silhouettes  method                 mean  of plain  median    95 %    ends   paper");
    for row in &json.rows {
        let paper = row.paper_mm.map_or(String::new(), |mm| format!("{mm:.2}"));
        println!(
            "{:7} {:12} {:20} {:6.2} {:8.0} % {:7.2} {:7.2} {:7.2} {paper:>7}",
            row.action,
            row.silhouettes,
            row.method,
            row.inner_joint_mean_mm,
            100.0 * row.share_of_plain,
            row.inner_joint_median_mm,
            row.inner_joint_p95_mm,
            row.end_effector_mean_mm
        );
    }
    println!();
    for Speed { views, steps, solves_per_second } in &json.speed {
        let paper = if *views == 2 { " (paper: 19)" } else { "" };
        println!(
            "{}: {solves_per_second:.0} solves a second of {steps} steps, one thread{paper}",
            counted(views, "view")
        );
    }
    for Trials { action, names, frames } in &json.trials {
        println!("{action}: {} of {}", counted(frames, "frame"), names.join(" "));
    }
    if json.synthetic {
        println!(
            "\nThe motion is synthetic, and the body is of a generator (MakeHuman): these figures say nothing about recorded motion of \
             people and are not comparable with the paper's."
        );
    } else {
        let tuned_on = TUNED_ON.join(" and ");
        println!(
            "\nThe motion is recorded, and the body is of a generator (MakeHuman). The paper's figures are of HumanEva. Widths and \
             weights were tuned on {tuned_on}."
        );
    }
}
