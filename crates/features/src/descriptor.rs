//! What a feature looks like: histograms of gradients around it (Lowe's section 6).
//!
//! Samples lie on a grid that is turned with the feature and as wide as its Gaussian says, four to a bin along each side, so
//! that their weights and their shares of the bins are the same for all features.

use pulp::{Arch, Simd, WithSimd};

use crate::{orientation::angle, scale_space::Octave};

/// Histograms of 4 × 4 places and 8 directions, each number in steps of 1/512 of the length of all, shape `[4, 4, 8]`.
pub type Descriptor = [u8; 128];

const PLACES: usize = 4;
const DIRECTIONS: usize = 8;
/// Width of a place beside that of the feature's Gaussian.
const PLACE: f32 = 3.0;
const SAMPLES_A_PLACE: usize = 4;
/// Samples along a side: half a place more at each end, where shares of the outer places begin.
const SIDE: usize = (PLACES + 1) * SAMPLES_A_PLACE;
/// No direction counts more than this share, so that one strong edge does not decide.
const MOST: f32 = 0.2;
const STEPS: f32 = 512.0;

/// Shares and weights of the samples along one side.
#[derive(Debug)]
pub struct Grid {
    /// from the middle, places
    offsets: [f32; SIDE],
    /// first of the two places that it belongs to, counted from the one outside
    places: [usize; SIDE],
    /// share of the second
    shares: [f32; SIDE],
    weights: [f32; SIDE],
    /// values at the samples and one around, shape `[SIDE + 2, SIDE + 2]`
    values: [[f32; SIDE + 2]; SIDE + 2],
}

impl Default for Grid {
    fn default() -> Self {
        let offset = |i: usize| (i as f32 + 0.5) / SAMPLES_A_PLACE as f32 - (PLACES + 1) as f32 / 2.0;
        // in places, from the middle of the one outside
        let place = |i: usize| offset(i) + (PLACES + 1) as f32 / 2.0;
        Self {
            offsets: std::array::from_fn(offset),
            places: std::array::from_fn(|i| place(i) as usize),
            shares: std::array::from_fn(|i| place(i) % 1.0),
            weights: std::array::from_fn(|i| (-0.5 * (offset(i) / (PLACES as f32 / 2.0)).powi(2)).exp()),
            values: [[0.0; SIDE + 2]; SIDE + 2],
        }
    }
}

impl Grid {
    /// Describes the surroundings of a place of an octave's layer (pixels), at a width and a direction; `None` where there is
    /// nothing to be seen.
    pub fn describe(
        &mut self,
        octave: &Octave,
        layer: usize,
        place: [f32; 2],
        sigma: f32,
        direction: f32,
    ) -> Option<Descriptor> {
        let (sin, cos) = direction.sin_cos();
        let size = PLACE * sigma;
        let step = size / SAMPLES_A_PLACE as f32;
        let (right, down) = ([cos * step, sin * step], [-sin * step, cos * step]);
        let first = self.offsets[0] * SAMPLES_A_PLACE as f32 - 1.0;
        let values = &octave.layers[layer];
        let farthest = [octave.width, octave.height].map(|side| (side - 1) as f32);
        let mut inside = [[0.0; SIDE]; SIDE];
        for (row, line) in self.values.iter_mut().enumerate() {
            let v = first + row as f32;
            let start = [place[0] + v * down[0], place[1] + v * down[1]];
            for (column, value) in line.iter_mut().enumerate() {
                let u = first + column as f32;
                let x = (start[0] + u * right[0]).clamp(0.0, farthest[0]);
                let y = (start[1] + u * right[1]).clamp(0.0, farthest[1]);
                *value = sample(values, [octave.width, octave.height], [x, y]);
                if (1..=SIDE).contains(&row) && (1..=SIDE).contains(&column) {
                    let at = (y + 0.5) as usize * octave.width + (x + 0.5) as usize;
                    inside[row - 1][column - 1] = f32::from(octave.inside[at]);
                }
            }
        }
        let bins = Arch::new().dispatch(Sum { grid: self, inside: &inside });
        let mut numbers = [0.0; PLACES * PLACES * DIRECTIONS];
        for (i, number) in numbers.iter_mut().enumerate() {
            let (place, direction) = (i / DIRECTIONS, i % DIRECTIONS);
            *number = bins[1 + place / PLACES][1 + place % PLACES][direction];
        }
        quantised(numbers)
    }
}

/// Directions in places, those outside included.
type Bins = [[[f32; DIRECTIONS]; PLACES + 2]; PLACES + 2];

/// The sums of all samples that are inside.
struct Sum<'a> {
    grid: &'a Grid,
    /// 1 where the person is
    inside: &'a [[f32; SIDE]; SIDE],
}

impl WithSimd for Sum<'_> {
    type Output = Bins;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Bins {
        let Self { grid, inside } = self;
        let mut bins = [[[0.0; DIRECTIONS]; PLACES + 2]; PLACES + 2];
        for (row, inside) in inside.iter().enumerate() {
            let (above, here, below) = (&grid.values[row], &grid.values[row + 1], &grid.values[row + 2]);
            let (mut lengths, mut turns) = ([0.0f32; SIDE], [0.0f32; SIDE]);
            for i in 0..SIDE {
                let (across, down) = (here[i + 2] - here[i], below[i + 1] - above[i + 1]);
                lengths[i] = inside[i] * grid.weights[i] * (across * across + down * down).sqrt();
                turns[i] = angle(across, down) * (DIRECTIONS as f32 / std::f32::consts::TAU);
            }
            let (weight, place, share) = (grid.weights[row], grid.places[row], grid.shares[row]);
            for i in 0..SIDE {
                let whole = turns[i] as usize;
                let turn = turns[i] - whole as f32;
                let directions = [whole % DIRECTIONS, (whole + 1) % DIRECTIONS];
                for (v, row_weight) in [(place, weight * (1.0 - share)), (place + 1, weight * share)] {
                    let length = row_weight * lengths[i];
                    let column = grid.places[i];
                    for (u, cell_weight) in
                        [(column, (1.0 - grid.shares[i]) * length), (column + 1, grid.shares[i] * length)]
                    {
                        let bins = &mut bins[v][u];
                        bins[directions[0]] += cell_weight * (1.0 - turn);
                        bins[directions[1]] += cell_weight * turn;
                    }
                }
            }
        }
        bins
    }
}

/// Steps of unit length, long ones cut.
fn quantised(mut numbers: [f32; 128]) -> Option<Descriptor> {
    for most in [MOST, f32::INFINITY] {
        let length = numbers.iter().map(|x| x * x).sum::<f32>().sqrt();
        // also where it is not a number
        let is_seen = length > 1e-6;
        if !is_seen {
            return None;
        }
        numbers.iter_mut().for_each(|x| *x = (*x / length).min(most));
    }
    // a cast saturates
    Some(numbers.map(|x| (STEPS * x + 0.5) as u8))
}

/// Between the centres of four pixels; the place lies in the layer.
#[inline(always)]
fn sample(values: &[f32], [width, height]: [usize; 2], [x, y]: [f32; 2]) -> f32 {
    let (column, row) = ((x as usize).min(width - 2), (y as usize).min(height - 2));
    let (tx, ty) = (x - column as f32, y - row as f32);
    let above = &values[row * width + column..][..2];
    let below = &values[(row + 1) * width + column..][..2];
    let (upper, lower) = (above[0] + (above[1] - above[0]) * tx, below[0] + (below[1] - below[0]) * tx);
    upper + (lower - upper) * ty
}
