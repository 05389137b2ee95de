//! Windows that follow one another, taken together: what the fast search looks at instead of single windows.

use crate::Threads;
use crate::column::Column;
use crate::graph::neighbour_graph;
use crate::lead::{LEAD, Lead, MAX_CENTRE, MAX_QUERY, quantised, quantised_lead, step_distance};
use crate::lists::Lists;

/// Most windows of a segment.
const MAX_ROWS: usize = 8;
/// Longest segment, in steps of median length from one window to the next.
const MAX_STEPS: f32 = 8.0;
/// Fewer segments than these are not worth a structure: all windows are looked at.
const MIN_SEGMENTS: usize = 512;
const SEGMENTS_A_PIECE: usize = 512;

/// All segments of an index, in the order of their lists.
///
/// Motion is smooth: up to 8 windows in a row lie within a small ball about their mean. A query is compared with the
/// balls' centres, quantised to 16 bits: their leading 32 principal features (docs/papers.md#neighbour-search), and all others
/// where these are not enough.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segments {
    /// steps of the quantisation per degree or centimetre
    pub scale: f32,
    /// mean over the segments of `energy`
    pub mean_energy: f32,
    /// shape `[segments, 32]`
    pub lead: Column<Lead>,
    /// the other features of the centres, shape `[segments, width − 32]`
    pub tail: Column<i16>,
    /// squared length of the tail, (degrees, centimetres)²
    pub energy: Column<f32>,
    /// distance of the farthest window from the centre
    pub radius: Column<f32>,
    /// first row and number of rows of each segment
    pub first: Column<u32>,
    pub length: Column<u32>,
    /// segment of each row
    pub by_row: Column<u32>,
    pub lists: Lists,
    /// segments near to each, see [`neighbour_graph`]
    pub graph: Column<u32>,
}

/// Cuts rows into segments as they come.
pub(crate) struct Cutter {
    width: usize,
    longest: f32,
    /// rows of the segment that is open, shape `[rows, width]`
    open: Vec<f32>,
    travelled: f32,
    next_row: u32,
    centres: Vec<f32>,
    radius: Vec<f32>,
    first: Vec<u32>,
    length: Vec<u32>,
}

impl Cutter {
    /// `median_step`: median distance between a window and the next.
    pub fn new(width: usize, median_step: f32) -> Self {
        Self {
            width,
            longest: MAX_STEPS * median_step,
            open: Vec::with_capacity(MAX_ROWS * width),
            travelled: 0.0,
            next_row: 0,
            centres: Vec::new(),
            radius: Vec::new(),
            first: Vec::new(),
            length: Vec::new(),
        }
    }

    /// Adds the next row; `continues`: whether it is of the same clip as the one before.
    pub fn add(&mut self, row: &[f32], continues: bool) {
        if let Some(last) = self.open.len().checked_sub(self.width) {
            self.travelled += squared_distance(&self.open[last..], row).sqrt();
            if !continues || self.open.len() == MAX_ROWS * self.width || self.travelled > self.longest {
                self.close();
            }
        }
        self.open.extend_from_slice(row);
        self.next_row += 1;
    }

    fn close(&mut self) {
        let rows = self.open.len() / self.width;
        if rows == 0 {
            return;
        }
        let start = self.centres.len();
        self.centres.resize(start + self.width, 0.0);
        let centre = &mut self.centres[start..];
        for row in self.open.chunks_exact(self.width) {
            centre.iter_mut().zip(row).for_each(|(c, v)| *c += v / rows as f32);
        }
        let distances = self.open.chunks_exact(self.width).map(|row| squared_distance(row, centre));
        self.radius.push(distances.fold(0.0, f32::max).sqrt());
        self.first.push(self.next_row - rows as u32);
        self.length.push(rows as u32);
        self.open.clear();
        self.travelled = 0.0;
    }

