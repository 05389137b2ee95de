//! The screen that the demo ends on.

use std::{fmt::Write as _, path::Path, time::Duration};

use anyhow::bail;

use super::{
    cameras::{self, Followed},
    strip::strip,
    trials::{self, METHODS, Outcome, POINT_SETS, TrialErrors},
};
use model::counted;

/// What synthetic motion must come to: far above what it does come to, far below what a broken step would.
const MOST_ANGLES_DEG: f64 = 10.0;
const MOST_POSITIONS_CM: f64 = 3.0;
const MOST_JOINTS_M: f64 = 0.03;
const MOST_JOINT_M: f64 = 0.15;
const MOST_STATURE_M: f64 = 0.05;
/// Size of the picture, characters.
const COLUMNS: usize = 98;
const LINES: usize = 10;

/// What was done and what came of it.
#[derive(Debug)]
pub struct Summary {
    /// whether the trials are synthetic
    pub is_synthetic: bool,
    /// trials that were learned from
    pub num_learned: usize,
    /// the held-out trials
    pub trials: Outcome,
    /// the person before the cameras
    pub followed: Followed,
}

/// A mean over trials and its standard error; the error is NaN for a single trial.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mean {
    mean: f64,
    error: f64,
}

impl Mean {
    fn new(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
        Self { mean, error: (variance / count).sqrt() }
    }

    fn text(self) -> String {
        if self.error.is_finite() {
            format!("{:.2} ± {:.2}", self.mean, self.error)
        } else {
            format!("{:.2}", self.mean)
        }
    }
}

impl Summary {
    /// Prints all of it: what was done, how well, and where to look.
    ///
    /// # Errors
    /// If something fell short: it is named.
    pub fn print(&self, took: Duration, output: &Path) -> anyhow::Result<()> {
        println!("\n{}", self.text(took, output));
        let short = self.shortfalls(output);
        if short.is_empty() {
            return Ok(());
        }
        bail!("the demo fell short:\n  {}", short.join("\n  "))
    }

    fn text(&self, took: Duration, output: &Path) -> String {
        let mut out = self.done(took);
        out.push_str(&self.points_part());
        out.push_str(&self.cameras_part());
        out.push_str("\nLOOK AT\n");
        let places = self.places();
        let width = places.iter().map(|(file, _)| file.len()).max().unwrap_or(0);
        for (file, what) in places {
            let _ = writeln!(out, "  {file:<width$}  {what}");
        }
        let folder = output.canonicalize().unwrap_or_else(|_| output.to_owned());
        let _ = write!(out, "Everything is in {}", folder.display());
        out
    }

    fn done(&self, took: Duration) -> String {
        // with the session of the cameras, and its run
        let (sessions, runs) = (self.trials.num_sessions + 1, self.trials.errors.len() + 1);
        let kind = if self.is_synthetic { "synthetic trial" } else { "trial" };
        format!(
            "DONE in {:.0} s: {} reconstructed from 4 and from 6 of their points, each by two methods,\n\
             and a person followed in front of {} cameras: {sessions} sessions, {runs} runs.\n",
            took.as_secs_f64(),
            counted(self.num_trials(), kind),
            cameras::CAPTURE.cameras,
        )
    }

    fn points_part(&self) -> String {
        let mut out = format!(
            "\nFROM A FEW POINTS: errors, mean over {} ± its standard error\n",
            counted(self.num_trials(), "trial")
        );
        let _ = writeln!(
            out,
            "  {:<8}{:<16}{:>18}{:>22}{:>15}",
            "points", "method", "joint angles, °", "joint positions, cm", "better in"
        );
        for points in POINT_SETS {
            for method in METHODS {
                out.push_str(&self.row(points.len(), method));
            }
        }
        let learned = counted(self.num_learned, "other trial");
        let _ = write!(
            out,
            "  The baseline searches and fits as Marey does, but predicts that the motion continues like the single most\n  \
             similar recording (--method nearest); better: smaller error in angles. The trials were held out: Marey learned\n  \
             from {learned} of the same people.\n"
        );
        if self.is_synthetic {
            out.push_str("  All of it is sampled from a statistical model; recorded motion is harder: see docs/accuracy.md.\n");
        }
        let _ = write!(
            out,
            "  {}, the median of them, as found from 6 points:\n{}",
            self.trials.shown,
            strip(&self.trials.found, COLUMNS, LINES)
        );
        out
    }

