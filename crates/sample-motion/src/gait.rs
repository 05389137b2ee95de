//! Cuts walking and running into cycles, by which foot is in front.

use crate::features::Track;
use crate::segment::{Segment, rising_zeros};
use crate::signal::smooth;

/// Cycle durations that are believed, seconds.
const BELIEVED_SECS: std::ops::RangeInclusive<f64> = 0.45..=2.2;
/// Least reach of the leading foot in a cycle, leg lengths.
const LEAST_STRIDE: f64 = 0.12;

/// Cycles from one passing of the left foot by the right to the next. Where a trial is too short for one, cycles
/// are cut from the right foot's passing instead and turned by half a cycle.
pub(crate) fn cycles(track: &Track) -> Vec<Segment> {
    let stride = smooth(&track.stride, 0.025 * track.frame_rate);
    let cycles = between_zeros(track, &stride, 0.0);
    if !cycles.is_empty() {
        return cycles;
    }
    let mirrored: Vec<f64> = stride.iter().map(|s| -s).collect();
    between_zeros(track, &mirrored, 0.5)
}

fn between_zeros(track: &Track, stride: &[f64], first_phase: f64) -> Vec<Segment> {
    let zeros = rising_zeros(stride, LEAST_STRIDE);
    let cycles = zeros.windows(2).map(|w| Segment { marks: w.to_vec(), first_phase });
    cycles.filter(|s| s.durations(track.frame_rate).all(|d| BELIEVED_SECS.contains(&d))).collect()
}
