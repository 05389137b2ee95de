//! `marey sample`: synthetic recordings.

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use evaluation::{ControlSet, control_trajectories};
use sample_motion::{Action, DrawOptions, FRAME_RATE, Model, NOTICE};

/// Performers that the trials are of.
const NUM_SUBJECTS: u32 = 4;

/// Write synthetic recordings to try things with
///
/// Draws trials from a small statistical model of human motion and writes them as ASF and AMC. They are synthetic: good for
/// trying things, not for measuring how well real motion is reconstructed.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  marey sample --out samples/ --count 20 --seed 1 --action walk
  marey sample --out take/ --count 1 --seed 2 --action walk --points 6")]
pub struct Args {
    /// Folder to write to
    #[arg(long)]
    out: PathBuf,
    /// How many trials
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    count: u32,
    /// Another seed gives other trials, the same seed the same
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// walk, run, jump or boxing [default: all in turn]
    #[arg(long)]
    action: Option<Action>,
    /// Frames of each trial, at 60 a second
    #[arg(long, default_value_t = 240, value_parser = clap::value_parser!(u32).range(8..=1_000_000))]
    frames: u32,
    /// Also write the paths of so many control points of each trial, 2 to 6, as TRIAL.points.csv: a session to upload
    #[arg(long)]
    points: Option<usize>,
}

/// Runs `marey sample`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let points = match args.points {
        Some(count) => {
            Some(ControlSet::names(count).with_context(|| format!("--points is {count}, expected 2 to 6"))?)
        }
        None => None,
    };
    let frames = args.frames as usize;
    let trials = Trials { count: args.count, seed: args.seed, action: args.action, frames, points };
    trials.write(&args.out)?;
    println!("wrote {} trials to {}: {NOTICE}", args.count, args.out.display());
    Ok(())
}

/// Trials to be drawn.
pub struct Trials {
    /// how many
    pub count: u32,
    /// other trials
    pub seed: u64,
    /// one action, or all in turn
    pub action: Option<Action>,
    /// frames of each, at 60 a second
    pub frames: usize,
    /// control points whose paths are written too
    pub points: Option<&'static [&'static str]>,
}

impl Trials {
    /// Writes them into a folder: an ASF for each performer, an AMC for each trial and an `index.csv`.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let model = Model::bundled();
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let put = |name: &str, content: &str| -> anyhow::Result<()> {
            let path = folder.join(name);
            fs::write(&path, content).with_context(|| path.display().to_string())
        };
        let mut index = format!("# {NOTICE}\nfile,subject,trial,action,frames,fps,description\n");
        for number in 0..self.count {
            let action = self.action.unwrap_or(Action::ALL[number as usize % Action::ALL.len()]);
            // each performer does each action
            let person = (number / Action::ALL.len() as u32) % NUM_SUBJECTS;
            let options = DrawOptions { frames: self.frames, subject: self.seed.wrapping_add(person.into()) };
            let trial_seed = self.seed.wrapping_mul(1_000_003).wrapping_add(number.into());
            let motion = model.draw(action, trial_seed, &options)?;
            let subject = format!("synthetic{}", person + 1);
            let trial = format!("{subject}_{:02}", number + 1);
            put(&format!("{subject}.asf"), &formats::asf::write(motion.skeleton()))?;
            put(&format!("{trial}.amc"), &formats::amc::write(&motion))?;
            if let Some(names) = self.points {
                let points = control_trajectories(&motion, names)?;
                put(&format!("{trial}.points.csv"), &formats::points_csv::write(&points))?;
            }
            let frames = motion.num_frames();
            writeln!(
                index,
                "{trial}.amc,{subject},{trial},{action},{frames},{FRAME_RATE},synthetic {action}"
            )?;
        }
        put("index.csv", &index)
    }
}
