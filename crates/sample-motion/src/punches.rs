//! Finds punches, and the guarding between them.

use crate::features::Track;
use crate::segment::Segment;
use crate::signal::smooth;

/// A punch stretches the arm by at least this much of its length, out and back, within [`RISE_SECS`].
const LEAST_RISE: f64 = 0.25;
const RISE_SECS: f64 = 0.4;
/// Time taken before and after the farthest reach, seconds.
const BEFORE_SECS: f64 = 0.40;
const AFTER_SECS: f64 = 0.45;
/// Length of a piece of guarding, seconds.
const GUARD_SECS: f64 = 1.0;

/// Punches of one side (0 left, 1 right) with marks: beginning, farthest reach, end.
pub(crate) fn punches(track: &Track, side: usize) -> Vec<Segment> {
    let rate = track.frame_rate;
    let last = track.rows.len() as f64 - 1.0;
    let segment = |peak: usize| {
        let peak = peak as f64;
        let marks = vec![peak - BEFORE_SECS * rate, peak, peak + AFTER_SECS * rate];
        (marks[0] >= 0.0 && marks[2] <= last).then_some(Segment { marks, first_phase: 0.0 })
    };
    peaks(track, side).into_iter().filter_map(segment).collect()
}

/// Pieces of one second without a punch of either side.
pub(crate) fn guards(track: &Track) -> Vec<Segment> {
    let rate = track.frame_rate;
    let length = GUARD_SECS * rate;
    let mut busy: Vec<f64> = (0..2).flat_map(|side| peaks(track, side)).map(|p| p as f64).collect();
    busy.sort_by(f64::total_cmp);
    busy.push(track.rows.len() as f64 - 1.0 + BEFORE_SECS * rate);
    let mut found = Vec::new();
    let mut from = 0.0;
    for peak in busy {
        while from + length <= peak - BEFORE_SECS * rate {
            found.push(Segment { marks: vec![from, from + length], first_phase: 0.0 });
            from += length;
        }
        from = peak + AFTER_SECS * rate;
    }
    found
}

/// Frames at which an arm is stretched farthest in a punch.
fn peaks(track: &Track, side: usize) -> Vec<usize> {
    let reach = smooth(&track.reach[side], 0.015 * track.frame_rate);
    let window = (RISE_SECS * track.frame_rate) as usize;
    let lowest = |range: std::ops::Range<usize>| reach[range].iter().copied().fold(f64::INFINITY, f64::min);
    (1..reach.len().saturating_sub(1))
        .filter(|&i| {
            let (from, to) = (i.saturating_sub(window), (i + window + 1).min(reach.len()));
            let near = i.saturating_sub(window / 3)..(i + window / 3 + 1).min(reach.len());
            let is_highest = near.clone().all(|k| reach[k] < reach[i] || (reach[k] == reach[i] && k >= i));
            is_highest
                && reach[i] - lowest(from..i) > LEAST_RISE
                && reach[i] - lowest(i..to) > LEAST_RISE * 0.8
        })
        .collect()
}
