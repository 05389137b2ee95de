//! Finds single jumps: from standing, both feet off the floor, to standing.

use crate::features::Track;
use crate::segment::Segment;

/// Both balls of the feet this far above their standing height: in flight. Metres.
const FLIGHT_M: f64 = 0.05;
/// Lower jumps, and hops in which one foot is held up, are left out. Metres.
const LEAST_JUMP_M: f64 = 0.10;
const MOST_APART_M: f64 = 0.15;
/// A foot this far above its standing height is held up. Metres.
const HELD_UP_M: f64 = 0.12;
/// Longest time taken before take-off and after landing, seconds.
const BEFORE_SECS: f64 = 0.95;
const AFTER_SECS: f64 = 0.85;
/// Shortest time that must be there before and after, seconds.
const LEAST_SECS: f64 = 0.45;

/// Jumps with marks: beginning, take-off, landing, end.
pub(crate) fn jumps(track: &Track) -> Vec<Segment> {
    let rate = track.frame_rate;
    let flights = flights(track);
    let last = track.rows.len().saturating_sub(1) as f64;
    let mut found = Vec::new();
    for (i, &(take_off, landing)) in flights.iter().enumerate() {
        let stands =
            |frame: &usize| (0..2).all(|side| track.balls[side][*frame].y - track.floor_m < HELD_UP_M);
        let earliest = i.checked_sub(1).map_or(0.0, |p| flights[p].1 + 0.3 * rate);
        let latest = flights.get(i + 1).map_or(last, |n| n.0 - 0.3 * rate);
        let begin = (take_off - BEFORE_SECS * rate).max(earliest);
        let end = (landing + AFTER_SECS * rate).min(latest);
        // A foot that is held up belongs to a hop before or after.
        let begin = (begin.ceil() as usize..take_off as usize)
            .rev()
            .take_while(stands)
            .last()
            .map_or(take_off, |f| f as f64);
        let end = (landing as usize..=end as usize).take_while(stands).last().map_or(landing, |f| f as f64);
        if take_off - begin >= LEAST_SECS * rate && end - landing >= LEAST_SECS * rate {
            found.push(Segment { marks: vec![begin, take_off, landing, end], first_phase: 0.0 });
        }
    }
    found
}

/// First and last frame of every real jump's flight.
fn flights(track: &Track) -> Vec<(f64, f64)> {
    let height = |i: usize, side: usize| track.balls[side][i].y - track.floor_m;
    let lower = |i: usize| height(i, 0).min(height(i, 1));
    let mut flights = Vec::new();
    let mut begin = None;
    for i in 0..track.rows.len() {
        match (lower(i) > FLIGHT_M, begin) {
            (true, None) => begin = Some(i),
            (false, Some(b)) => {
                begin = None;
                let apex = (b..i).max_by(|&x, &y| lower(x).total_cmp(&lower(y))).unwrap_or(b);
                let is_jump =
                    lower(apex) > LEAST_JUMP_M && (height(apex, 0) - height(apex, 1)).abs() < MOST_APART_M;
                if is_jump && b > 0 {
                    flights.push((b as f64, i as f64));
                }
            }
            _ => {}
        }
    }
    flights
}
