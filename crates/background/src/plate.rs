//! Brings a plate, a picture of the scene without the person, over the frames of the clip: size, place, brightness.
//!
//! The clip's median picture is the reference; it may contain a person who stays, so everything here is robust: sums of
//! clipped differences for the place, a trimmed line fit for gain and offset of each channel.

use model::Image;

use crate::{Error, Parameters, Result, grey::Grey};

/// Difference of brightness beyond which it does not matter how large it is, grey levels.
const CLIP: f32 = 30.0;
/// Share of the pixels, those with the steepest slopes, that are worth looking at for the place.
const EDGE_SHARE: f64 = 0.1;
/// Most pixels that decide on the place.
const MOST_EDGES: usize = 12_000;
/// Difference that remains after alignment where a pixel shows something else, grey levels.
const DIFFERS: f32 = 24.0;
/// Share of such pixels that makes it another scene.
const MOST_DIFFERING: f64 = 0.6;

/// A plate as it lies over the frames.
#[derive(Debug, Clone)]
pub(crate) struct AlignedPlate {
    pub image: Image,
    pub alignment: Alignment,
}

/// How a plate was brought over the frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// plate pixels for a pixel of a frame, along x and y
    pub scale: [f64; 2],
    /// where the frame's pixel (0, 0) is in the plate, pixels
    pub shift: [f64; 2],
    /// by what the plate's red, green and blue were multiplied
    pub gain: [f64; 3],
    /// what was added then, grey levels
    pub offset: [f64; 3],
    /// share of the picture that differs by more than 24 grey levels afterwards (the person does)
    pub differing: f64,
}

/// A map from frame to plate: `plate = scale * frame + shift`.
#[derive(Debug, Clone, Copy)]
struct Place {
    scale: [f64; 2],
    shift: [f64; 2],
}

/// A pixel of the reference that decides on the place.
struct Edge {
    x: f32,
    y: f32,
    value: f32,
}

impl AlignedPlate {
    pub fn new(parameters: &Parameters, plate: &Image, median: &Image) -> Result<Self> {
        let (width, height) = (median.width(), median.height());
        let (found_width, found_height) = (plate.width(), plate.height());
        let similar =
            |found: usize, expected: usize| found >= expected / 4 && found <= expected.saturating_mul(4);
        if !similar(found_width, width) || !similar(found_height, height) {
            return Err(Error::PlateSize { found_width, found_height, width, height });
        }
        let shrunk = shrunk(plate, [width, height]);
        let plate = &shrunk;
        // blurred, since a place between the pixels would else look better for its smoother noise
        let (grey, reference) = (Grey::new(plate).blurred(), Grey::new(median).blurred());
        let edges = edges(&reference);
        let place = find_place(&grey, &reference, &edges, parameters.max_shift);
        let mut image = resampled(plate, median, place);
        let mut alignment = Alignment {
            scale: place.scale,
            shift: place.shift,
            gain: [1.0; 3],
            offset: [0.0; 3],
            differing: 0.0,
        };
        for c in 0..3 {
            let (gain, offset) = brightness(&image, median, c);
            let table: [u8; 256] =
                std::array::from_fn(|value| (gain * value as f64 + offset).round().clamp(0.0, 255.0) as u8);
            image
                .rgb_mut()
                .iter_mut()
                .skip(c)
                .step_by(3)
                .for_each(|value| *value = table[usize::from(*value)]);
            (alignment.gain[c], alignment.offset[c]) = (gain, offset);
        }
        // where there is no plate, the clip's own median has to do
        for y in 0..height {
            for x in 0..width {
                if !place.is_inside(x, y, plate) {
                    image.set(x, y, median.pixel(x, y));
                }
            }
        }
        let differing = image
            .rgb()
            .chunks_exact(3)
            .zip(median.rgb().chunks_exact(3))
            .filter(|(a, b)| (0..3).any(|c| f32::from(a[c].abs_diff(b[c])) > DIFFERS))
            .count();
        alignment.differing = differing as f64 / (width * height) as f64;
        if alignment.differing > MOST_DIFFERING {
            let (width, height) = (plate.width(), plate.height());
            return Err(Error::PlateDiffers { width, height, differing: alignment.differing });
        }
        Ok(Self { image, alignment })
    }
}

impl Place {
    fn at(&self, x: f64, y: f64) -> [f64; 2] {
        [self.scale[0] * x + self.shift[0], self.scale[1] * y + self.shift[1]]
    }

