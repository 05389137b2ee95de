//! One colour and its spread a pixel, told apart by brightness and colour (Horprasert, Harwood and Davis 1999;
//! docs/papers.md#other-sources).
//!
//! A pixel with colour I is compared with its expected colour E in units of the spread σ of each channel: the brightness
//! distortion α is the factor for which αE is nearest to I, the colour distortion CD the distance left (their equations 5
//! and 6). Each is divided by its own spread at that pixel (7 to 10). Where both are small there is background; where
//! only α is off, shadow or highlight; all else is foreground (12).
//!
//! Unlike theirs, the clip we learn from contains the person. Means and spreads are medians, and the thresholds for a
//! detection rate r are not read from the far end of the histograms, which the person fills, but carried there from
//! their medians, by the tails of a normal (α) and a Rayleigh (CD) distribution.

use model::{Image, Silhouette};

use crate::{
    Parameters,
    classes::{Classes, Flags},
    gain::GainMeter,
    sample::Sample,
};

/// Largest standard deviation of a channel, grey levels: beyond, a pixel would accept anything.
const LARGEST_SIGMA: f32 = 14.0;
/// Median of the absolute value of a standard normal.
const NORMAL_MEDIAN: f32 = 0.6745;
/// Median of a Rayleigh distribution of parameter 1.
const RAYLEIGH_MEDIAN: f32 = 1.1774;

/// The model of every pixel.
#[derive(Debug, Clone)]
pub struct Distortion {
    width: usize,
    height: usize,
    /// expected colour, grey levels, at least 1; by channel
    mean: [Vec<f32>; 3],
    /// 1 / standard deviation, by channel
    inverse: [Vec<f32>; 3],
    /// squared colour distortion that makes foreground
    colour_limit: Vec<f32>,
    /// brightness distortion |α - 1| that is still background
    brightness_limit: Vec<f32>,
    darkest: f32,
    brightest: f32,
    update_rate: f32,
    gain: Option<GainMeter>,
}

/// Spread of a pixel's channels, grey levels.
type Sigma = [f32; 3];

impl Distortion {
    /// Learns from the sample alone: medians and their absolute deviations.
    pub(crate) fn adaptive(parameters: &Parameters, frames: &[Image], sample: &Sample) -> Self {
        let mut values = vec![0.0; frames.len()];
        let floor = parameters.noise_floor as f32;
        let gains = gains(parameters, &sample.median, frames);
        let sigma = |index: usize| {
            let mut sigma = [0.0; 3];
            for (c, sigma) in sigma.iter_mut().enumerate() {
                let middle = f32::from(sample.median.rgb()[3 * index + c]);
                for ((value, frame), gain) in values.iter_mut().zip(frames).zip(&gains) {
                    *value = (gain[c] * f32::from(frame.rgb()[3 * index + c]) - middle).abs();
                }
                let deviation = *values.select_nth_unstable_by(frames.len() / 2, f32::total_cmp).1;
                let noise = sample.noise_at(middle).max(floor);
                *sigma = (deviation / NORMAL_MEDIAN).clamp(noise, LARGEST_SIGMA.max(noise));
            }
            sigma
        };
        Self::new(parameters, &sample.median, frames, sigma)
    }

    /// Takes the colours of a plate; the spread is the clip's noise, more at edges, which are never quite in place.
    pub(crate) fn from_plate(
        parameters: &Parameters,
        plate: &Image,
        frames: &[Image],
        sample: &Sample,
    ) -> Self {
        let (width, height) = (plate.width(), plate.height());
        let (floor, tolerance) = (parameters.noise_floor as f32, parameters.edge_tolerance as f32);
        let sigma = |index: usize| {
            let (x, y) = (index % width, index / width);
            let [left, right] = [plate.pixel(x.max(1) - 1, y), plate.pixel((x + 1).min(width - 1), y)];
            let [above, below] = [plate.pixel(x, y.max(1) - 1), plate.pixel(x, (y + 1).min(height - 1))];
            let middle = plate.pixel(x, y);
            std::array::from_fn(|c| {
                let neighbours = [left[c], right[c], above[c], below[c]];
                let slope = neighbours.iter().map(|n| n.abs_diff(middle[c])).max().unwrap_or(0);
                let noise = sample.noise_at(f32::from(middle[c])).max(floor);
                let sigma = noise.hypot(tolerance * f32::from(slope));
                sigma.min(LARGEST_SIGMA.max(noise))
            })
        };
        Self::new(parameters, plate, frames, sigma)
    }

