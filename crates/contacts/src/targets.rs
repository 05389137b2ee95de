use std::ops::Range;

use nalgebra::Vector3;

use crate::{Contact, Contacts, FootTracks, POINTS};

/// Where a point of a foot is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// from where it is, metres
    pub by: Vector3<f64>,
    /// how firmly, 0 to 1
    pub firmness: f64,
}

/// How each point of the feet is to be moved in each frame; `None` where it is left alone. Shape `[frames]`.
///
/// In a contact a point is moved to the contact's place. Over `ramp` frames before and after it the way of its first and
/// last frame fades out, and so does how firmly it is wanted: where a foot goes by itself is not the contact's business.
pub fn moves(tracks: &FootTracks, contacts: &Contacts, ramp: usize) -> Vec<[Option<Move>; POINTS]> {
    let frames = tracks.positions.len();
    let mut sums = vec![[(Vector3::zeros(), 0.0); POINTS]; frames];
    for contact in contacts.all() {
        let place = place(tracks, contact);
        let Range { start, end } = contact.frames;
        let near = sums.iter_mut().enumerate().take(end + ramp).skip(start.saturating_sub(ramp));
        for (frame, sums) in near {
            let nearest = frame.clamp(start, end - 1);
            let weight = smooth_step(1.0 - frame.abs_diff(nearest) as f64 / (ramp + 1) as f64);
            let (sum, total) = &mut sums[contact.point];
            *sum += (place - tracks.positions[nearest][contact.point]) * weight;
            *total += weight;
        }
    }
    // Where two ramps of a point overlap, they share.
    let shared = |(sum, total): (Vector3<f64>, f64)| {
        (total > 0.0).then(|| Move { by: sum / total.max(1.0), firmness: total.min(1.0) })
    };
    sums.into_iter().map(|points| points.map(shared)).collect()
}

/// The longest way that any frame of a contact is from its place, metres.
pub fn longest_way(tracks: &FootTracks, contact: &Contact) -> f64 {
    let place = place(tracks, contact);
    contact.frames.clone().map(|f| (tracks.positions[f][contact.point] - place).norm()).fold(0.0, f64::max)
}

/// Where a contact's point stands: the median of its positions, axis by axis.
fn place(tracks: &FootTracks, contact: &Contact) -> Vector3<f64> {
    let along = |axis: usize| {
        let mut values: Vec<f64> =
            contact.frames.clone().map(|f| tracks.positions[f][contact.point][axis]).collect();
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
    };
    Vector3::new(along(0), along(1), along(2))
}

/// 0 to 1 with flat ends.
fn smooth_step(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}
