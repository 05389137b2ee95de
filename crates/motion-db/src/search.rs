use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use crate::column::Column;
use crate::fast::FastScratch;
use crate::{ControlTable, WindowIndex};

/// Number of leading principal features that bound a distance from below.
pub(crate) const PREFIX: usize = 16;
/// Rows of a block.
pub(crate) const LANES: usize = 16;

/// Rows stored in blocks of 16, feature by feature, so that 16 distances grow at once.
#[derive(Debug, Clone)]
pub(crate) struct Blocks {
    dims: usize,
    data: Column<f32>,
}

impl Blocks {
    pub fn zeros(rows: usize, dims: usize) -> Self {
        Self { dims, data: vec![0.0; Self::numbers(rows, dims)].into() }
    }

    /// Blocks from a file, which has [`Self::numbers`] of them.
    pub fn from_column(dims: usize, data: Column<f32>) -> Self {
        Self { dims, data }
    }

    /// How many numbers the blocks of so many rows hold.
    pub fn numbers(rows: usize, dims: usize) -> usize {
        rows.div_ceil(LANES) * LANES * dims
    }

    pub fn as_bytes(&self) -> &[u8] {
        self.data.as_bytes()
    }

    /// `fill(row, out)` gives a row's `dims` numbers.
    pub fn new(rows: usize, dims: usize, mut fill: impl FnMut(usize, &mut [f32])) -> Self {
        let mut blocks = Self::zeros(rows, dims);
        let mut scratch = vec![0.0; dims];
        for row in 0..rows {
            fill(row, &mut scratch);
            blocks.set(row, &scratch);
        }
        blocks
    }

    /// Sets a row to the first `dims` of `numbers`.
    pub fn set(&mut self, row: usize, numbers: &[f32]) {
        let dims = self.dims;
        let block = &mut self.data.to_mut()[row / LANES * LANES * dims..][..LANES * dims];
        for (d, v) in numbers[..dims].iter().enumerate() {
            block[d * LANES + row % LANES] = *v;
        }
    }

    pub fn dims(&self) -> usize {
        self.dims
    }

    /// Adds the squared, weighted distances of a block's rows to `query`.
    #[inline(always)]
    pub fn add_distances(
        &self,
        block: usize,
        query: &[f32],
        weights: Option<&[f32]>,
        sums: &mut [f32; LANES],
    ) {
        let data = &self.data[block * LANES * self.dims..][..LANES * self.dims];
        let (columns, _) = data.as_chunks::<LANES>();
        match weights {
            None => {
                for (column, q) in columns.iter().zip(query) {
                    for lane in 0..LANES {
                        let d = column[lane] - q;
                        sums[lane] += d * d;
                    }
                }
            }
            Some(weights) => {
                for ((column, q), w) in columns.iter().zip(query).zip(weights) {
                    for lane in 0..LANES {
                        let d = column[lane] - q;
                        sums[lane] += w * d * d;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn distance(&self, row: usize, query: &[f32], weights: Option<&[f32]>) -> f32 {
        let mut sums = [0.0; LANES];
        self.add_distances(row / LANES, query, weights, &mut sums);
        sums[row % LANES]
    }

    /// The numbers of a row.
    pub fn copy_row(&self, row: usize, out: &mut [f64]) {
        let block = &self.data[row / LANES * LANES * self.dims..][..LANES * self.dims];
        for (d, out) in out.iter_mut().enumerate() {
            *out = f64::from(block[d * LANES + row % LANES]);
        }
    }
}

/// A window found by a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// row of the [`WindowIndex`]
    pub row: usize,
    /// squared distance, (degrees, centimetres)²
    pub distance_squared: f64,
}

/// A question to [`WindowIndex::nearest`].
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// window in principal axes, shape `[width]`
    pub features: &'a [f32],
    /// control points of the frame sought, centimetres, and a 0 for the unlikeness of skeletons, shape `[3·points + 1]`,
    /// with a weight per number (0 where it was not measured): they join the distance
    pub controls: Option<(&'a ControlTable, &'a [f32], &'a [f32])>,
    /// rows that may not be found (the trial under test), in rising order
    pub exclude: &'a [Range<usize>],
    /// rows likely to be near (the successors of the last matches), in rising order: they only speed the exact search
    /// up; the fast search starts from them
    pub hints: &'a [usize],
}

impl Query<'_> {
    pub(crate) fn excludes(&self, row: usize) -> bool {
        let after = self.exclude.partition_point(|r| r.end <= row);
        self.exclude.get(after).is_some_and(|r| r.contains(&row))
    }
}

/// Memory of a search, kept from one to the next.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    pub(crate) heap: std::collections::BinaryHeap<Candidate>,
    pub(crate) fast: FastScratch,
}

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

pub(crate) fn drain_nearest_first(
    heap: &mut std::collections::BinaryHeap<Candidate>,
    out: &mut Vec<Neighbour>,
) {
    out.extend(
        heap.drain().map(|c| Neighbour { row: c.row as usize, distance_squared: f64::from(c.distance) }),
    );
    // No two are equal: the order is that of a stable sort, which would take memory.
    out.sort_unstable_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared).then(a.row.cmp(&b.row)));
}

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
