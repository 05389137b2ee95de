use model::Silhouette;

use crate::DistanceField;

/// How far a drawn silhouette is from an observed one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Difference {
    /// mean distance of drawn pixels from the observed silhouette, pixels of the view; pixels inside it count 0
    pub drawn_px: f64,
    /// mean distance of observed pixels from the drawn silhouette, pixels of the view
    pub observed_px: f64,
    /// number of pixels that belong to one of the silhouettes only
    pub different: usize,
    /// intersection over union; 1 if both are empty
    pub iou: f64,
}

impl Difference {
    /// The symmetric difference (docs/papers.md#particle-search, eq. 11), pixels of the view: both means together.
    pub fn symmetric_px(&self) -> f64 {
        self.drawn_px + self.observed_px
    }
}

/// An observed silhouette at the resolution of a view, ready to be compared with many drawn ones.
#[derive(Debug, Clone)]
pub struct Observed {
    silhouette: Silhouette,
    bounds: Option<[usize; 4]>,
    area: usize,
    distances: DistanceField,
}

impl Observed {
    /// From a silhouette of a view: the image of the camera, or [`reduced`](crate::reduced) as the view is.
    pub fn new(silhouette: Silhouette) -> Self {
        Self {
            bounds: silhouette.bounds(),
            area: silhouette.area(),
            distances: DistanceField::new(&silhouette, 1),
            silhouette,
        }
    }

    /// The silhouette.
    pub fn silhouette(&self) -> &Silhouette {
        &self.silhouette
    }

    /// Its distances.
    pub fn distances(&self) -> &DistanceField {
        &self.distances
    }
}

/// Compares silhouettes by distance (docs/papers.md#particle-search, eq. 11): distances are zero inside
/// a silhouette, so only pixels in one of the two add to the sums. The buffers are kept between calls.
#[derive(Debug, Clone, Default)]
pub struct Chamfer {
    /// rows to the nearest drawn pixel of the same column, shape `[rows, columns]` of the box
    rows_away: Vec<u16>,
}

impl Chamfer {
    /// A comparison with empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Compares a drawn silhouette, whose pixels all lie in the box `bounds` (left, top, right, bottom; as
    /// [`Rasteriser::silhouette`](crate::Rasteriser::silhouette) returns it), with the observed one. If one of the two is
    /// empty, the other's pixels are as far from it as the image is wide and high together.
    ///
    /// # Panics
    /// If the sizes differ or are above 32,767.
    pub fn difference(
        &mut self,
        drawn: &Silhouette,
        bounds: Option<[usize; 4]>,
        observed: &Observed,
    ) -> Difference {
        let size = |silhouette: &Silhouette| (silhouette.width(), silhouette.height());
        assert_eq!(size(drawn), size(&observed.silhouette), "silhouettes of the same size");
        let far = (drawn.width() + drawn.height()) as f64;
        let (Some(drawn_bounds), Some(observed_bounds)) = (bounds, observed.bounds) else {
            let (drawn, observed) = (drawn.area(), observed.area);
            let mean = |area: usize| if area == 0 { 0.0 } else { far };
            let iou = if drawn + observed == 0 { 1.0 } else { 0.0 };
            return Difference {
                drawn_px: mean(drawn),
                observed_px: mean(observed),
                different: drawn + observed,
                iou,
            };
        };
        let (drawn_area, drawn_only, drawn_sum) = sum_drawn(drawn, drawn_bounds, observed);
        let both = drawn_area - drawn_only;
        let observed_only = observed.area - both;
        let observed_sum = if observed_only == 0 {
            0.0
        } else {
            let [left, top, right, bottom] = [0, 1, 2, 3].map(|side| {
                let (a, b) = (drawn_bounds[side], observed_bounds[side]);
                if side < 2 { a.min(b) } else { a.max(b) }
            });
            // whole words, so that a row of the box is words of the silhouette
            let columns = [left / 64 * 64, right.div_ceil(64) * 64];
            self.measure_columns(drawn, columns, [top, bottom]);
            self.sum_observed(drawn, observed, columns, [top, bottom])
        };
        Difference {
            drawn_px: drawn_sum / drawn_area.max(1) as f64,
            observed_px: observed_sum / observed.area.max(1) as f64,
            different: drawn_only + observed_only,
            iou: both as f64 / (both + drawn_only + observed_only).max(1) as f64,
        }
    }

