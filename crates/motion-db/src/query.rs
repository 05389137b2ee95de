use std::ops::Range;

use crate::ControlTable;

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
