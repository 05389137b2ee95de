//! What goes wrong with measurements: noise, and points that are hidden for a while. The same trial is always
//! disturbed in the same way.

use std::{f64::consts::TAU, fmt, ops::Range, str::FromStr};

use model::PointTrajectories;
use motion_db::FRAME_RATE;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::Error;

/// Frames that are seen before a gap, and after it.
const MARGIN: usize = 30;

/// Which points are hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hidden {
    /// one of them, another from trial to trial
    One,
    /// all of them
    All,
}

/// A gap in the measurement, somewhere in a trial: `one:0.5s` or `all:0.5s`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Occlusion {
    /// which points
    pub hidden: Hidden,
    /// how long, frames at 60 a second
    pub frames: usize,
}

impl Occlusion {
    /// Where the gap is in a trial of `num_frames` frames and which of its `num_points` points it hides; `None` if the trial is shorter
    /// than the gap with half a second before and after it. Depends on the trial's name, not on what else is evaluated.
    pub fn gap(&self, trial: &str, num_frames: usize, num_points: usize) -> Option<Gap> {
        let free = num_frames.checked_sub(self.frames + 2 * MARGIN)?;
        let mut chance = stream("gap", trial);
        let begin = MARGIN + (chance.next_u64() % (free as u64 + 1)) as usize;
        let one = (chance.next_u64() % num_points.max(1) as u64) as usize;
        let points = match self.hidden {
            Hidden::One => one..one + 1,
            Hidden::All => 0..num_points,
        };
        Some(Gap { frames: begin..begin + self.frames, points })
    }
}

impl FromStr for Occlusion {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = || Error::Occlusion { found: text.to_owned() };
        let (hidden, duration) = text.split_once(':').ok_or_else(wrong)?;
        let hidden = match hidden {
            "one" => Hidden::One,
            "all" => Hidden::All,
            _ => return Err(wrong()),
        };
        let seconds: f64 = duration.strip_suffix('s').unwrap_or(duration).parse().map_err(|_| wrong())?;
        let frames = (seconds * FRAME_RATE).round();
        if (1.0..=36_000.0).contains(&frames) {
            Ok(Self { hidden, frames: frames as usize })
        } else {
            Err(wrong())
        }
    }
}

impl fmt::Display for Occlusion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hidden = match self.hidden {
            Hidden::One => "one",
            Hidden::All => "all",
        };
        write!(f, "{hidden}:{}s", (self.frames as f64 / FRAME_RATE * 1e4).round() / 1e4)
    }
}

impl From<Occlusion> for String {
    fn from(occlusion: Occlusion) -> Self {
        occlusion.to_string()
    }
}

impl TryFrom<String> for Occlusion {
    type Error = Error;

    fn try_from(text: String) -> Result<Self, Error> {
        text.parse()
    }
}

/// A gap in one trial.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gap {
    /// frames in which the points are hidden
    pub frames: Range<usize>,
    /// the points, by their place in the set
    pub points: Range<usize>,
}

/// The trajectories of a trial with Gaussian noise of `sigma_m` metres on every coordinate, and nothing measured in the gap. The noise
/// at one level is that of another, scaled.
///
/// # Errors
/// If the trajectories were not valid.
pub fn disturbed(
    exact: &PointTrajectories,
    trial: &str,
    sigma_m: f64,
    gap: Option<&Gap>,
) -> Result<PointTrajectories, model::Error> {
    let mut positions: Vec<Vector3<f64>> =
        (0..exact.num_frames()).flat_map(|frame| exact.frame(frame)).copied().collect();
    let points = exact.num_points();
    if sigma_m > 0.0 {
        for (point, name) in exact.names().iter().enumerate() {
            let mut chance = stream(name, trial);
            for position in positions.iter_mut().skip(point).step_by(points) {
                *position += Vector3::from_fn(|_, _| sigma_m * normal(&mut chance));
            }
        }
    }
    if let Some(gap) = gap {
        for frame in gap.frames.clone() {
            for point in gap.points.clone() {
                positions[frame * points + point] = Vector3::repeat(f64::NAN);
            }
        }
    }
    PointTrajectories::new(exact.names().to_vec(), exact.frame_rate(), positions)
}

