//! `marey sample`: synthetic recordings.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use evaluation::{ControlSet, control_trajectories};
use sample_motion::{Action, DrawOptions, FRAME_RATE, Model, NOTICE};

use crate::words::counted;

/// Performers that the trials are of.
const NUM_SUBJECTS: u32 = 4;

/// Write synthetic recordings to try things with
///
/// Draws trials from a small statistical model of human motion and writes them as ASF and AMC. They are synthetic: good for
/// trying things, not for measuring how well real motion is reconstructed. Performers keep their names, so trials of several
/// seeds may go into one folder: seed 1 draws synthetic1 to synthetic4, seed 2 synthetic2 to synthetic5, and so on.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey sample --out recordings/ --count 40                # to learn from
  marey sample --out take/ --count 1 --seed 2 --points 6   # a session to upload
  marey sample --out walks/ --count 20 --action walk")]
pub struct Args {
    /// Folder to write to
    #[arg(long)]
    out: PathBuf,
    /// How many trials
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    count: u32,
    /// A different seed draws different trials; the same seed draws the same ones
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// walk, run, jump or boxing [default: all in turn]
    #[arg(long)]
    action: Option<Action>,
    /// Frames of each trial, at 60 a second
    #[arg(long, default_value_t = 240, value_parser = clap::value_parser!(u32).range(8..=1_000_000))]
    frames: u32,
    /// Also write the paths of 2 to 6 control points of each trial, as TRIAL.points.csv: a session to upload
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
    println!("wrote {} to {}: {NOTICE}", counted(args.count.into(), "trial"), args.out.display());
    Ok(())
}

/// Trials to be drawn.
pub struct Trials {
    /// how many
    pub count: u32,
    /// another one draws other trials, of performers that are numbered from it on
    pub seed: u64,
    /// one action, or all in turn
    pub action: Option<Action>,
    /// frames of each, at 60 a second
    pub frames: usize,
    /// control points whose paths are written too
    pub points: Option<&'static [&'static str]>,
}

impl Trials {
    /// Writes them into a folder: an ASF for each performer, an AMC for each trial and an `index.csv`, which keeps the rows
    /// of trials that were drawn into the folder before.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let model = Model::bundled();
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let put = |name: &str, content: &str| -> anyhow::Result<()> {
            let path = folder.join(name);
            fs::write(&path, content).with_context(|| path.display().to_string())
        };
        let path = folder.join("index.csv");
        let mut index = Index::read(&path)?;
        for number in 0..self.count {
            let action = self.action.unwrap_or(Action::ALL[number as usize % Action::ALL.len()]);
            // each performer does each action
            let person = (number / Action::ALL.len() as u32) % NUM_SUBJECTS;
            let person = self.seed.wrapping_add(person.into());
            let options = DrawOptions { frames: self.frames, subject: person };
            let trial_seed = self.seed.wrapping_mul(1_000_003).wrapping_add(number.into());
            let motion = model.draw(action, trial_seed, &options)?;
            // a performer has the same name and skeleton whichever seed draws them
            let subject = format!("synthetic{person}");
            let trial = format!("{subject}_{:02}", number + 1);
            put(&format!("{subject}.asf"), &formats::asf::write(motion.skeleton()))?;
            put(&format!("{trial}.amc"), &formats::amc::write(&motion))?;
            if let Some(names) = self.points {
                let points = control_trajectories(&motion, names)?;
                put(&format!("{trial}.points.csv"), &formats::points_csv::write(&points))?;
            }
            let frames = motion.num_frames();
            let file = format!("{trial}.amc");
            let row = format!("{file},{subject},{trial},{action},{frames},{FRAME_RATE},synthetic {action}");
            index.rows.insert(file, row);
        }
        index.write(&path)
    }
}

/// What `index.csv` says of each trial.
struct Index {
    /// by file
    rows: BTreeMap<String, String>,
}

impl Index {
    const HEADER: &str = "file,subject,trial,action,frames,fps,description";

    /// The rows of an index that drawn trials left; none if there is no file.
    ///
    /// # Errors
    /// If the file says something else: it is not overwritten.
    fn read(path: &Path) -> anyhow::Result<Self> {
        let text = match fs::read_to_string(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            text => text.with_context(|| path.display().to_string())?,
        };
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let header = lines.next().unwrap_or(Self::HEADER);
        anyhow::ensure!(
            header == Self::HEADER,
            "{} does not list synthetic trials: it begins with {header:?}; choose another folder",
            path.display()
        );
        let row = |line: &str| Some((line.split_once(',')?.0.to_owned(), line.to_owned()));
        Ok(Self { rows: lines.filter_map(row).collect() })
    }

    fn write(&self, path: &Path) -> anyhow::Result<()> {
        let rows = self.rows.values().map(|row| format!("{row}\n")).collect::<String>();
        fs::write(path, format!("# {NOTICE}\n{}\n{rows}", Self::HEADER))
            .with_context(|| path.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn trials_of_several_seeds_share_a_folder_and_their_performers() -> anyhow::Result<()> {
        let (together, alone) = (tempfile::tempdir()?, tempfile::tempdir()?);
        let drawn = |seed, folder: &Path| {
            let trials = Trials { count: 20, seed, action: None, frames: 8, points: None };
            trials.write(folder)
        };
        for seed in 1..=6 {
            drawn(seed, together.path())?;
        }
        drawn(3, alone.path())?;
        // none has replaced another's, and a performer is the same one under both
        for entry in fs::read_dir(alone.path())? {
            let name = entry?.file_name();
            if name != "index.csv" {
                let read = |folder: &Path| fs::read(folder.join(&name));
                assert_eq!(read(alone.path())?, read(together.path())?, "{}", name.display());
            }
        }
        let index = Index::read(&together.path().join("index.csv"))?;
        assert_eq!(index.rows.len(), 6 * 20);
        let performers: BTreeSet<_> = index.rows.keys().filter_map(|file| file.split_once('_')).collect();
        let performers: BTreeSet<_> = performers.into_iter().map(|(performer, _)| performer).collect();
        assert_eq!(performers.len(), 9);
        Ok(())
    }

    #[test]
    fn somebody_elses_index_is_not_overwritten() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        fs::write(folder.path().join("index.csv"), "file,fps\n16_15.amc,120\n")?;
        let trials = Trials { count: 1, seed: 1, action: None, frames: 8, points: None };
        let message = trials.write(folder.path()).unwrap_err().to_string();
        assert!(message.contains("index.csv") && message.contains("file,fps"), "{message}");
        Ok(())
    }
}
