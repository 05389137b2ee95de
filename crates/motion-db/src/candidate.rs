use std::collections::BinaryHeap;

use crate::Neighbour;

/// Ordered by distance, then row: the order in which results come does not depend on how they were found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub distance: f32,
    pub row: u32,
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.distance.total_cmp(&other.distance).then(self.row.cmp(&other.row))
    }
}

/// Moves all candidates into `out`, nearest first.
pub(crate) fn drain_nearest_first(heap: &mut BinaryHeap<Candidate>, out: &mut Vec<Neighbour>) {
    out.extend(
        heap.drain().map(|c| Neighbour { row: c.row as usize, distance_squared: f64::from(c.distance) }),
    );
    // No two are equal: the order is that of a stable sort, which would take memory.
    out.sort_unstable_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared).then(a.row.cmp(&b.row)));
}