/// Random numbers for one purpose in one trial.
fn stream(purpose: &str, trial: &str) -> ChaCha8Rng {
    let mut hasher = blake3::Hasher::new();
    hasher.update(purpose.as_bytes()).update(&[0]).update(trial.as_bytes());
    ChaCha8Rng::from_seed(*hasher.finalize().as_bytes())
}

/// A draw from the standard normal distribution (Box and Muller 1958; docs/papers.md#other-sources).
fn normal(chance: &mut ChaCha8Rng) -> f64 {
    let uniform = |bits: u64| ((bits >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let (radius, angle) = (uniform(chance.next_u64()), uniform(chance.next_u64()));
    (-2.0 * radius.ln()).sqrt() * (TAU * angle).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still(frames: usize) -> PointTrajectories {
        let names = vec!["head".to_owned(), "root".to_owned()];
        PointTrajectories::new(names, 60.0, vec![Vector3::new(1.0, 2.0, 3.0); 2 * frames]).unwrap()
    }

    #[test]
    fn noise_has_the_standard_deviation_asked_for_and_is_the_same_every_time() {
        let exact = still(5_000);
        let noisy = disturbed(&exact, "16_01", 0.005, None).unwrap();
        assert_eq!(noisy, disturbed(&exact, "16_01", 0.005, None).unwrap());
        assert_ne!(noisy, disturbed(&exact, "16_02", 0.005, None).unwrap());
        let off: Vec<f64> = (0..5_000)
            .flat_map(|frame| noisy.frame(frame).to_vec())
            .flat_map(|p| <[f64; 3]>::from(p - Vector3::new(1.0, 2.0, 3.0)))
            .collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let sigma = (off.iter().map(|v| v * v).sum::<f64>() / off.len() as f64).sqrt();
        // 30,000 draws: the standard error of both is below 0.00003.
        assert!(mean.abs() < 1.2e-4 && (sigma - 0.005).abs() < 1e-4, "{mean} {sigma}");
        assert_eq!(disturbed(&exact, "16_01", 0.0, None).unwrap(), exact);
    }

    #[test]
    fn noise_of_twice_the_level_is_twice_the_noise() {
        let exact = still(3);
        let (one, two) = (disturbed(&exact, "t", 0.001, None), disturbed(&exact, "t", 0.002, None));
        let (one, two, exact) = (one.unwrap().frame(2)[1], two.unwrap().frame(2)[1], exact.frame(2)[1]);
        assert!(((two - exact) - 2.0 * (one - exact)).norm() < 1e-12);
    }

    #[test]
    fn a_gap_hides_what_it_says_and_leaves_half_a_second_around_it() {
        let one: Occlusion = "one:0.5s".parse().unwrap();
        let all: Occlusion = "all:0.5s".parse().unwrap();
        let mut hidden = [0; 2];
        for trial in 0..40 {
            let name = format!("16_{trial}");
            let gap = one.gap(&name, 120, 2).unwrap();
            assert_eq!((gap.frames.len(), gap.points.len()), (30, 1));
            assert!(gap.frames.start >= 30 && gap.frames.end <= 90, "{gap:?}");
            hidden[gap.points.start] += 1;
            let everything = all.gap(&name, 120, 2).unwrap();
            assert_eq!((everything.frames, everything.points), (gap.frames.clone(), 0..2));
            let trajectories = disturbed(&still(120), &name, 0.0, Some(&gap)).unwrap();
            for frame in 0..120 {
                let is_hidden = trajectories.position(frame, gap.points.start).is_none();
                assert_eq!(is_hidden, gap.frames.contains(&frame));
                assert!(trajectories.position(frame, 1 - gap.points.start).is_some());
            }
        }
        assert!(hidden.iter().all(|&n| n >= 10), "every point has its turn: {hidden:?}");
        assert_eq!(one.gap("short", 89, 2), None);
        assert_eq!(one.gap("just long enough", 90, 2).unwrap().frames, 30..60);
    }

    #[test]
    fn occlusions_are_written_as_they_are_read() {
        for text in ["one:0.5s", "all:1s", "one:0.25s"] {
            assert_eq!(text.parse::<Occlusion>().unwrap().to_string(), text);
        }
        for wrong in ["two:0.5s", "one", "one:", "one:-1s", "all:0s", "all:NaNs", "all:1e9s", ""] {
            let message = wrong.parse::<Occlusion>().unwrap_err().to_string();
            assert!(message.contains("one:0.5s"), "{message}");
        }
    }
}
