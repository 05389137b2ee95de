//! The scale space of a region: Gaussians of growing width, each octave at half the resolution of the one before.

use pulp::{Arch, Simd, WithSimd};

use crate::grey::Grey;

/// Scales an octave at which extrema are looked for (Lowe's figure 3: three are best).
pub const SCALES: usize = 3;
/// Gaussians of an octave: differences above and below every scale are needed.
pub const LAYERS: usize = SCALES + 3;
/// Width of the first Gaussian of every octave, its pixels.
pub const FIRST: f64 = 1.6;
/// Width that the picture itself has, its pixels.
const OF_PICTURE: f64 = 0.5;
/// Most octaves: a person has few features wider than those of the fourth.
const MAX_OCTAVES: usize = 4;
/// Smallest side of an octave, pixels.
const LEAST_SIDE: usize = 12;

/// One octave.
#[derive(Debug, Default)]
pub struct Octave {
    pub width: usize,
    pub height: usize,
    /// Gaussians, shape `[LAYERS][height, width]`
    pub layers: [Vec<f32>; LAYERS],
    /// 1 where the person is, shape `[height, width]`
    pub inside: Vec<u8>,
    /// 1 where the person is all around, shape `[height, width]`
    pub well_inside: Vec<u8>,
}

/// All octaves; keeps its memory from picture to picture.
#[derive(Debug, Default)]
pub struct ScaleSpace {
    octaves: Vec<Octave>,
    used: usize,
    buffers: Buffers,
}

#[derive(Debug, Default)]
struct Buffers {
    /// of one row, both ends made longer
    row: Vec<f32>,
    /// after the rows, shape `[height, width]`
    rows: Vec<f32>,
    bytes: Vec<u8>,
}

impl ScaleSpace {
    /// Fills it from a region; features will be `margin_px` pixels inside.
    pub fn fill(&mut self, grey: &Grey, margin_px: usize) {
        self.used = 0;
        let (mut width, mut height) = (grey.width, grey.height);
        while self.used < MAX_OCTAVES && width.min(height) >= LEAST_SIDE {
            if self.octaves.len() == self.used {
                self.octaves.push(Octave::default());
            }
            let (before, from) = self.octaves.split_at_mut(self.used);
            let octave = &mut from[0];
            (octave.width, octave.height) = (width, height);
            match before.last() {
                None => {
                    let has = OF_PICTURE / grey.step.min(1.0);
                    let added = (FIRST * FIRST - has * has).sqrt();
                    blur(&grey.values, [width, height], added, &mut self.buffers, &mut octave.layers[0]);
                    octave.inside.clone_from(&grey.inside);
                }
                Some(finer) => octave.halve(finer),
            }
            octave.blur_on(&mut self.buffers);
            octave.inside.clone_into(&mut octave.well_inside);
            for _ in 0..margin_px.min(LEAST_SIDE) {
                erode(&mut octave.well_inside, [width, height], &mut self.buffers.bytes);
            }
            self.used += 1;
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
        }
    }

    pub fn octaves(&self) -> &[Octave] {
        &self.octaves[..self.used]
    }
}

impl Octave {
    /// Every second pixel of the layer that is twice as wide as the first; even ones, so that centres stay where they are.
    fn halve(&mut self, finer: &Octave) {
        self.layers[0].clear();
        self.inside.clear();
        for y in 0..self.height {
            let from = 2 * y * finer.width;
            self.layers[0].extend(finer.layers[SCALES][from..from + finer.width].iter().step_by(2));
            self.inside.extend(finer.inside[from..from + finer.width].iter().step_by(2));
        }
    }

    fn blur_on(&mut self, buffers: &mut Buffers) {
        let size = [self.width, self.height];
        for layer in 1..LAYERS {
            let width = |layer: usize| FIRST * 2f64.powf(layer as f64 / SCALES as f64);
            let added = (width(layer).powi(2) - width(layer - 1).powi(2)).sqrt();
            let (done, next) = self.layers.split_at_mut(layer);
            blur(&done[layer - 1], size, added, buffers, &mut next[0]);
        }
    }
}

/// Clears pixels with a neighbour above, below, left or right that is clear or outside.
fn erode(inside: &mut [u8], [width, height]: [usize; 2], before: &mut Vec<u8>) {
    before.clear();
    before.extend_from_slice(inside);
    for (y, row) in inside.chunks_exact_mut(width).enumerate() {
        if y == 0 || y + 1 == height {
            row.fill(0);
            continue;
        }
        let at = |y: usize| &before[y * width..(y + 1) * width];
        let (above, here, below) = (at(y - 1), at(y), at(y + 1));
        for x in 1..width - 1 {
            row[x] = here[x - 1] & here[x] & here[x + 1] & above[x] & below[x];
        }
        (row[0], row[width - 1]) = (0, 0);
    }
}