    fn is_inside(&self, x: usize, y: usize, plate: &Image) -> bool {
        let [u, v] = self.at(x as f64, y as f64);
        u > -0.6 && v > -0.6 && u < plate.width() as f64 - 0.4 && v < plate.height() as f64 - 0.4
    }
}

/// Pixels with a slope, evenly from all that have one.
fn edges(grey: &Grey) -> Vec<Edge> {
    let mut counts = [0usize; 256];
    (0..grey.height).for_each(|y| (0..grey.width).for_each(|x| counts[grey.slope(x, y) as usize] += 1));
    let wanted = (EDGE_SHARE * (grey.width * grey.height) as f64) as usize;
    let mut more = 0;
    let steep = (1..256).rev().find(|&slope| {
        more += counts[slope];
        more >= wanted
    });
    let steep = steep.unwrap_or(1) as i32;
    let mut found = Vec::new();
    for y in 1..grey.height - 1 {
        for x in 1..grey.width - 1 {
            if grey.slope(x, y) >= steep {
                found.push(Edge { x: x as f32, y: y as f32, value: grey.get(x, y) as f32 });
            }
        }
    }
    let stride = found.len().div_ceil(MOST_EDGES).max(1);
    found.into_iter().step_by(stride).collect()
}

/// The best of several ways to fit a picture of another size, shifted by whole pixels, then by quarters of one.
fn find_place(plate: &Grey, reference: &Grey, edges: &[Edge], max_shift: u32) -> Place {
    let sides = |grey: &Grey| [grey.width as f64, grey.height as f64];
    let (plate_sides, frame_sides) = (sides(plate), sides(reference));
    let centred = |scale: [f64; 2]| Place {
        scale,
        // centres of the pictures onto each other; pixels are counted from the centre of the first
        shift: std::array::from_fn(|i| {
            (plate_sides[i] - 1.0) / 2.0 - scale[i] * (frame_sides[i] - 1.0) / 2.0
        }),
    };
    let ratio = [plate_sides[0] / frame_sides[0], plate_sides[1] / frame_sides[1]];
    let mut candidates = vec![centred(ratio)];
    if plate_sides != frame_sides {
        candidates.extend([[ratio[0]; 2], [ratio[1]; 2], [1.0; 2]].map(centred));
    }
    let reach = max_shift as i32;
    let coarse: Vec<&Edge> = edges.iter().step_by(edges.len().div_ceil(3000).max(1)).collect();
    let mut best = (f64::INFINITY, candidates[0]);
    for candidate in candidates {
        let line = coarse_brightness(plate, reference, candidate);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let shift = [candidate.shift[0] + f64::from(dx), candidate.shift[1] + f64::from(dy)];
                let place = Place { shift, ..candidate };
                let cost = cost(plate, coarse.iter().copied(), place, line);
                if cost < best.0 {
                    best = (cost, place);
                }
            }
        }
    }
    let line = coarse_brightness(plate, reference, best.1);
    let mut best = (cost(plate, edges, best.1, line), best.1);
    for step in [0.5, 0.25] {
        for _ in 0..2 {
            let centre = best.1;
            for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (f64::from(dx), f64::from(dy)))) {
                let shift = [centre.shift[0] + step * dx, centre.shift[1] + step * dy];
                let place = Place { shift, ..centre };
                let cost = cost(plate, edges, place, line);
                if cost < best.0 {
                    best = (cost, place);
                }
            }
        }
    }
    best.1
}

