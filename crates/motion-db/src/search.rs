//! The exact search: one scan of the leading principal features.

use pulp::{Arch, Simd, WithSimd};

use crate::blocks::LANES;
use crate::candidate::{Candidate, drain_nearest_first};
use crate::{Neighbour, Query, Scratch, WindowIndex};

/// The exact search, to be compiled for several instruction sets. It has the same bits on all of them.
struct ExactSearch<'a, 'q> {
    index: &'a WindowIndex,
    query: &'a Query<'q>,
    k: usize,
    scratch: &'a mut Scratch,
    out: &'a mut Vec<Neighbour>,
}

impl WithSimd for ExactSearch<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.index.scan(self.query, self.k, self.scratch, self.out);
    }
}

impl WindowIndex {
    /// The `k` nearest windows, nearest first: exact, by one scan of the leading principal features with the rest of
    /// a row read only where these cannot rule it out.
    pub fn nearest(&self, query: &Query<'_>, k: usize, scratch: &mut Scratch, out: &mut Vec<Neighbour>) {
        Arch::new().dispatch(ExactSearch { index: self, query, k, scratch, out });
    }

    #[inline(always)]
    fn scan(&self, query: &Query<'_>, k: usize, scratch: &mut Scratch, out: &mut Vec<Neighbour>) {
        let heap = &mut scratch.heap;
        heap.clear();
        out.clear();
        if k == 0 {
            return;
        }
        let is_excluded = |row: usize| query.excludes(row);
        let head = &query.features[..self.prefix.dims()];
        let bounds = |block: usize| {
            let mut sums = [0.0; LANES];
            self.prefix.add_distances(block, head, None, &mut sums);
            if let Some((table, controls, weights)) = query.controls {
                table.relative.add_distances(block, controls, Some(weights), &mut sums);
            }
            sums
        };
        // Hints first: they make the bound tight. A first bound only, so that nothing is counted twice.
        let mut next = 0;
        for &row in query.hints {
            if row < next || row >= self.num_rows() || is_excluded(row) {
                continue;
            }
            next = row + 1;
            let controls = query.controls.map_or(0.0, |(t, c, w)| t.relative.distance(row, c, Some(w)));
            let start = self.prefix.distance(row, head, None) + controls;
            let distance = self.full_distance(row, query.features, start, f32::INFINITY);
            heap.push(Candidate { distance, row: row as u32 });
            if heap.len() > k {
                heap.pop();
            }
        }
        let mut limit =
            if heap.len() == k { heap.peek().map_or(f32::INFINITY, |c| c.distance) } else { f32::INFINITY };
        heap.clear();
        // Sums of the hints may be rounded otherwise than those of the scan: leave them room.
        limit *= 1.0 + 1e-4;
        let mut full = false;
        for block in 0..self.num_rows().div_ceil(LANES) {
            let sums = bounds(block);
            let lowest = sums.iter().copied().fold(f32::INFINITY, f32::min);
            if lowest > limit {
                continue;
            }
            for (lane, &bound) in sums.iter().enumerate() {
                let row = block * LANES + lane;
                if bound > limit || row >= self.num_rows() || is_excluded(row) {
                    continue;
                }
                let distance = self.full_distance(row, query.features, bound, limit);
                let candidate = Candidate { distance, row: row as u32 };
                if full {
                    if let Some(mut worst) = heap.peek_mut()
                        && candidate < *worst
                    {
                        *worst = candidate;
                    }
                } else if distance <= limit {
                    heap.push(candidate);
                    full = heap.len() == k;
                }
                if full && let Some(worst) = heap.peek() {
                    limit = limit.min(worst.distance);
                }
            }
        }
        drain_nearest_first(heap, out);
    }

    /// Adds the features behind the prefix to `start`; stops (with what it has, above `limit`) once it is too far.
    #[inline(always)]
    pub(crate) fn full_distance(&self, row: usize, query: &[f32], start: f32, limit: f32) -> f32 {
        let skip = self.prefix.dims();
        let (a, a_rest) = self.features(row)[skip..].as_chunks::<16>();
        let (b, b_rest) = query[skip..].as_chunks::<16>();
        let mut distance = start;
        for (x, y) in a.iter().zip(b) {
            let mut lanes = [0.0f32; 4];
            for i in 0..4 {
                for (lane, sum) in lanes.iter_mut().enumerate() {
                    let d = x[4 * i + lane] - y[4 * i + lane];
                    *sum += d * d;
                }
            }
            distance += (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
            if distance > limit {
                return distance;
            }
        }
        distance + a_rest.iter().zip(b_rest).map(|(x, y)| (x - y) * (x - y)).sum::<f32>()
    }

    /// As [`Self::nearest`], one row after the other with nothing left out: what the fast search is checked against.
    pub fn nearest_brute_force(&self, query: &Query<'_>, k: usize) -> Vec<Neighbour> {
        let mut all: Vec<Neighbour> = (0..self.num_rows())
            .filter(|row| !query.exclude.iter().any(|r| r.contains(row)))
            .map(|row| {
                let controls = query.controls.map_or(0.0, |(t, c, w)| t.relative.distance(row, c, Some(w)));
                let pairs = self.features(row).iter().zip(query.features);
                let windows: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
                Neighbour { row, distance_squared: windows + f64::from(controls) }
            })
            .collect();
        all.sort_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared).then(a.row.cmp(&b.row)));
        all.truncate(k);
        all
    }
}
