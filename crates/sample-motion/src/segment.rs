use crate::basis::{Basis, SAMPLES};
use crate::features::{CHANNELS, Track};

/// A cycle or an event in a motion.
#[derive(Debug, Clone)]
pub(crate) struct Segment {
    /// frames (not whole) of its beginning, its landmarks and its end, rising
    pub marks: Vec<f64>,
    /// phase at its beginning: 0.5 for cycles that were cut half a cycle off
    pub first_phase: f64,
}

impl Segment {
    /// Seconds between marks.
    pub fn durations(&self, frame_rate: f64) -> impl Iterator<Item = f64> {
        self.marks.windows(2).map(move |w| (w[1] - w[0]) / frame_rate)
    }
}

/// Phases in [0, 1] of the landmarks for the given durations between them: the mean timing of a movement.
pub(crate) fn mark_phases(durations: &[f64]) -> Vec<f64> {
    let total: f64 = durations.iter().sum();
    let mut sum = 0.0;
    let mut phases = vec![0.0];
    for duration in durations {
        sum += duration;
        phases.push(sum / total);
    }
    phases
}

/// Where `x` is mapped by the line through the points (`from[i]`, `to[i]`); both rise.
pub(crate) fn piecewise(x: f64, from: &[f64], to: &[f64]) -> f64 {
    let i = from[1..from.len() - 1].iter().take_while(|&&f| f <= x).count();
    to[i] + (x - from[i]) / (from[i + 1] - from[i]) * (to[i + 1] - to[i])
}

/// Describes a segment by numbers: the logarithms of its durations (seconds), then the coefficients of every channel.
pub(crate) fn describe(track: &Track, segment: &Segment, basis: Basis, phases: &[f64]) -> Vec<f64> {
    let mut numbers: Vec<f64> = segment.durations(track.frame_rate).map(f64::ln).collect();
    let (begin, end) = (segment.marks[0], segment.marks[segment.marks.len() - 1]);
    let (first, last) = (row_at(track, begin), row_at(track, end));
    let sample = |s: usize| {
        let own_phase = basis.sample_phase(s);
        let phase = match segment.first_phase {
            0.0 => own_phase,
            first => (own_phase + 1.0 - first).fract(),
        };
        let row = row_at(track, piecewise(phase, phases, &segment.marks));
        // A cycle ends where it began: what is left over is spread evenly.
        let spread = match basis {
            Basis::Cycle { .. } => phase - 0.5,
            Basis::Once { .. } => 0.0,
        };
        std::array::from_fn(|channel| row[channel] - spread * (last[channel] - first[channel]))
    };
    let samples: Vec<[f64; CHANNELS]> = (0..SAMPLES).map(sample).collect();
    let mut coefficients = vec![0.0; basis.len()];
    for channel in 0..CHANNELS {
        let channel_samples: Vec<f64> = samples.iter().map(|row| row[channel]).collect();
        basis.fit(&channel_samples, &mut coefficients);
        numbers.extend_from_slice(&coefficients);
    }
    numbers
}

fn row_at(track: &Track, frame: f64) -> [f64; CHANNELS] {
    let last = track.rows.len() - 1;
    let frame = frame.clamp(0.0, last as f64);
    let (i, share) = (frame as usize, frame.fract());
    let (a, b) = (&track.rows[i], &track.rows[(i + 1).min(last)]);
    std::array::from_fn(|c| a[c] + share * (b[c] - a[c]))
}

/// Frames (not whole) at which the signal rises through 0, after having been below `-depth`, and then exceeds `depth`.
pub(crate) fn rising_zeros(signal: &[f64], depth: f64) -> Vec<f64> {
    let mut zeros = Vec::new();
    let mut was_low = false;
    let mut crossing = None;
    for i in 1..signal.len() {
        let (a, b) = (signal[i - 1], signal[i]);
        was_low |= a < -depth;
        if was_low && a < 0.0 && b >= 0.0 {
            crossing = Some((i - 1) as f64 + a / (a - b));
        }
        if b > depth {
            if let (true, Some(zero)) = (was_low, crossing) {
                zeros.push(zero);
            }
            was_low = false;
            crossing = None;
        }
    }
    zeros
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_of_a_sine_are_one_period_apart() {
        let signal: Vec<f64> =
            (0..200).map(|i| (i as f64 * std::f64::consts::TAU / 40.0 - 0.3).sin()).collect();
        let zeros = rising_zeros(&signal, 0.3);
        assert!(zeros.len() >= 4, "{zeros:?}");
        assert!(zeros.windows(2).all(|w| (w[1] - w[0] - 40.0).abs() < 0.05), "{zeros:?}");
    }

    #[test]
    fn marks_map_to_their_phases() {
        let phases = mark_phases(&[1.0, 3.0]);
        assert_eq!(phases, [0.0, 0.25, 1.0]);
        assert_eq!(piecewise(0.25, &phases, &[10.0, 20.0, 26.0]), 20.0);
        assert_eq!(piecewise(1.0, &phases, &[10.0, 20.0, 26.0]), 26.0);
    }
}
