//! `marey sample`: synthetic recordings.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use evaluation::{ControlSet, control_trajectories};
use sample_motion::{Action, DrawOptions, FRAME_RATE, Model, NOTICE};

use model::counted;

/// Performers that the trials are of.
const NUM_SUBJECTS: u32 = 4;

/// Write synthetic recordings to try things with
///
/// Samples trials from a small statistical model of human motion and writes them as ASF and AMC. They are synthetic: good for
/// trying things, not for measuring how well real motion is reconstructed. Performers keep their names, so trials of several
/// seeds may go into one folder: seed 1 makes synthetic1 to synthetic4, seed 2 synthetic2 to synthetic5, and so on. Existing
/// files with other content are kept.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey sample --out recordings/ --count 40                # to learn from
  marey sample --out take/ --count 1 --seed 2 --points 6   # a session to upload
  marey sample --out walks/ --count 20 --action walk")]
pub struct Args {
    /// Folder to write to
    #[arg(long, short, visible_alias = "output", value_name = "DIR")]
    out: PathBuf,
    /// How many trials
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    count: u32,
    /// A different seed makes different trials; the same seed makes the same ones
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
    println!("wrote {} to {}: {NOTICE}", counted(args.count, "trial"), args.out.display());
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
    ///
    /// # Errors
    /// If there is a file of one of the names with something else in it; then none is written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let path = folder.join("index.csv");
        let mut index = Index::read(&path)?;
        let model = Model::bundled();
        self.check(model, folder)?;
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        for number in 0..self.count {
            let drawn = self.draw(model, number)?;
            for (name, content) in drawn.files {
                let path = folder.join(name);
                fs::write(&path, content).with_context(|| path.display().to_string())?;
            }
            index.rows.insert(drawn.motion_file, drawn.row);
        }
        index.write(&path)
    }

    /// That no file of the folder would be replaced by another. Those that would stay the same may be there: performers who are
    /// in trials of several seeds are.
    fn check(&self, model: &Model, folder: &Path) -> anyhow::Result<()> {
        let num_first = Action::ALL.len() as u32 * NUM_SUBJECTS;
        let is_there = |name: &str| folder.join(name).exists();
        for number in 0..self.count {
            let names = self.names(number);
            // a performer's later trials have the same skeleton
            let may_replace = is_there(&names.amc)
                || is_there(&names.points)
                || number < num_first && is_there(&names.skeleton);
            if !may_replace {
                continue;
            }
            for (name, content) in self.draw(model, number)?.files {
                let path = folder.join(name);
                if path.exists()
                    && fs::read(&path).with_context(|| path.display().to_string())? != content.as_bytes()
                {
                    bail!("{} exists already and would be replaced; choose a new folder", path.display());
                }
            }
        }
        Ok(())
    }

    /// The performer of a trial: each does each action.
    fn person(&self, number: u32) -> u64 {
        self.seed.wrapping_add(((number / Action::ALL.len() as u32) % NUM_SUBJECTS).into())
    }

    /// Draws a trial: its files by name, its motion's first, and its row of the index.
    fn draw(&self, model: &Model, number: u32) -> anyhow::Result<Drawn> {
        let action = self.action.unwrap_or(Action::ALL[number as usize % Action::ALL.len()]);
        let person = self.person(number);
        let options = DrawOptions { frames: self.frames, subject: person };
        let trial_seed = self.seed.wrapping_mul(1_000_003).wrapping_add(number.into());
        let motion = model.draw(action, trial_seed, &options)?;
        let Names { subject, skeleton, trial, amc, points } = self.names(number);
        let mut files = vec![
            (amc.clone(), formats::amc::write(&motion)),
            (skeleton, formats::asf::write(motion.skeleton())),
        ];
        if let Some(names) = self.points {
            files.push((points, formats::points_csv::write(&control_trajectories(&motion, names)?)));
        }
        let frames = motion.num_frames();
        let row = format!("{amc},{subject},{trial},{action},{frames},{FRAME_RATE},synthetic {action}");
        Ok(Drawn { motion_file: amc, files, row })
    }

    /// What a trial and its files are called: a performer has the same name and skeleton whichever seed draws them.
    fn names(&self, number: u32) -> Names {
        let subject = format!("synthetic{}", self.person(number));
        let trial = format!("{subject}_{:02}", number + 1);
        Names {
            skeleton: format!("{subject}.asf"),
            amc: format!("{trial}.amc"),
            points: format!("{trial}.points.csv"),
            subject,
            trial,
        }
    }
}

/// What a trial and its files are called.
struct Names {
    subject: String,
    skeleton: String,
    trial: String,
    amc: String,
    points: String,
}

/// A trial.
struct Drawn {
    motion_file: String,
    /// each with its content
    files: Vec<(String, String)>,
    /// of the index
    row: String,
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
    fn other_files_are_not_replaced() -> anyhow::Result<()> {
        let place = tempfile::tempdir()?;
        let folder = place.path().join("rec");
        let drawn = |frames, points: Option<usize>| {
            let points = points.and_then(ControlSet::names);
            Trials { count: 5, seed: 1, action: None, frames, points }.write(&folder)
        };
        drawn(8, Some(4))?;
        // the same again
        drawn(8, Some(4))?;
        let before = fs::read(folder.join("synthetic1_01.amc"))?;
        let message = drawn(9, None).unwrap_err().to_string();
        assert!(message.contains("synthetic1_01.amc exists already and would be replaced"), "{message}");
        let message = drawn(8, Some(6)).unwrap_err().to_string();
        assert!(message.contains("synthetic1_01.points.csv exists already"), "{message}");
        assert_eq!(fs::read(folder.join("synthetic1_01.amc"))?, before);
        // a performer of one's own, of that name
        fs::write(folder.join("synthetic2.asf"), "mine")?;
        let message = drawn(8, Some(4)).unwrap_err().to_string();
        assert!(message.contains("synthetic2.asf exists already"), "{message}");
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