    fn cameras_part(&self) -> String {
        let Followed { num_frames, mean_m, largest_m, carried_m, stature_m } = self.followed;
        format!(
            "\nFROM {} CAMERAS: a synthetic man (a body of the generator MakeHuman) followed by his silhouettes alone, \
             {num_frames} frames\n  \
             Joints are off by {:.1} cm on average, {:.1} cm at most (his first pose, moved along rigidly: {:.1} cm on average);\n  \
             stature {stature_m:.2} m, in truth {:.2} m. His body is one that the model knows: real people are harder.\n",
            cameras::CAPTURE.cameras,
            100.0 * mean_m,
            100.0 * largest_m,
            100.0 * carried_m,
            cameras::CAPTURE.stature_m(),
        )
    }

    fn row(&self, num_points: usize, method: &'static str) -> String {
        let own = self.errors(num_points, method);
        let column = |value: fn(&TrialErrors) -> f64| {
            Mean::new(&own.iter().map(|errors| value(errors)).collect::<Vec<_>>()).text()
        };
        let (angles, positions) = (column(|errors| errors.rms_deg), column(|errors| errors.mpjpe_cm));
        let others = METHODS.iter().filter(|other| **other != method);
        let others: Vec<_> = others.flat_map(|other| self.errors(num_points, other)).collect();
        let is_nearer = |errors: &&&TrialErrors| {
            others.iter().any(|other| other.trial == errors.trial && errors.rms_deg < other.rms_deg)
        };
        let nearer = format!("{} of {}", own.iter().filter(is_nearer).count(), own.len());
        let name = if method == METHODS[0] { "Marey" } else { "plain baseline" };
        format!("  {num_points:<8}{name:<16}{angles:>18}{positions:>22}{nearer:>15}\n")
    }

    /// Files that are worth a look, and what they are.
    fn places(&self) -> Vec<(String, &'static str)> {
        let shown = &self.trials.shown;
        let cameras = cameras::FOLDER;
        vec![
            (
                trials::PICTURE.to_owned(),
                "its measured points, the motion found and the true one, in a browser",
            ),
            (
                format!("{shown}/motion.bvh"),
                "in Blender: File > Import > Motion Capture (.bvh), Scale 0.01; beside it: truth.bvh",
            ),
            (format!("{cameras}/overlay_cam0.mp4"), "the body that was found, over what a camera saw"),
            (format!("{cameras}/body.glb"), "that body, moving, in Blender: File > Import > glTF 2.0"),
            (trials::TABLE.to_owned(), "the errors of every trial"),
        ]
    }

    fn num_trials(&self) -> usize {
        self.errors(POINT_SETS[0].len(), METHODS[0]).len()
    }

    fn errors(&self, num_points: usize, method: &str) -> Vec<&TrialErrors> {
        let all = self.trials.errors.iter();
        all.filter(|errors| errors.num_points == num_points && errors.method == method).collect()
    }

