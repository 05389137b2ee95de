//! Which of the lines that come in are frames.

use motion_db::FRAME_RATE;

/// Clocks of people's programs are not exact: a rate that is off by less than this part is meant as the whole one.
const TOLERANCE: f64 = 0.1;

/// Lines that come in more often than frames, at a multiple of their rate, are thinned out. Their rate is told by the times of
/// the first two.
#[derive(Debug, Default)]
pub struct Rate {
    /// time of the first line, until the second tells the step
    first: Option<f64>,
    /// lines from one frame to the next
    step: Option<usize>,
    /// lines since the last frame
    since: usize,
}

impl Rate {
    /// Whether a line of this time (seconds, NaN if it says none) is a frame; a warning if the rate is no multiple of 60.
    pub fn takes(&mut self, seconds: f64) -> (bool, Option<String>) {
        let mut warning = None;
        if self.step.is_none() {
            let Some(first) = self.first else {
                self.first = Some(seconds);
                return (true, None);
            };
            let ratio = 1.0 / (FRAME_RATE * (seconds - first));
            // times that do not rise tell no rate
            let step = if ratio.is_finite() && ratio > 0.0 { ratio.round().max(1.0) } else { 1.0 };
            if (ratio - step).abs() > TOLERANCE * step {
                warning = Some(format!(
                    "the first lines are {:.4} s apart; every line counts as a sixtieth of a second: expected 60 lines a \
                     second, or a multiple of it",
                    seconds - first
                ));
            }
            self.step = Some(step as usize);
        }
        self.since += 1;
        let takes = self.step.is_none_or(|step| self.since >= step);
        if takes {
            self.since = 0;
        }
        (takes, warning)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of the lines that are frames, and how many warnings there were.
    fn frames(times: impl Iterator<Item = f64>) -> (Vec<f64>, usize) {
        let (mut rate, mut warnings) = (Rate::default(), 0);
        let frames = times.filter(|seconds| {
            let (takes, warning) = rate.takes(*seconds);
            warnings += usize::from(warning.is_some());
            takes
        });
        (frames.collect(), warnings)
    }

    #[test]
    fn every_nth_line_of_a_multiple_is_a_frame() {
        for n in [1, 2, 4, 8] {
            let (frames, warnings) = frames((0..64).map(|line| f64::from(line) / (60.0 * f64::from(n))));
            assert_eq!((frames.len(), warnings), (64 / n as usize, 0), "{n}");
            assert!(frames.iter().enumerate().all(|(i, t)| (t - i as f64 / 60.0).abs() < 1e-9));
        }
    }

    #[test]
    fn other_rates_are_warned_of_once_and_every_line_is_a_frame() {
        for hz in [50.0, 30.0, 25.0] {
            assert_eq!(frames((0..10).map(|line| f64::from(line) / hz)).1, 1, "{hz}");
        }
        assert_eq!(frames((0..10).map(|line| f64::from(line) / 59.94)), (frames_of(59.94), 0));
        // without times nothing is known
        assert_eq!(frames((0..10).map(|_| f64::NAN)).0.len(), 10);
    }

    fn frames_of(hz: f64) -> Vec<f64> {
        (0..10).map(|line| f64::from(line) / hz).collect()
    }
}