    fn new(
        parameters: &Parameters,
        expected: &Image,
        frames: &[Image],
        mut sigma: impl FnMut(usize) -> Sigma,
    ) -> Self {
        let (width, height) = (expected.width(), expected.height());
        let mean = std::array::from_fn(|c| {
            expected.rgb().chunks_exact(3).map(|pixel| f32::from(pixel[c]).max(1.0)).collect()
        });
        let mut inverse: [Vec<f32>; 3] = std::array::from_fn(|_| Vec::with_capacity(width * height));
        for index in 0..width * height {
            let sigma = sigma(index);
            (0..3).for_each(|c| inverse[c].push(1.0 / sigma[c]));
        }
        let mut learned = Self {
            width,
            height,
            mean,
            inverse,
            colour_limit: Vec::with_capacity(width * height),
            brightness_limit: Vec::with_capacity(width * height),
            darkest: parameters.darkest_shadow as f32,
            brightest: parameters.brightest_highlight as f32,
            update_rate: parameters.update_rate as f32,
            gain: parameters.follow_gain.then(|| GainMeter::new(expected)),
        };
        learned.learn_limits(frames, &gains(parameters, expected, frames), parameters.detection_rate);
        learned
    }

    /// Spreads a and b of the distortions of each pixel, then the thresholds of all pixels together.
    fn learn_limits(&mut self, frames: &[Image], gains: &[[f32; 3]], detection_rate: f64) {
        let count = self.width * self.height;
        let (mut alphas, mut colours) = (vec![0.0; frames.len()], vec![0.0; frames.len()]);
        let (mut all_alphas, mut all_colours) = (Vec::new(), Vec::new());
        let mut spreads = Vec::with_capacity(count);
        // some hundred thousand values are plenty for a median
        let stride = (count * frames.len() / 400_000).max(1);
        for index in 0..count {
            for (frame, image) in frames.iter().enumerate() {
                let pixel = &image.rgb()[3 * index..3 * index + 3];
                let (alpha, colour) =
                    self.distortions(index, std::array::from_fn(|c| f32::from(pixel[c]) * gains[frame][c]));
                (alphas[frame], colours[frame]) = ((alpha - 1.0).abs(), colour.sqrt());
            }
            let middle =
                |values: &mut [f32]| *values.select_nth_unstable_by(frames.len() / 2, f32::total_cmp).1;
            // what the noise alone makes is the least that can be expected; the most guards pixels that the person covers
            // most of the time
            let unit = 1.0 / self.length(index).sqrt();
            let a = (middle(&mut alphas) / NORMAL_MEDIAN).clamp(unit, 4.0 * unit);
            let b = (middle(&mut colours) / RAYLEIGH_MEDIAN).clamp(1.0, 3.0);
            spreads.push((a, b));
            if index % stride == 0 {
                all_alphas.extend(alphas.iter().map(|alpha| alpha / a));
                all_colours.extend(colours.iter().map(|colour| colour / b));
            }
        }
        let middle = |values: &mut Vec<f32>| {
            let half = values.len() / 2;
            *values.select_nth_unstable_by(half, f32::total_cmp).1
        };
        let miss = 1.0 - detection_rate;
        let rayleigh = ((-2.0 * miss.ln()).sqrt()) as f32;
        let alpha_threshold =
            middle(&mut all_alphas).max(NORMAL_MEDIAN) / NORMAL_MEDIAN * normal_tail(miss / 2.0) as f32;
        let colour_threshold = middle(&mut all_colours).max(RAYLEIGH_MEDIAN) / RAYLEIGH_MEDIAN * rayleigh;
        for (a, b) in spreads {
            self.brightness_limit.push(alpha_threshold * a);
            self.colour_limit.push((colour_threshold * b).powi(2));
        }
    }

    /// Σ (E/σ)² of a pixel.
    fn length(&self, index: usize) -> f32 {
        (0..3).map(|c| (self.mean[c][index] * self.inverse[c][index]).powi(2)).sum()
    }

    /// Brightness distortion α and squared colour distortion of a colour.
    fn distortions(&self, index: usize, colour: [f32; 3]) -> (f32, f32) {
        let e: [f32; 3] = std::array::from_fn(|c| self.mean[c][index] * self.inverse[c][index]);
        let x: [f32; 3] = std::array::from_fn(|c| colour[c] * self.inverse[c][index]);
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let alpha = dot(e, x) / dot(e, e);
        (alpha, (0..3).map(|c| (x[c] - alpha * e[c]).powi(2)).sum())
    }

    /// The colours that are expected, as they are now.
    pub fn expected(&self) -> Image {
        let mut image = Image::black(self.width, self.height);
        for (index, pixel) in image.rgb_mut().chunks_exact_mut(3).enumerate() {
            (0..3).for_each(|c| pixel[c] = self.mean[c][index].round() as u8);
        }
        image
    }