    /// What is not as it should be. How far recorded motion may be off nobody can say beforehand.
    fn shortfalls(&self, output: &Path) -> Vec<String> {
        let mut short = Vec::new();
        let mut expect = |what: &str, found: f64, most: f64| {
            // a number that is none is no good either
            if found.is_nan() || found > most {
                short.push(format!("{what}: {found:.2}, expected at most {most}"));
            }
        };
        if self.is_synthetic {
            let best = self.errors(POINT_SETS[1].len(), METHODS[0]);
            let mean = |value: fn(&TrialErrors) -> f64| {
                Mean::new(&best.iter().map(|errors| value(errors)).collect::<Vec<_>>()).mean
            };
            expect("joint angles from 6 points, °", mean(|e| e.rms_deg), MOST_ANGLES_DEG);
            expect("joint positions from 6 points, cm", mean(|e| e.mpjpe_cm), MOST_POSITIONS_CM);
        }
        let followed = &self.followed;
        expect("joints in front of cameras on average, m", followed.mean_m, MOST_JOINTS_M);
        expect("joints in front of cameras at most, m", followed.largest_m, MOST_JOINT_M);
        let stature_off = (followed.stature_m - cameras::CAPTURE.stature_m()).abs();
        expect("stature, m off", stature_off, MOST_STATURE_M);
        if followed.num_frames < cameras::CAPTURE.frames {
            let (found, expected) = (followed.num_frames, cameras::CAPTURE.frames);
            short.push(format!("the person was followed through {found} frames, expected {expected}"));
        }
        let missing =
            self.places().into_iter().map(|(file, _)| file).filter(|file| !output.join(file).exists());
        short.extend(missing.map(|file| format!("{file} was not made")));
        short
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use sample_motion::{Action, DrawOptions, Model};

    use super::*;

    /// Two trials from 4 and 6 points; `marey` and `baseline`: errors in angles, degrees.
    fn summary(marey: [f64; 2], baseline: [f64; 2]) -> Summary {
        let mut errors = Vec::new();
        for points in POINT_SETS {
            for (index, trial) in ["a_1", "a_2"].into_iter().enumerate() {
                for (method, numbers) in METHODS.into_iter().zip([marey, baseline]) {
                    let (rms_deg, mpjpe_cm) = (numbers[index], 1.0);
                    let trial = trial.to_owned();
                    errors.push(TrialErrors { trial, num_points: points.len(), method, rms_deg, mpjpe_cm });
                }
            }
        }
        let stature_m = cameras::CAPTURE.stature_m();
        let options = DrawOptions { frames: 60, subject: 1 };
        let found = Model::bundled().draw(Action::Walk, 1, &options).unwrap();
        Summary {
            is_synthetic: true,
            num_learned: 7,
            trials: Outcome { errors, num_sessions: 4, shown: "a_1".to_owned(), found },
            followed: Followed { num_frames: 24, mean_m: 0.01, largest_m: 0.02, carried_m: 0.1, stature_m },
        }
    }

    #[test]
    fn the_numbers_said_are_the_numbers_done() {
        let text = summary([4.0, 6.0], [5.0, 5.0]).text(Duration::from_secs(12), Path::new("marey-demo"));
        // how wide columns are is not the matter
        let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for words in [
            "DONE in 12 s: 2 synthetic trials reconstructed",
            "5 sessions, 9 runs",
            "mean over 2 trials",
            "Marey learned from 7 other trials of the same people",
            "4 Marey 5.00 ± 1.00 1.00 ± 0.00 1 of 2",
            "6 plain baseline 5.00 ± 0.00 1.00 ± 0.00 1 of 2",
        ] {
            assert!(said.contains(words), "{words}: {text}");
        }
        // one screen
        assert!(text.lines().count() <= 40 && text.lines().all(|line| line.chars().count() <= 120), "{text}");
    }

    #[test]
    fn what_falls_short_is_named() -> anyhow::Result<()> {
        let output = tempfile::tempdir()?;
        let good = summary([4.0, 6.0], [5.0, 5.0]);
        for (file, _) in good.places() {
            let path = output.path().join(file);
            fs::create_dir_all(path.parent().unwrap_or(output.path()))?;
            fs::write(path, "x")?;
        }
        assert_eq!(good.shortfalls(output.path()), Vec::<String>::new());
        let bad = summary([4.0, 60.0], [5.0, 5.0]).shortfalls(output.path());
        assert_eq!(bad, ["joint angles from 6 points, °: 32.00, expected at most 10"]);
        let recorded = Summary { is_synthetic: false, ..summary([4.0, 60.0], [5.0, 5.0]) };
        assert_eq!(recorded.shortfalls(output.path()), Vec::<String>::new());
        fs::remove_file(output.path().join(trials::PICTURE))?;
        assert_eq!(good.shortfalls(output.path()), ["picture.svg was not made"]);
        let mut lost = summary([4.0, 6.0], [5.0, 5.0]);
        lost.followed.largest_m = f64::NAN;
        assert!(lost.shortfalls(output.path())[0].starts_with("joints in front of cameras at most, m: NaN"));
        Ok(())
    }
}