/// Mean clipped difference of brightness.
fn cost<'a>(
    plate: &Grey,
    edges: impl IntoIterator<Item = &'a Edge>,
    place: Place,
    [gain, offset]: [f32; 2],
) -> f64 {
    let (scale, shift) = (place.scale.map(|s| s as f32), place.shift.map(|s| s as f32));
    let (mut sum, mut count) = (0.0f64, 0usize);
    for edge in edges {
        let found = plate.sample(scale[0] * edge.x + shift[0], scale[1] * edge.y + shift[1]);
        // where the plate ends, it neither fits nor misfits
        let difference =
            found.map_or(CLIP / 2.0, |value| (gain * value + offset - edge.value).abs().min(CLIP));
        sum += f64::from(difference);
        count += 1;
    }
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// Gain and offset that bring the plate's brightness to the reference's, by their 10th, 50th and 90th percentiles.
fn coarse_brightness(plate: &Grey, reference: &Grey, place: Place) -> [f32; 2] {
    let (mut own, mut expected) = (Vec::new(), Vec::new());
    for y in (4..reference.height).step_by(8) {
        for x in (4..reference.width).step_by(8) {
            let [u, v] = place.at(x as f64, y as f64);
            if let Some(found) = plate.sample(u as f32, v as f32) {
                own.push(found);
                expected.push(reference.get(x, y) as f32);
            }
        }
    }
    if own.is_empty() {
        return [1.0, 0.0];
    }
    own.sort_by(f32::total_cmp);
    expected.sort_by(f32::total_cmp);
    let at = |values: &[f32], share: usize| values[(values.len() - 1) * share / 100];
    let spread = |values: &[f32]| (at(values, 90) - at(values, 10)).max(1.0);
    let gain = (spread(&expected) / spread(&own)).clamp(0.25, 4.0);
    [gain, at(&expected, 50) - gain * at(&own, 50)]
}

/// Means of square blocks, where the plate is at least twice as large: it is to be as smooth as the frames.
fn shrunk(plate: &Image, [width, height]: [usize; 2]) -> Image {
    // a little less than twice, for clips with black bars
    let factor =
        ((plate.width() as f64 / width as f64).min(plate.height() as f64 / height as f64) + 0.05) as usize;
    if factor < 2 {
        return plate.clone();
    }
    let mut image = Image::black(plate.width() / factor, plate.height() / factor);
    for y in 0..image.height() {
        for x in 0..image.width() {
            let mut sums = [0u32; 3];
            for (dx, dy) in (0..factor).flat_map(|dx| (0..factor).map(move |dy| (dx, dy))) {
                let pixel = plate.pixel(factor * x + dx, factor * y + dy);
                (0..3).for_each(|c| sums[c] += u32::from(pixel[c]));
            }
            let count = (factor * factor) as u32;
            image.set(x, y, sums.map(|sum| ((sum + count / 2) / count) as u8));
        }
    }
    image
}

fn resampled(plate: &Image, like: &Image, place: Place) -> Image {
    let mut image = Image::black(like.width(), like.height());
    let last = [plate.width() - 1, plate.height() - 1];
    for y in 0..like.height() {
        for x in 0..like.width() {
            let at = place.at(x as f64, y as f64);
            let at: [f64; 2] = std::array::from_fn(|i| at[i].clamp(0.0, last[i] as f64));
            let [u, v] = at.map(|value| value as usize);
            let (a, b) = (at[0] - u as f64, at[1] - v as f64);
            let [right, below] = [(u + 1).min(last[0]), (v + 1).min(last[1])];
            let corners =
                [plate.pixel(u, v), plate.pixel(right, v), plate.pixel(u, below), plate.pixel(right, below)];
            let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
            let colour = std::array::from_fn(|c| {
                let sum: f64 =
                    corners.iter().zip(weights).map(|(corner, weight)| weight * f64::from(corner[c])).sum();
                sum.round() as u8
            });
            image.set(x, y, colour);
        }
    }
    image
}

/// Gain and offset that bring a channel of the plate to the reference: a line through the pixels, refitted without those
/// far from it (the person, and whoever is in the plate).
fn brightness(plate: &Image, reference: &Image, channel: usize) -> (f64, f64) {
    let pairs: Vec<[f64; 2]> = plate
        .rgb()
        .chunks_exact(3)
        .zip(reference.rgb().chunks_exact(3))
        .step_by(29)
        .map(|(a, b)| [f64::from(a[channel]), f64::from(b[channel])])
        .filter(|pair| pair.iter().all(|value| (4.0..=250.0).contains(value)))
        .collect();
    if pairs.len() < 50 {
        return (1.0, 0.0);
    }
    let middle = |mut values: Vec<f64>| {
        let half = values.len() / 2;
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    };
    let mut line = (middle(pairs.iter().map(|[x, y]| y / x).collect()), 0.0);
    for _ in 0..6 {
        let residual = |&[x, y]: &[f64; 2]| (y - line.0 * x - line.1).abs();
        let limit = 3.0 * middle(pairs.iter().map(residual).collect()).max(1.0);
        let near = pairs.iter().filter(|pair| residual(pair) <= limit);
        let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for [x, y] in near {
            (n, sx, sy, sxx, sxy) = (n + 1.0, sx + x, sy + y, sxx + x * x, sxy + x * y);
        }
        let spread = n * sxx - sx * sx;
        if spread < 1e-6 {
            break;
        }
        let gain = ((n * sxy - sx * sy) / spread).clamp(0.25, 4.0);
        line = (gain, (sy - gain * sx) / n);
    }
    line
}