    /// Says what each pixel of a frame shows; background pixels are learned from.
    pub(crate) fn classify(&mut self, frame: &Image, classes: &mut Classes) {
        let gain = self.gain.as_mut().map_or([1.0; 3], |gain| gain.measure(frame));
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for y in 0..self.height {
                    for word in 0..self.width.div_ceil(64) {
                        self.classify_word(frame, gain, y, word, classes);
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn classify_word(&mut self, frame: &Image, gain: [f32; 3], y: usize, word: usize, classes: &mut Classes) {
        let (left, right) = (64 * word, (64 * word + 64).min(self.width));
        let range = y * self.width + left..y * self.width + right;
        let count = right - left;
        let mut colour = [[0.0f32; 64]; 3];
        for (i, pixel) in frame.rgb()[3 * range.start..3 * range.end].as_chunks::<3>().0.iter().enumerate() {
            for c in 0..3 {
                colour[c][i] = f32::from(pixel[c]) * gain[c];
            }
        }
        let [mean0, mean1, mean2] = &mut self.mean;
        let (mean0, mean1, mean2) =
            (&mut mean0[range.clone()], &mut mean1[range.clone()], &mut mean2[range.clone()]);
        let [inverse0, inverse1, inverse2] = &self.inverse;
        let (inverse0, inverse1, inverse2) =
            (&inverse0[range.clone()], &inverse1[range.clone()], &inverse2[range.clone()]);
        let (colour_limit, brightness_limit) =
            (&self.colour_limit[range.clone()], &self.brightness_limit[range]);
        let mut flags = Flags::NONE;
        for i in 0..count {
            let e = [mean0[i] * inverse0[i], mean1[i] * inverse1[i], mean2[i] * inverse2[i]];
            let x = [colour[0][i] * inverse0[i], colour[1][i] * inverse1[i], colour[2][i] * inverse2[i]];
            let alpha = (e[0] * x[0] + e[1] * x[1] + e[2] * x[2]) / (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
            let off = [x[0] - alpha * e[0], x[1] - alpha * e[1], x[2] - alpha * e[2]];
            let distance = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
            let (below, above) = (1.0 - brightness_limit[i], 1.0 + brightness_limit[i]);
            let foreground = u8::from(distance > colour_limit[i])
                | u8::from(alpha < self.darkest.min(below))
                | u8::from(alpha > self.brightest.max(above));
            flags.foreground[i] = foreground;
            flags.shadow[i] = u8::from(alpha < below) & (1 - foreground);
            flags.highlight[i] = u8::from(alpha > above) & (1 - foreground);
        }
        if self.update_rate > 0.0 {
            for i in 0..count {
                let other = flags.foreground[i] | flags.shadow[i] | flags.highlight[i];
                let rate = self.update_rate * f32::from(1 - other);
                mean0[i] = (mean0[i] + rate * (colour[0][i] - mean0[i])).max(1.0);
                mean1[i] = (mean1[i] + rate * (colour[1][i] - mean1[i])).max(1.0);
                mean2[i] = (mean2[i] + rate * (colour[2][i] - mean2[i])).max(1.0);
            }
        }
        classes.put(y, word, &flags);
    }

    /// Takes the sample's own colours where `ghosts` says: there the plate shows what the clip does not.
    pub(crate) fn replace(&mut self, ghosts: &Silhouette, by: &Image) {
        for y in 0..self.height {
            for x in (0..self.width).filter(|&x| ghosts.contains(x as isize, y as isize)) {
                let pixel = by.pixel(x, y);
                (0..3).for_each(|c| self.mean[c][y * self.width + x] = f32::from(pixel[c]).max(1.0));
            }
        }
    }
}

/// Gains of the frames against a picture, or 1 if they are not to be followed.
fn gains(parameters: &Parameters, expected: &Image, frames: &[Image]) -> Vec<[f32; 3]> {
    if !parameters.follow_gain {
        return vec![[1.0; 3]; frames.len()];
    }
    let mut meter = GainMeter::new(expected);
    frames.iter().map(|frame| meter.measure(frame)).collect()
}

/// The value that a standard normal exceeds with this probability, below 0.5: Abramowitz and Stegun 26.2.23, within 0.0005.
fn normal_tail(probability: f64) -> f64 {
    let t = (-2.0 * probability.ln()).sqrt();
    t - (2.515_517 + t * (0.802_853 + t * 0.010_328))
        / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_of_the_normal_are_those_of_tables() {
        for (probability, expected) in [(0.025, 1.959_96), (0.0005, 3.290_53), (0.000_05, 3.890_59)] {
            assert!((normal_tail(probability) - expected).abs() < 5e-4);
        }
    }

    #[test]
    fn less_light_is_a_shadow_and_another_colour_is_not() {
        let mut background = Image::black(64, 32);
        background.rgb_mut().chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(&[120, 140, 100]));
        let parameters = Parameters { follow_gain: false, update_rate: 0.0, ..Parameters::default() };
        let frames = vec![background.clone(); 5];
        let sample = Sample::new(&frames).unwrap();
        let mut learned = Distortion::adaptive(&parameters, &frames, &sample);
        let mut frame = background;
        frame.set(10, 5, [90, 105, 75]);
        frame.set(11, 5, [140, 120, 100]);
        frame.set(12, 5, [24, 28, 20]);
        frame.set(13, 5, [138, 161, 115]);
        let mut classes = Classes::new(64, 32);
        learned.classify(&frame, &mut classes);
        assert!(classes.shadow.contains(10, 5) && classes.highlight.contains(13, 5));
        assert!(classes.foreground.contains(11, 5) && classes.foreground.contains(12, 5));
        assert_eq!((classes.foreground.area(), classes.shadow.area(), classes.highlight.area()), (2, 1, 1));
    }
}