/// Adds a Gaussian of standard deviation `sigma`, pixels; beyond the border its pixels go on.
fn blur(from: &[f32], [width, height]: [usize; 2], sigma: f64, buffers: &mut Buffers, to: &mut Vec<f32>) {
    let radius = (3.0 * sigma).ceil() as usize;
    let weight = |i: usize| (-0.5 * (i as f64 / sigma).powi(2)).exp();
    let total = 1.0 + 2.0 * (1..=radius).map(weight).sum::<f64>();
    let kernel: Vec<f32> = (0..=radius).map(|i| (weight(i) / total) as f32).collect();
    buffers.rows.resize(width * height, 0.0);
    buffers.row.resize(width + 2 * radius, 0.0);
    to.resize(width * height, 0.0);
    Arch::new().dispatch(Blur {
        from,
        width,
        height,
        kernel: &kernel,
        row: &mut buffers.row[..width + 2 * radius],
        rows: &mut buffers.rows[..width * height],
        to: &mut to[..width * height],
    });
}

struct Blur<'a> {
    from: &'a [f32],
    width: usize,
    height: usize,
    /// half of it, the middle first
    kernel: &'a [f32],
    row: &'a mut [f32],
    rows: &'a mut [f32],
    to: &'a mut [f32],
}

impl WithSimd for Blur<'_> {
    type Output = ();

    /// Nothing is fused, so that sums are the same on every processor.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { from, width, height, kernel, row, rows, to } = self;
        let radius = kernel.len() - 1;
        for (from, out) in from.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            row[..radius].fill(from[0]);
            row[radius..radius + width].copy_from_slice(from);
            row[radius + width..].fill(from[width - 1]);
            let row = &*row;
            weigh(simd, kernel, out, |i| (&row[radius - i..], &row[radius + i..]));
        }
        let rows = &*rows;
        for (y, out) in to.chunks_exact_mut(width).enumerate() {
            let row = |y: usize| &rows[y * width..];
            weigh(simd, kernel, out, |i| (row(y.saturating_sub(i)), row((y + i).min(height - 1))));
        }
    }
}

/// Registers that are summed in at a time.
const REGISTERS: usize = 4;

/// Sums of pairs of lines, each pair with its weight.
#[inline(always)]
fn weigh<'a, S: Simd>(
    simd: S,
    kernel: &[f32],
    out: &mut [f32],
    pair: impl Fn(usize) -> (&'a [f32], &'a [f32]),
) {
    let width = out.len();
    let chunk = REGISTERS * S::F32_LANES;
    if width < chunk {
        for (at, out) in out.iter_mut().enumerate() {
            *out = kernel[0] * pair(0).0[at];
            for (i, weight) in kernel.iter().enumerate().skip(1) {
                let (a, b) = pair(i);
                *out += weight * (a[at] + b[at]);
            }
        }
        return;
    }
    for at in (0..width).step_by(chunk) {
        // the last ones are summed twice where the width is not a multiple
        let at = at.min(width - chunk);
        let (middle, _) = S::as_simd_f32s(&pair(0).0[at..at + chunk]);
        let weight = simd.splat_f32s(kernel[0]);
        let mut sums = [simd.splat_f32s(0.0); REGISTERS];
        for r in 0..REGISTERS {
            sums[r] = simd.mul_f32s(weight, middle[r]);
        }
        for (i, weight) in kernel.iter().enumerate().skip(1) {
            let (a, b) = pair(i);
            let (a, _) = S::as_simd_f32s(&a[at..at + chunk]);
            let (b, _) = S::as_simd_f32s(&b[at..at + chunk]);
            let weight = simd.splat_f32s(*weight);
            for r in 0..REGISTERS {
                sums[r] = simd.add_f32s(sums[r], simd.mul_f32s(weight, simd.add_f32s(a[r], b[r])));
            }
        }
        let (out, _) = S::as_mut_simd_f32s(&mut out[at..at + chunk]);
        out[..REGISTERS].copy_from_slice(&sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spot_becomes_a_gaussian_of_the_width_that_was_asked_for() {
        let (width, height) = (91, 70);
        let mut spot = vec![0.0; width * height];
        spot[35 * width + 40] = 1.0;
        let mut to = Vec::new();
        blur(&spot, [width, height], 3.0, &mut Buffers::default(), &mut to);
        let (mut sum, mut squares) = (0.0, 0.0);
        for (i, &value) in to.iter().enumerate() {
            sum += f64::from(value);
            squares += f64::from(value) * ((i % width) as f64 - 40.0).powi(2);
        }
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        // three standard deviations are kept
        assert!((squares.sqrt() - 3.0).abs() < 0.06, "{}", squares.sqrt());
    }

    #[test]
    fn erosion_takes_a_pixel_off_all_around() {
        let mut inside = vec![1; 7 * 6];
        inside[2 * 7 + 3] = 0;
        let count = |inside: &[u8]| inside.iter().map(|&b| usize::from(b)).sum::<usize>();
        erode(&mut inside, [7, 6], &mut Vec::new());
        // 5 x 4 less a cross of five
        assert_eq!(count(&inside), 20 - 5);
    }
}