    fn measure_columns(&mut self, drawn: &Silhouette, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) {
        let columns = right - left;
        self.rows_away.clear();
        self.rows_away.resize(columns * (bottom - top), FAR);
        for y in top..bottom {
            let (above, here) = self.rows_away.split_at_mut((y - top) * columns);
            let above = above.rchunks_exact(columns).next();
            let here = &mut here[..columns];
            if let Some(above) = above {
                for (here, above) in here.iter_mut().zip(above) {
                    *here = (above + 1).min(FAR);
                }
            }
            let words = &drawn.row(y)[left / 64..right / 64];
            for (here, &word) in here.chunks_exact_mut(64).zip(words) {
                match word {
                    0 => {}
                    u64::MAX => here.fill(0),
                    _ => {
                        for (x, here) in here.iter_mut().enumerate() {
                            *here = if word >> x & 1 == 1 { 0 } else { *here };
                        }
                    }
                }
            }
        }
        for y in (top..bottom - 1).rev() {
            let (here, below) = self.rows_away.split_at_mut((y + 1 - top) * columns);
            let here = &mut here[(y - top) * columns..];
            for (here, below) in here.iter_mut().zip(&below[..columns]) {
                *here = (*here).min(below + 1);
            }
        }
    }

    /// Sum of the distances of pixels that are only observed from the nearest drawn pixel.
    fn sum_observed(
        &self,
        drawn: &Silhouette,
        observed: &Observed,
        [left, right]: [usize; 2],
        [top, bottom]: [usize; 2],
    ) -> f64 {
        let columns = right - left;
        let mut sum = 0.0;
        for y in top..bottom {
            let rows_away = &self.rows_away[(y - top) * columns..(y - top + 1) * columns];
            let (drawn, observed) = (drawn.row(y), observed.silhouette.row(y));
            for word in left / 64..right / 64 {
                let mut missing = observed[word] & !drawn[word];
                while missing != 0 {
                    let x = word * 64 + missing.trailing_zeros() as usize - left;
                    missing &= missing - 1;
                    sum += f64::from(nearest_squared(rows_away, x)).sqrt() - 0.5;
                }
            }
        }
        sum
    }
}

/// Rows that are farther than any image is high; one more doesn't overflow.
const FAR: u16 = 1 << 15;

/// Squared distance from column x to the nearest site, given the rows to the nearest site of each column: looks to both
/// sides until columns alone are farther.
fn nearest_squared(rows_away: &[u16], x: usize) -> u32 {
    let squared = |column: usize, across: u32| {
        let rows = u32::from(rows_away[column]);
        rows * rows + across * across
    };
    let mut best = squared(x, 0);
    let mut across = 1;
    while (across * across) < best as usize {
        let (left, right) = (x.checked_sub(across), x + across);
        if left.is_none() && right >= rows_away.len() {
            break;
        }
        if let Some(left) = left {
            best = best.min(squared(left, across as u32));
        }
        if right < rows_away.len() {
            best = best.min(squared(right, across as u32));
        }
        across += 1;
    }
    best
}

/// Number of drawn pixels, of those that are not observed, and the sum of the distances of the latter.
fn sum_drawn(
    drawn: &Silhouette,
    [left, top, right, bottom]: [usize; 4],
    observed: &Observed,
) -> (usize, usize, f64) {
    let (mut area, mut only, mut sum) = (0, 0, 0.0);
    for y in top..bottom {
        let distances = &observed.distances.values()[y * drawn.width()..(y + 1) * drawn.width()];
        let (row, other) = (drawn.row(y), observed.silhouette.row(y));
        for word in left / 64..right.div_ceil(64) {
            area += row[word].count_ones() as usize;
            let mut extra = row[word] & !other[word];
            only += extra.count_ones() as usize;
            while extra != 0 {
                sum -= f64::from(distances[word * 64 + extra.trailing_zeros() as usize]);
                extra &= extra - 1;
            }
        }
    }
    (area, only, sum)
}

