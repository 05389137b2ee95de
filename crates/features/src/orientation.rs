//! Which way a feature is turned (Lowe's section 5).

use crate::{extrema::Extremum, scale_space::Octave};

const BINS: usize = 36;
/// Peaks this high beside the highest are directions of the feature as well.
const OTHER_PEAKS: f32 = 0.8;
/// Width of the window beside that of the feature.
const WINDOW: f32 = 1.5;

/// Calls `each` with every direction of a feature, radians from u towards v.
pub fn directions(octave: &Octave, extremum: &Extremum, weights: &mut Vec<f32>, mut each: impl FnMut(f32)) {
    let layer = &octave.layers[extremum.layer];
    let width = octave.width;
    let [x, y] = extremum.place.map(|place| place.round() as usize);
    let sigma = WINDOW * extremum.sigma;
    let radius = (2.5 * sigma).round() as usize;
    weights.clear();
    weights.extend((0..=radius).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()));
    let mut bins = [0.0f32; BINS];
    for row in y.saturating_sub(radius).max(1)..(y + radius + 1).min(octave.height - 1) {
        for column in x.saturating_sub(radius).max(1)..(x + radius + 1).min(width - 1) {
            let at = row * width + column;
            if octave.inside[at] == 0 {
                continue;
            }
            let across = layer[at + 1] - layer[at - 1];
            let down = layer[at + width] - layer[at - width];
            let weight = weights[row.abs_diff(y)] * weights[column.abs_diff(x)];
            let turn = angle(across, down) * (BINS as f32 / std::f32::consts::TAU);
            let bin = (turn + 0.5) as usize % BINS;
            bins[bin] += weight * (across * across + down * down).sqrt();
        }
    }
    for _ in 0..2 {
        let before = bins;
        for (i, bin) in bins.iter_mut().enumerate() {
            *bin = (before[(i + BINS - 1) % BINS] + before[i] + before[(i + 1) % BINS]) / 3.0;
        }
    }
    let highest = bins.iter().copied().fold(0.0, f32::max);
    if highest <= 0.0 {
        return;
    }
    for i in 0..BINS {
        let (left, here, right) = (bins[(i + BINS - 1) % BINS], bins[i], bins[(i + 1) % BINS]);
        if here >= OTHER_PEAKS * highest && here > left && here >= right {
            let offset = 0.5 * (left - right) / (left - 2.0 * here + right);
            each((i as f32 + offset) * (std::f32::consts::TAU / BINS as f32));
        }
    }
}

/// The angle of a vector in [0, τ], to 0.0003 rad: a polynomial that is the same on every machine (Abramowitz and Stegun,
/// 4.4.49, without its last terms).
#[inline(always)]
pub fn angle(x: f32, y: f32) -> f32 {
    let (wide, high) = (x.abs(), y.abs());
    let (less, more) = (wide.min(high), wide.max(high));
    let t = if more > 0.0 { less / more } else { 0.0 };
    let s = t * t;
    let within = t * (0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1))));
    let first = if high > wide { std::f32::consts::FRAC_PI_2 - within } else { within };
    let upper = if x < 0.0 { std::f32::consts::PI - first } else { first };
    if y < 0.0 { std::f32::consts::TAU - upper } else { upper }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_is_that_of_the_library() {
        for i in 0..1000 {
            let expected = i as f32 * 0.00628;
            let (y, x) = expected.sin_cos();
            assert!((angle(3.0 * x, 3.0 * y) - expected).abs() < 4e-4, "{expected}");
        }
        assert_eq!(angle(0.0, 0.0), 0.0);
    }
}
