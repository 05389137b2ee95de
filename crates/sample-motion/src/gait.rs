//! Cuts walking and running into cycles, by which foot is in front.

use crate::features::Track;
use crate::segment::{Segment, rising_zeros};
use crate::signal::smooth;

/// Cycle durations that are believed, seconds.
const BELIEVED_SECS: std::ops::RangeInclusive<f64> = 0.45..=2.2;
/// Least reach of the leading foot in a cycle, leg lengths.
const LEAST_STRIDE: f64 = 0.12;

/// Cycles from each passing of the feet to the same passing a stride later, in the order of time: those that begin
/// with the left foot coming in front, and, turned by half a cycle, those that begin with the right. They overlap by
/// half: recorded runs are hardly longer than two strides.
pub(crate) fn cycles(track: &Track) -> Vec<Segment> {
    let stride = smooth(&track.stride, 0.025 * track.frame_rate);
    let mirrored: Vec<f64> = stride.iter().map(|s| -s).collect();
    let mut cycles = between_zeros(track, &stride, 0.0);
    cycles.extend(between_zeros(track, &mirrored, 0.5));
    cycles.sort_by(|a, b| a.marks[0].total_cmp(&b.marks[0]));
    cycles
}

fn between_zeros(track: &Track, stride: &[f64], first_phase: f64) -> Vec<Segment> {
    let zeros = rising_zeros(stride, LEAST_STRIDE);
    let cycles = zeros.windows(2).map(|w| Segment { marks: w.to_vec(), first_phase });
    cycles.filter(|s| s.durations(track.frame_rate).all(|d| BELIEVED_SECS.contains(&d))).collect()
}
