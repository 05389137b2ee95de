//! The fast search: most of what it finds is what the exact one finds.

use pulp::{Arch, Simd, WithSimd};

use crate::blocks::LANES;
use crate::candidate::{Candidate, drain_nearest_first};
use crate::graph::DEGREE;
use crate::lead::Lead;
use crate::scratch::FastScratch;
use crate::segments::Segments;
use crate::{Neighbour, Query, Scratch, WindowIndex};

/// How much is looked at for 64 neighbours.
struct Effort {
    /// lists that are looked into
    lists: usize,
    /// segments whose windows are looked at
    segments: usize,
}

/// Starting from nothing. Measured: see docs/motion-database.md.
const GLOBAL: Effort = Effort { lists: 96, segments: 500 };
/// Starting from the last matches.
const TRACKING: Effort = Effort { lists: 14, segments: 260 };
/// The same for a query that is like nothing in the database: its neighbours are far away and spread out.
const STRANGE_GLOBAL: Effort = Effort { lists: 256, segments: 1_000 };
const STRANGE_TRACKING: Effort = Effort { lists: 128, segments: 700 };
/// Neighbours for which that much is looked at; for more, in proportion more segments.
const NEIGHBOURS: usize = 64;
/// A query whose tail has this many times the energy of a segment's resembles nothing in the database: the leading features
/// do not tell what is near to it.
const STRANGE_ENERGY: f32 = 1.5;
/// Part of its radius by which a segment may be nearer than its centre. The window at its end rarely points to the query.
const RADIUS_PART: f32 = 0.7;
/// Part of the neighbours that must lie where the graph leads; else it has lost the way.
const LOST_PART: usize = 2;

/// How a fast search went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchMode {
    /// along the graph from the hints
    Tracked,
    /// by the lists alone: there were no hints, or the graph had lost the way
    Global,
    /// by looking at every window, because there are few
    Exact,
}

/// What is nearest comes first, and of equals the lowest number.
fn key(distance: f32, number: usize) -> u64 {
    // Distances are not negative: their bits are in their order.
    u64::from(distance.max(0.0).to_bits()) << 32 | number as u64
}

fn number(key: u64) -> usize {
    (key & u64::from(u32::MAX)) as usize
}

fn distance(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

/// Leaves the `count` smallest keys, in any order.
fn keep_smallest(keys: &mut Vec<u64>, count: usize) {
    if count < keys.len() {
        keys.select_nth_unstable(count);
        keys.truncate(count);
    }
}

/// A question in the terms of the segments.
struct Ask<'a> {
    query: &'a Query<'a>,
    segments: &'a Segments,
    lead: Lead,
    is_strange: bool,
}

impl Ask<'_> {
    #[inline(always)]
    fn controls(&self, distance: impl Fn(&crate::ControlTable, &[f32], &[f32]) -> f32) -> f32 {
        self.query.controls.map_or(0.0, |(table, controls, weights)| distance(table, controls, weights))
    }

    /// Estimated squared distance of a segment's windows.
    #[inline(always)]
    fn estimate(&self, segment: usize, tail: &[i16]) -> f32 {
        let lead = self.segments.lead_distance(&self.segments.lead[segment], &self.lead);
        let rest = if self.is_strange {
            self.segments.tail_distance(segment, tail)
        } else {
            self.segments.energy[segment]
        };
        lead + rest + self.controls(|table, c, w| table.segment_distance(segment, c, w))
    }

    /// Squared distance below which hardly a window of the segment lies.
    #[inline(always)]
    fn bound(&self, segment: usize, estimate: f32, tail: &[i16]) -> f32 {
        let centre = if self.is_strange {
            estimate
        } else {
            estimate - self.segments.energy[segment] + self.segments.tail_distance(segment, tail)
        };
        (centre.max(0.0).sqrt() - RADIUS_PART * self.segments.radius[segment]).max(0.0).powi(2)
    }

    /// Adds a segment to what was found, unless it is there already.
    #[inline(always)]
    fn add(&self, segment: usize, stamp: u32, scratch: &mut FastScratch) {
        if scratch.seen[segment] >= scratch.age {
            return;
        }
        scratch.seen[segment] = stamp;
        if !self.query.exclude.is_empty() && self.query.excludes(self.segments.first[segment] as usize) {
            return;
        }
        let estimate = self.estimate(segment, &scratch.tail);
        scratch.found.push(key(estimate, segment));
    }

    /// The segments of the hints, what follows them, and their neighbours in the graph.
    #[inline(always)]
    fn add_along_graph(&self, scratch: &mut FastScratch) {
        let stamp = scratch.age;
        for &row in self.query.hints {
            if let Some(segment) = self.segments.segment_at(row) {
                self.add(segment, stamp, scratch);
            }
        }
        for i in 0..scratch.found.len() {
            let segment = number(scratch.found[i]);
            let after = self.segments.first[segment] as usize + self.segments.length[segment] as usize;
            if let Some(next) = self.segments.segment_at(after) {
                self.add(next, stamp, scratch);
            }
            for &near in &self.segments.graph[segment * DEGREE..][..DEGREE] {
                // Also where a segment has fewer neighbours.
                if (near as usize) < self.segments.len() {
                    self.add(near as usize, stamp, scratch);
                }
            }
        }
    }

    /// The segments of the `count` nearest lists.
    #[inline(always)]
    fn add_nearest_lists(&self, count: usize, scratch: &mut FastScratch) {
        scratch.lists.clear();
        let lists = &self.segments.lists;
        for (list, centroid) in lists.centroids.iter().enumerate() {
            let estimate = self.segments.lead_distance(centroid, &self.lead)
                + self.controls(|table, c, w| table.list_distance(list, c, w));
            scratch.lists.push(key(estimate, list));
        }
        keep_smallest(&mut scratch.lists, count);
        let stamp = scratch.age + 1;
        for i in 0..scratch.lists.len() {
            for segment in lists.segments(number(scratch.lists[i])) {
                self.add(segment, stamp, scratch);
            }
        }
    }
}