/// Number of pixels of a box (left, top, right, bottom) that belong to both silhouettes, and to any: their ratio is the
/// intersection over union of a part of the image.
///
/// # Panics
/// If the sizes differ or the box is not inside the image.
pub fn overlap_in(a: &Silhouette, b: &Silhouette, [left, top, right, bottom]: [usize; 4]) -> (usize, usize) {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()), "silhouettes of the same size");
    assert!(right <= a.width() && bottom <= a.height(), "a box inside the image");
    let (mut both, mut any) = (0, 0);
    if left >= right {
        return (0, 0);
    }
    let (first, last) = (left / 64, (right - 1) / 64);
    for y in top..bottom {
        for word in first..=last {
            let mut mask = u64::MAX;
            if word == first {
                mask &= u64::MAX << (left % 64);
            }
            if word == last {
                mask &= u64::MAX >> (63 - (right - 1) % 64);
            }
            let (a, b) = (a.row(y)[word] & mask, b.row(y)[word] & mask);
            both += (a & b).count_ones() as usize;
            any += (a | b).count_ones() as usize;
        }
    }
    (both, any)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(rectangles: &[[usize; 4]]) -> Silhouette {
        let mut silhouette = Silhouette::empty(200, 150);
        for &[left, top, right, bottom] in rectangles {
            for y in top..bottom {
                for x in left..right {
                    silhouette.set(x, y, true);
                }
            }
        }
        silhouette
    }

    /// Mean distance of the pixels of `silhouette` from `from`, by all pairs.
    fn mean(silhouette: &Silhouette, from: &Silhouette) -> f64 {
        let pixels = |silhouette: &Silhouette| -> Vec<(isize, isize)> {
            let all = (0..150).flat_map(|y| (0..200).map(move |x| (x, y)));
            all.filter(|&(x, y)| silhouette.contains(x, y)).collect()
        };
        let sites = pixels(from);
        let distance = |&(x, y): &(isize, isize)| {
            let squares = sites.iter().map(|(a, b)| (a - x).pow(2) + (b - y).pow(2));
            squares.min().map_or(0.0, |squared| ((squared as f64).sqrt() - 0.5).max(0.0))
        };
        let pixels = pixels(silhouette);
        pixels.iter().map(distance).sum::<f64>() / pixels.len() as f64
    }

    #[test]
    fn the_difference_is_that_of_all_pairs_of_pixels() {
        let observed = boxes(&[[60, 20, 90, 80], [80, 60, 140, 70]]);
        for drawn in [
            boxes(&[[65, 25, 85, 90], [70, 40, 72, 140]]),
            boxes(&[[150, 100, 190, 130]]),
            boxes(&[[0, 0, 3, 3], [100, 20, 190, 120]]),
            observed.clone(),
        ] {
            let mut chamfer = Chamfer::new();
            let found = chamfer.difference(&drawn, drawn.bounds(), &Observed::new(observed.clone()));
            assert!((found.drawn_px - mean(&drawn, &observed)).abs() < 1e-4, "{found:?}");
            assert!((found.observed_px - mean(&observed, &drawn)).abs() < 1e-4, "{found:?}");
            assert!((found.iou - drawn.iou(&observed)).abs() < 1e-12);
            let (both, any) = overlap_in(&drawn, &observed, [0, 0, 200, 150]);
            assert_eq!(found.different, any - both);
        }
    }

    #[test]
    fn an_empty_silhouette_is_as_far_as_the_image_is_large() {
        let (nobody, somebody) = (boxes(&[]), boxes(&[[10, 10, 20, 20]]));
        let difference = |drawn: &Silhouette, observed: &Silhouette| {
            Chamfer::new().difference(drawn, drawn.bounds(), &Observed::new(observed.clone()))
        };
        assert_eq!(difference(&nobody, &nobody), Difference { iou: 1.0, ..Difference::default() });
        for found in [difference(&nobody, &somebody), difference(&somebody, &nobody)] {
            assert!(
                (found.symmetric_px() - 350.0).abs() < 1e-9 && found.different == 100 && found.iou == 0.0
            );
        }
    }

    #[test]
    fn overlap_counts_the_pixels_of_the_box_only() {
        let (a, b) = (boxes(&[[10, 10, 100, 20]]), boxes(&[[50, 10, 150, 20]]));
        assert_eq!(overlap_in(&a, &b, [0, 0, 200, 150]), (500, 1400));
        assert_eq!(overlap_in(&a, &b, [40, 15, 70, 40]), (100, 150));
        assert_eq!(overlap_in(&a, &b, [64, 10, 128, 11]), (36, 64));
        assert_eq!(overlap_in(&a, &b, [30, 15, 30, 40]), (0, 0));
    }
}
