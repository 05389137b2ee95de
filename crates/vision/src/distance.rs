use model::Silhouette;
use nalgebra::Vector2;

use crate::reduced_pixel;

/// Signed distance to the outline of a silhouette at every pixel, and the nearest pixel of the other kind.
///
/// Exact Euclidean transform (Meijster et al. 2000; the second pass is the lower envelope of Felzenszwalb and
/// Huttenlocher 2012; docs/papers.md#other-sources). The outline lies halfway between pixels of both kinds, so a pixel of
/// the person is as far inside as the nearest background pixel is away, less half a pixel, and a background pixel likewise
/// outside.
///
/// Positions and distances are in pixels of the silhouette it was made from, whatever its `scale`.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceField {
    width: usize,
    height: usize,
    scale: usize,
    /// positive inside the person, pixels of the full image, shape `[height, width]`
    values: Vec<f32>,
    /// nearest pixel of the other kind, x + 65,536 y, shape `[height, width]`
    nearest: Vec<u32>,
}

/// Stands for no pixel of the other kind.
const NONE: u32 = u32::MAX;

impl DistanceField {
    /// Distances of a silhouette, computed on `scale` times fewer pixels along each side (see [`reduced`]).
    ///
    /// # Panics
    /// If `scale` is 0 or the silhouette is wider or higher than 32,768 pixels.
    pub fn new(silhouette: &Silhouette, scale: usize) -> Self {
        assert!(silhouette.width().max(silhouette.height()) <= 1 << 15, "at most 32,768 pixels a side");
        let small;
        let silhouette = if scale == 1 {
            silhouette
        } else {
            small = reduced(silhouette, scale);
            &small
        };
        let (width, height) = (silhouette.width(), silhouette.height());
        let far = (width + height) as f32;
        let mut field = Self {
            width,
            height,
            scale,
            values: vec![-far * scale as f32; width * height],
            nearest: vec![NONE; width * height],
        };
        let Some([left, top, right, bottom]) = silhouette.bounds() else { return field };
        field.transform(silhouette, true, [0, 0, width, height]);
        // inside, only background in or beside the box can be nearest
        let around =
            [left.saturating_sub(1), top.saturating_sub(1), (right + 1).min(width), (bottom + 1).min(height)];
        field.transform(silhouette, false, around);
        field
    }

    /// Fills in the pixels of the box that are not `to_person` with their distance to those that are.
    fn transform(
        &mut self,
        silhouette: &Silhouette,
        to_person: bool,
        [left, top, right, bottom]: [usize; 4],
    ) {
        let (columns, rows) = (right - left, bottom - top);
        let is_site = |x: usize, y: usize| (silhouette.row(y)[x / 64] >> (x % 64) & 1 == 1) == to_person;
        // nearest row with a site in the same column, from above and then from below
        let mut site_rows = vec![u16::MAX; columns * rows];
        let mut last = vec![u16::MAX; columns];
        for y in 0..rows {
            for (x, last) in last.iter_mut().enumerate() {
                *last = if is_site(left + x, top + y) { y as u16 } else { *last };
            }
            site_rows[y * columns..(y + 1) * columns].copy_from_slice(&last);
        }
        last.fill(u16::MAX);
        for y in (0..rows).rev() {
            let row = &mut site_rows[y * columns..(y + 1) * columns];
            for (above, last) in row.iter_mut().zip(&mut last) {
                let at = y as u16;
                *last = if *above == at { at } else { *last };
                let is_below = *last != u16::MAX
                    && (*above == u16::MAX || u32::from(*last - at) < u32::from(at - *above));
                *above = if is_below { *last } else { *above };
            }
        }
        let mut envelope = Envelope::default();
        let sign = if to_person { -1.0 } else { 1.0 } * self.scale as f32;
        for y in 0..rows {
            let row = &site_rows[y * columns..(y + 1) * columns];
            envelope.build(row, y as i32);
            if envelope.parabolas.is_empty() {
                continue;
            }
            let start = (top + y) * self.width + left;
            let ends = envelope.parabolas[1..].iter().map(|next| next.from as usize).chain([columns]);
            for (parabola, end) in envelope.parabolas.iter().zip(ends) {
                let site_x = parabola.x as usize;
                let site = (left + site_x) as u32 | (top as u32 + u32::from(row[site_x])) << 16;
                let part = start + parabola.from as usize..start + end;
                let pixels = self.values[part.clone()].iter_mut().zip(&mut self.nearest[part]);
                for (x, (value, nearest)) in (parabola.from..).zip(pixels) {
                    let squared = x.abs_diff(parabola.x).pow(2) + parabola.height as u32;
                    // the sites themselves belong to the other transform
                    let is_site = squared == 0;
                    *value = if is_site { *value } else { sign * ((squared as f32).sqrt() - 0.5) };
                    *nearest = if is_site { *nearest } else { site };
                }
            }
        }
    }