impl WindowIndex {
    /// Almost the `k` nearest windows, nearest first, in a tenth of the time of [`Self::nearest`] or less; distances are
    /// exact. On motion of people that are not in the database 99 of 100 windows are those of the exact search.
    ///
    /// With hints it tracks: it looks at the segments of the hints, their neighbours in the graph, and the nearest few
    /// lists. If half of what it finds is where the graph did not lead, the graph has lost the way, and it searches
    /// as it does without hints: in all lists that matter. The result depends on nothing but the query and `k`.
    pub fn nearest_fast(
        &self,
        query: &Query<'_>,
        k: usize,
        scratch: &mut Scratch,
        out: &mut Vec<Neighbour>,
    ) -> SearchMode {
        let Some(segments) = self.segments.as_ref().filter(|s| 4 * k <= s.len()) else {
            self.nearest(query, k, scratch, out);
            return SearchMode::Exact;
        };
        Arch::new().dispatch(FastSearch { index: self, segments, query, k, scratch, out })
    }
}

/// The search, to be compiled for several instruction sets. It has the same bits on all of them.
struct FastSearch<'a, 'q> {
    index: &'a WindowIndex,
    segments: &'a Segments,
    query: &'a Query<'q>,
    k: usize,
    scratch: &'a mut Scratch,
    out: &'a mut Vec<Neighbour>,
}

impl WithSimd for FastSearch<'_, '_> {
    type Output = SearchMode;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> SearchMode {
        let Self { index, segments, query, k, scratch, out } = self;
        let lead = segments.quantise(query.features, &mut scratch.fast.tail);
        let energy: f32 = query.features.iter().skip(lead.len()).map(|v| v * v).sum();
        let is_strange = energy > STRANGE_ENERGY * segments.mean_energy;
        let ask = Ask { query, segments, lead, is_strange };
        let (global, tracking) =
            if is_strange { (STRANGE_GLOBAL, STRANGE_TRACKING) } else { (GLOBAL, TRACKING) };
        if !query.hints.is_empty() {
            scratch.fast.start(segments.len());
            ask.add_along_graph(&mut scratch.fast);
            ask.add_nearest_lists(tracking.lists, &mut scratch.fast);
            index.look_into(&ask, k, tracking.segments, scratch, out);
            let age = scratch.fast.age;
            let is_on_the_way =
                |n: &&Neighbour| segments.segment_at(n.row).is_some_and(|s| scratch.fast.seen[s] == age);
            if LOST_PART * out.iter().filter(is_on_the_way).count() >= k {
                return SearchMode::Tracked;
            }
        }
        scratch.fast.start(segments.len());
        ask.add_nearest_lists(global.lists, &mut scratch.fast);
        index.look_into(&ask, k, global.segments, scratch, out);
        SearchMode::Global
    }
}

impl WindowIndex {
    /// The nearest windows of the best `count` segments that were found.
    #[inline(always)]
    fn look_into(
        &self,
        ask: &Ask<'_>,
        k: usize,
        count: usize,
        scratch: &mut Scratch,
        out: &mut Vec<Neighbour>,
    ) {
        let Scratch { heap, fast } = scratch;
        let query = ask.query;
        out.clear();
        heap.clear();
        keep_smallest(&mut fast.found, count * k.max(NEIGHBOURS) / NEIGHBOURS);
        for found in &mut fast.found {
            let segment = number(*found);
            *found = key(ask.bound(segment, distance(*found), &fast.tail), segment);
        }
        fast.found.sort_unstable();
        let head = &query.features[..self.prefix.dims()];
        let mut limit = f32::INFINITY;
        for &found in &fast.found {
            if distance(found) > limit {
                break;
            }
            let rows = ask.segments.rows(number(found), self.num_rows());
            let mut block = usize::MAX;
            let mut sums = [0.0; LANES];
            for row in rows {
                if row / LANES != block {
                    // Summed as the exact search does it: equal to the last bit.
                    block = row / LANES;
                    sums = [0.0; LANES];
                    self.prefix.add_distances(block, head, None, &mut sums);
                    if let Some((table, controls, weights)) = query.controls {
                        table.relative.add_distances(block, controls, Some(weights), &mut sums);
                    }
                }
                if sums[row % LANES] > limit || query.excludes(row) {
                    continue;
                }
                let distance = self.full_distance(row, query.features, sums[row % LANES], limit);
                let candidate = Candidate { distance, row: row as u32 };
                if heap.len() < k {
                    heap.push(candidate);
                } else if let Some(mut worst) = heap.peek_mut()
                    && candidate < *worst
                {
                    *worst = candidate;
                }
                if heap.len() == k {
                    limit = heap.peek().map_or(limit, |worst| worst.distance);
                }
            }
        }
        drain_nearest_first(heap, out);
    }
}
