//! Several Gaussians a pixel, for backgrounds that move: leaves, water, screens (Stauffer and Grimson 1999; Zivkovic 2004,
//! whose number of modes adapts). Shadows are darker colours of the same hue as a background mode (Prati et al. 2003;
//! docs/papers.md#other-sources).

use model::Image;

use crate::{
    Parameters,
    classes::{Classes, Flags},
};

/// Most modes of a pixel.
const MODES: usize = 4;
/// Zivkovic's prior against modes without evidence, his c_T.
const PRIOR: f32 = 0.05;
/// Squared distance, in variances, up to which a colour belongs to a mode: his T_g.
const NEAR: f32 = 9.0;
/// Largest variance of a mode, grey levels squared.
const LARGEST_VARIANCE: f32 = 75.0;

/// The modes of a pixel, the heaviest first; unused ones have no weight.
#[derive(Debug, Clone, Copy)]
struct Modes {
    weight: [f32; MODES],
    mean: [[f32; 3]; MODES],
    variance: [f32; MODES],
}

/// The model of every pixel: 80 bytes each.
#[derive(Debug, Clone)]
pub struct Mixture {
    width: usize,
    height: usize,
    pixels: Vec<Modes>,
    settings: Settings,
    update_rate: f32,
}

#[derive(Debug, Clone, Copy)]
struct Settings {
    threshold: f32,
    background_weight: f32,
    first_variance: f32,
    smallest_variance: f32,
    darkest: f32,
}

#[derive(Clone, Copy, PartialEq)]
enum Class {
    Background,
    Shadow,
    Foreground,
}

impl Mixture {
    pub(crate) fn new(parameters: &Parameters, frames: &[Image]) -> Self {
        let (width, height) = (frames[0].width(), frames[0].height());
        let empty = Modes { weight: [0.0; MODES], mean: [[0.0; 3]; MODES], variance: [0.0; MODES] };
        let settings = Settings {
            threshold: parameters.mixture.threshold as f32,
            background_weight: parameters.mixture.background_weight as f32,
            first_variance: parameters.mixture.first_variance as f32,
            smallest_variance: (parameters.noise_floor as f32).powi(2),
            darkest: parameters.darkest_shadow as f32,
        };
        let mut pixels = vec![empty; width * height];
        for (number, frame) in frames.iter().enumerate() {
            // all frames of the sample weigh the same
            let rate = 1.0 / (number + 1) as f32;
            for (modes, colour) in pixels.iter_mut().zip(frame.rgb().as_chunks::<3>().0) {
                modes.learn(colour.map(f32::from), rate, PRIOR / frames.len() as f32, &settings);
            }
        }
        Self { width, height, pixels, settings, update_rate: parameters.update_rate as f32 }
    }

    /// The colours that are most usual, as they are now.
    pub fn expected(&self) -> Image {
        let mut image = Image::black(self.width, self.height);
        for (modes, pixel) in self.pixels.iter().zip(image.rgb_mut().chunks_exact_mut(3)) {
            (0..3).for_each(|c| pixel[c] = modes.mean[0][c].round() as u8);
        }
        image
    }

    /// Says what each pixel of a frame shows, and learns from it.
    pub(crate) fn classify(&mut self, frame: &Image, classes: &mut Classes) {
        for y in 0..self.height {
            for word in 0..self.width.div_ceil(64) {
                let (left, right) = (64 * word, (64 * word + 64).min(self.width));
                let range = y * self.width + left..y * self.width + right;
                let colours = frame.rgb()[3 * range.start..3 * range.end].as_chunks::<3>().0;
                let mut flags = Flags::NONE;
                for (i, (modes, colour)) in self.pixels[range].iter_mut().zip(colours).enumerate() {
                    let colour = colour.map(f32::from);
                    let class = modes.classify(colour, &self.settings);
                    flags.foreground[i] = u8::from(class == Class::Foreground);
                    flags.shadow[i] = u8::from(class == Class::Shadow);
                    if self.update_rate > 0.0 && class == Class::Background {
                        modes.learn(colour, self.update_rate, self.update_rate * PRIOR, &self.settings);
                    }
                }
                classes.put(y, word, &flags);
            }
        }
    }
}

impl Modes {
    #[inline]
    fn classify(&self, colour: [f32; 3], settings: &Settings) -> Class {
        let mut class = Class::Foreground;
        let mut heavier = 0.0;
        for mode in 0..MODES {
            if heavier > settings.background_weight || self.weight[mode] <= 0.0 {
                break;
            }
            let (mean, variance) = (self.mean[mode], self.variance[mode]);
            if squared(difference(colour, mean)) < settings.threshold * variance {
                return Class::Background;
            }
            let factor = dot(colour, mean) / dot(mean, mean).max(1.0);
            if factor <= 1.0 && factor >= settings.darkest {
                let off = squared(difference(colour, mean.map(|value| factor * value)));
                if off < settings.threshold * variance * factor * factor {
                    class = Class::Shadow;
                }
            }
            heavier += self.weight[mode];
        }
        class
    }

    /// Zivkovic's equations 4 to 6 and 14.
    #[inline]
    fn learn(&mut self, colour: [f32; 3], rate: f32, prior: f32, settings: &Settings) {
        let owner = (0..MODES).find(|&mode| {
            self.weight[mode] > 0.0
                && squared(difference(colour, self.mean[mode]))
                    < NEAR.max(settings.threshold) * self.variance[mode]
        });
        for weight in &mut self.weight {
            *weight = ((1.0 - rate) * *weight - prior).max(0.0);
        }
        let mut owner = match owner {
            Some(mode) => {
                self.weight[mode] += rate + prior;
                let step = (rate / self.weight[mode]).min(1.0);
                let off = difference(colour, self.mean[mode]);
                (0..3).for_each(|c| self.mean[mode][c] += step * off[c]);
                let variance = self.variance[mode] + step * (squared(off) / 3.0 - self.variance[mode]);
                self.variance[mode] = variance
                    .clamp(settings.smallest_variance, LARGEST_VARIANCE.max(settings.smallest_variance));
                mode
            }
            None => {
                self.weight[MODES - 1] = rate;
                self.mean[MODES - 1] = colour;
                self.variance[MODES - 1] = settings.first_variance;
                MODES - 1
            }
        };
        // unused modes are not all at the end: those that lost their weight sink as heavier ones rise
        let total: f32 = self.weight.iter().sum();
        self.weight.iter_mut().for_each(|weight| *weight /= total);
        while owner > 0 && self.weight[owner] > self.weight[owner - 1] {
            self.weight.swap(owner, owner - 1);
            self.mean.swap(owner, owner - 1);
            self.variance.swap(owner, owner - 1);
            owner -= 1;
        }
    }
}

#[inline]
fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn squared(a: [f32; 3]) -> f32 {
    dot(a, a)
}