    /// Width, pixels of the field.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels of the field.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Pixels of the silhouette along a side of a pixel of the field.
    pub fn scale(&self) -> usize {
        self.scale
    }

    /// Signed distances at the pixels of the field, positive inside the person, pixels of the silhouette; shape
    /// `[height, width]`.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// True if a position (pixels of the silhouette) lies in the image.
    pub fn contains(&self, pixel: Vector2<f64>) -> bool {
        let at = reduced_pixel(pixel, self.scale);
        at.x >= -0.5 && at.y >= -0.5 && at.x <= self.width as f64 - 0.5 && at.y <= self.height as f64 - 0.5
    }

    /// Signed distance at a position, pixels: bilinear between the centres of the pixels. Beyond them it falls by one a
    /// pixel.
    pub fn sample(&self, pixel: Vector2<f64>) -> f64 {
        let (corners, [tx, ty], beyond) = self.cell(pixel);
        let upper = corners[0] + (corners[1] - corners[0]) * tx;
        let lower = corners[2] + (corners[3] - corners[2]) * tx;
        upper + (lower - upper) * ty - beyond.norm()
    }

    /// Signed distance at a position and its derivative with respect to the position; see [`sample`](Self::sample).
    pub fn sample_with_gradient(&self, pixel: Vector2<f64>) -> (f64, Vector2<f64>) {
        let ([a, b, c, d], [tx, ty], beyond) = self.cell(pixel);
        let upper = a + (b - a) * tx;
        let lower = c + (d - c) * tx;
        let mut gradient =
            Vector2::new((b - a) * (1.0 - ty) + (d - c) * ty, lower - upper) / self.scale as f64;
        for axis in 0..2 {
            if beyond[axis] != 0.0 {
                gradient[axis] = -beyond[axis] / beyond.norm();
            }
        }
        (upper + (lower - upper) * ty - beyond.norm(), gradient)
    }

    /// Values at the four pixels around a position, how far it is between them, and how far beyond all pixels.
    fn cell(&self, pixel: Vector2<f64>) -> ([f64; 4], [f64; 2], Vector2<f64>) {
        let at = reduced_pixel(pixel, self.scale);
        let last = Vector2::new((self.width - 1) as f64, (self.height - 1) as f64);
        let inside = at.sup(&Vector2::zeros()).inf(&last);
        let beyond = (at - inside) * self.scale as f64;
        let (x, y) = (inside.x as usize, inside.y as usize);
        let (right, below) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
        let value = |x: usize, y: usize| f64::from(self.values[y * self.width + x]);
        let corners = [value(x, y), value(right, y), value(x, below), value(right, below)];
        (corners, [inside.x - x as f64, inside.y - y as f64], beyond)
    }

    /// A point of the outline near a position, pixels: the one nearest to the nearest pixel of the field. `None` if the
    /// silhouette is empty or full.
    pub fn nearest_outline(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        let at = reduced_pixel(pixel, self.scale);
        let x = (at.x.round().max(0.0) as usize).min(self.width - 1);
        let y = (at.y.round().max(0.0) as usize).min(self.height - 1);
        let nearest = self.nearest[y * self.width + x];
        if nearest == NONE {
            return None;
        }
        let site = Vector2::new(f64::from(nearest & 0xffff), f64::from(nearest >> 16));
        let back = (Vector2::new(x as f64, y as f64) - site).normalize();
        let outline = site + back * 0.5;
        Some(outline * self.scale as f64 + Vector2::repeat((self.scale - 1) as f64 / 2.0))
    }
}

/// Lower envelope of the parabolas (x − site)² + height along a row.
#[derive(Default)]
struct Envelope {
    parabolas: Vec<Parabola>,
}

#[derive(Clone, Copy)]
struct Parabola {
    x: i32,
    height: i32,
    /// first pixel where it is lowest
    from: i32,
}

impl Envelope {
    /// Of the sites of one row: the row of the nearest site in every column.
    fn build(&mut self, site_rows: &[u16], y: i32) {
        self.parabolas.clear();
        for (x, &site) in site_rows.iter().enumerate() {
            if site == u16::MAX {
                continue;
            }
            let (x, height) = (x as i32, (i32::from(site) - y).pow(2));
            let mut from = 0;
            while let Some(top) = self.parabolas.last() {
                // the first pixel where the new one is lower: over(x) <= 0 of both squares, rounded up
                let numerator = i64::from(x - top.x) * i64::from(x + top.x) + i64::from(height - top.height);
                let denominator = 2 * i64::from(x - top.x);
                from = numerator.div_euclid(denominator).saturating_add(1).min(i64::from(i32::MAX)) as i32;
                if from > top.from {
                    break;
                }
                self.parabolas.pop();
                from = 0;
            }
            if from < site_rows.len() as i32 {
                self.parabolas.push(Parabola { x, height, from });
            }
        }
    }
}