    /// The segments with their lists and graph; `None` if they are too few to be of use.
    pub fn finish(mut self, threads: &impl Threads) -> Option<Segments> {
        self.close();
        let (count, width) = (self.first.len(), self.width);
        if count < MIN_SEGMENTS {
            return None;
        }
        let centre = |s: usize| &self.centres[s * width..][..width];
        let leading = |s: usize| centre(s).iter().take(LEAD);
        let largest = (0..count).flat_map(leading).fold(1e-3f32, |max, v| max.max(v.abs()));
        let scale = MAX_CENTRE / largest;
        let mut lead = vec![[0; LEAD]; count];
        threads.for_each_piece(&mut lead, SEGMENTS_A_PIECE, |piece, out| {
            for (i, out) in out.iter_mut().enumerate() {
                *out = quantised_lead(centre(piece * SEGMENTS_A_PIECE + i), scale, MAX_CENTRE);
            }
        });
        let (lists, order) = Lists::new(&lead, threads);
        // From the order of time to that of the lists.
        let lead: Vec<Lead> = order.iter().map(|&s| lead[s as usize]).collect();
        let tails = order.iter().flat_map(|&s| centre(s as usize).iter().skip(LEAD));
        let tail: Vec<i16> = tails.map(|v| quantised(*v, scale, MAX_CENTRE)).collect();
        let square = |s: &u32| centre(*s as usize).iter().skip(LEAD).map(|v| v * v).sum::<f32>();
        let energy: Vec<f32> = order.iter().map(square).collect();
        drop(std::mem::take(&mut self.centres));
        let mean_energy = (energy.iter().map(|e| f64::from(*e)).sum::<f64>() / count as f64) as f32;
        let ordered = |all: &[u32]| order.iter().map(|&s| all[s as usize]).collect::<Vec<u32>>();
        let (first, length) = (ordered(&self.first), ordered(&self.length));
        let radius: Vec<f32> = order.iter().map(|&s| self.radius[s as usize]).collect();
        let mut by_row = vec![0; self.next_row as usize];
        for (s, (first, length)) in first.iter().zip(&length).enumerate() {
            by_row[*first as usize..(first + length) as usize].fill(s as u32);
        }
        let graph = neighbour_graph(&lead, &lists, threads);
        Some(Segments {
            scale,
            mean_energy,
            lead: lead.into(),
            tail: tail.into(),
            energy: energy.into(),
            radius: radius.into(),
            first: first.into(),
            length: length.into(),
            by_row: by_row.into(),
            lists,
            graph: graph.into(),
        })
    }
}

impl Segments {
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// Rows of a segment. Within the index even if the file that they come from was damaged.
    pub fn rows(&self, segment: usize, num_rows: usize) -> std::ops::Range<usize> {
        let first = (self.first[segment] as usize).min(num_rows);
        let length = (self.length[segment] as usize).min(MAX_ROWS);
        first..(first + length).min(num_rows)
    }

    /// The segment of a row, if there is such a row.
    pub fn segment_at(&self, row: usize) -> Option<usize> {
        let segment = *self.by_row.get(row)? as usize;
        (segment < self.len()).then_some(segment)
    }

    /// Quantises a query, shape `[width]`.
    pub fn quantise(&self, query: &[f32], tail: &mut Vec<i16>) -> Lead {
        tail.clear();
        tail.extend(query.iter().skip(LEAD).map(|v| quantised(*v, self.scale, MAX_QUERY)));
        quantised_lead(query, self.scale, MAX_QUERY)
    }

    /// Squared distance of a centre's leading features from the query's, (degrees, centimetres)².
    #[inline(always)]
    pub fn lead_distance(&self, lead: &Lead, query: &Lead) -> f32 {
        step_distance(lead, query) as f32 / (self.scale * self.scale)
    }

    /// Squared distance of a centre's other features from the query's, (degrees, centimetres)².
    #[inline(always)]
    pub fn tail_distance(&self, segment: usize, query: &[i16]) -> f32 {
        let (a, a_rest) = self.tail[segment * query.len()..][..query.len()].as_chunks::<LEAD>();
        let (b, b_rest) = query.as_chunks::<LEAD>();
        let rest: f32 =
            a_rest.iter().zip(b_rest).map(|(x, y)| f32::from(*x) - f32::from(*y)).map(|d| d * d).sum();
        let whole: f32 = a.iter().zip(b).map(|(x, y)| step_distance(x, y) as f32).sum();
        (whole + rest) / (self.scale * self.scale)
    }
}

pub(crate) fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}
