use std::collections::BinaryHeap;

use crate::candidate::Candidate;

/// Memory of a search, kept from one to the next.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    pub(crate) heap: BinaryHeap<Candidate>,
    pub(crate) fast: FastScratch,
}

/// Memory of the fast search.
#[derive(Debug, Clone, Default)]
pub(crate) struct FastScratch {
    /// of the query, quantised
    pub tail: Vec<i16>,
    /// lists by distance
    pub lists: Vec<u64>,
    /// segments by distance
    pub found: Vec<u64>,
    /// when each segment was seen last: by the graph at `age`, in a list at `age + 1`
    pub seen: Vec<u32>,
    pub age: u32,
}

impl FastScratch {
    /// Prepares a search among `segments` segments.
    pub fn start(&mut self, segments: usize) {
        if self.seen.len() < segments || self.age > u32::MAX - 4 {
            self.seen.clear();
            self.seen.resize(segments, 0);
            self.age = 0;
        }
        self.age += 2;
        self.found.clear();
    }
}