/// A silhouette with `scale` times fewer pixels along each side, rounded up: those of whose block more than half is the
/// person; of blocks that are half the person, every other one, so that nothing grows or shrinks. Pixel (X, Y) is the block of the image whose top-left pixel is (scale X, scale Y), as in
/// [`View::reduced`](crate::View::reduced).
///
/// # Panics
/// If `scale` is 0.
pub fn reduced(silhouette: &Silhouette, scale: usize) -> Silhouette {
    assert!(scale > 0, "a scale of at least 1");
    let (width, height) = (silhouette.width().div_ceil(scale), silhouette.height().div_ceil(scale));
    let mut small = Silhouette::empty(width, height);
    let mut counts = vec![0u32; width];
    for y in 0..height {
        counts.fill(0);
        let rows = y * scale..((y + 1) * scale).min(silhouette.height());
        let block_height = rows.len();
        for row in rows {
            for (word, &bits) in silhouette.row(row).iter().enumerate() {
                let mut bits = bits;
                while bits != 0 {
                    counts[(word * 64 + bits.trailing_zeros() as usize) / scale] += 1;
                    bits &= bits - 1;
                }
            }
        }
        for (x, &count) in counts.iter().enumerate() {
            let block_width = scale.min(silhouette.width() - x * scale);
            let (twice, pixels) = (2 * count as usize, block_width * block_height);
            small.set(x, y, twice > pixels || (twice == pixels && (x + y) % 2 == 0));
        }
    }
    small
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes and specks, without a pattern.
    fn shapes(width: usize, height: usize) -> Silhouette {
        let mut silhouette = Silhouette::empty(width, height);
        let mut state = 12345u32;
        let mut next = |below: usize| {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as usize % below
        };
        for _ in 0..6 {
            let (left, top, side) = (next(width), next(height), 1 + next(14));
            for y in top..(top + side).min(height) {
                for x in left..(left + side).min(width) {
                    silhouette.set(x, y, true);
                }
            }
        }
        silhouette
    }

    #[test]
    fn distances_are_those_of_all_pairs_of_pixels() {
        let (width, height) = (83, 61);
        let silhouette = shapes(width, height);
        let field = DistanceField::new(&silhouette, 1);
        for y in 0..height as isize {
            for x in 0..width as isize {
                let is_person = silhouette.contains(x, y);
                let others = (0..height as isize).flat_map(|b| (0..width as isize).map(move |a| (a, b)));
                let expected = others
                    .filter(|&(a, b)| silhouette.contains(a, b) != is_person)
                    .map(|(a, b)| (((a - x).pow(2) + (b - y).pow(2)) as f64).sqrt() - 0.5)
                    .fold(f64::INFINITY, f64::min);
                let expected = if is_person { expected } else { -expected };
                let at = Vector2::new(x as f64, y as f64);
                assert!((field.sample(at) - expected).abs() < 1e-5, "at {x}, {y}");
                let outline = field.nearest_outline(at).unwrap();
                assert!(((outline - at).norm() - expected.abs()).abs() < 1e-5, "at {x}, {y}: {outline}");
            }
        }
    }

    #[test]
    fn the_gradient_is_that_of_differences_inside_and_beyond_the_image() {
        let field = DistanceField::new(&shapes(83, 61), 1);
        for at in [Vector2::new(20.3, 33.4), Vector2::new(-7.2, 12.6), Vector2::new(90.4, 70.9)] {
            let (value, gradient) = field.sample_with_gradient(at);
            assert!((value - field.sample(at)).abs() < 1e-12);
            for axis in 0..2 {
                let mut step = Vector2::zeros();
                step[axis] = 1e-5;
                let slope = (field.sample(at + step) - field.sample(at - step)) / 2e-5;
                assert!((slope - gradient[axis]).abs() < 1e-5, "{slope}, {} at {at}", gradient[axis]);
            }
        }
    }

    #[test]
    fn a_field_of_fewer_pixels_tells_distances_in_pixels_of_the_image() {
        let mut silhouette = Silhouette::empty(200, 160);
        for y in 40..120 {
            for x in 48..160 {
                silhouette.set(x, y, true);
            }
        }
        let field = DistanceField::new(&silhouette, 4);
        assert_eq!((field.width(), field.height()), (50, 40));
        // the outline is at x = 47.5
        for x in [31.5, 39.5, 60.0, 75.5] {
            let value = field.sample(Vector2::new(x, 80.0));
            assert!((value - (x - 47.5)).abs() < 1e-4, "{value} at {x}");
        }
        let outline = field.nearest_outline(Vector2::new(33.5, 81.5)).unwrap();
        assert!((outline - Vector2::new(47.5, 81.5)).norm() < 1e-9);
    }

    #[test]
    fn an_empty_silhouette_is_far_from_everywhere() {
        let field = DistanceField::new(&Silhouette::empty(30, 20), 1);
        assert!(field.sample(Vector2::new(3.0, 4.0)) <= -50.0);
        assert_eq!(field.nearest_outline(Vector2::new(3.0, 4.0)), None);
    }
}
