//! When lines that say their times are due.

use std::time::{Duration, Instant};

/// Lines of a file that is piped in come all at once; they are due when as much time has gone by as lies between their times.
/// Those of a program that measures come when they are measured, and are due at once: a line that had to be waited for sets
/// the clock, so that the two clocks need not agree.
#[derive(Debug, Default)]
pub struct Pace {
    /// a line that was due when it came, and its time in seconds
    anchor: Option<(Instant, f64)>,
}

impl Pace {
    /// When a line of this time (seconds) is due. `waited`: whether it had to be waited for; `now`: when it was read. A line
    /// without a time, or with one before the last anchor's, is due at once.
    pub fn due(&mut self, seconds: f64, waited: bool, now: Instant) -> Instant {
        if !seconds.is_finite() {
            return now;
        }
        let due = match self.anchor {
            Some((at, first)) if !waited => {
                Duration::try_from_secs_f64(seconds - first).ok().and_then(|after| at.checked_add(after))
            }
            _ => None,
        };
        // times that begin anew do so now
        due.unwrap_or_else(|| {
            self.anchor = Some((now, seconds));
            now
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(begin: Instant, seconds: f64) -> Instant {
        begin + Duration::from_secs_f64(seconds)
    }

    #[test]
    fn lines_that_are_all_there_are_due_at_their_times() {
        let (begin, mut pace) = (Instant::now(), Pace::default());
        assert_eq!(pace.due(5.0, true, begin), begin);
        for (seconds, expected) in [(5.25, 0.25), (5.5, 0.5), (6.5, 1.5)] {
            assert_eq!(pace.due(seconds, false, begin), after(begin, expected));
        }
        // a file that begins again is not waited for
        assert_eq!(pace.due(0.0, false, after(begin, 2.0)), after(begin, 2.0));
        assert_eq!(pace.due(0.5, false, after(begin, 2.0)), after(begin, 2.5));
        assert_eq!(pace.due(f64::NAN, false, begin), begin);
    }

    #[test]
    fn lines_of_a_clock_that_runs_fast_are_never_late() {
        let (begin, mut pace) = (Instant::now(), Pace::default());
        for line in 0..1000 {
            let now = after(begin, f64::from(line));
            assert_eq!(pace.due(1.01 * f64::from(line), true, now), now);
        }
    }

    #[test]
    fn what_piled_up_is_due_at_once() {
        let (begin, mut pace) = (Instant::now(), Pace::default());
        pace.due(0.0, true, begin);
        let late = after(begin, 5.0);
        assert!((1..100).all(|line| pace.due(f64::from(line) / 60.0, false, late) < late));
    }
}
