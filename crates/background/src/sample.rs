//! What a sample of the clip tells before any model: its median picture, its noise, and whether the person moves away.

use model::{Image, Silhouette};

use crate::{
    Error, Result,
    components::{Components, Neighbours},
};

/// Side of the blocks in which motion is looked for, pixels.
const BLOCK: usize = 8;
/// Change of a block's mean colour that is motion, grey levels.
const MOTION: i32 = 7;
/// Levels of brightness that have a noise of their own.
pub(crate) const NOISE_BINS: usize = 16;
/// Fewest frames to learn from.
const FEWEST: usize = 3;

/// Statistics of a sample of a clip.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    /// median colour of each pixel
    pub median: Image,
    /// standard deviation of a channel by its brightness, grey levels
    pub noise: [f32; NOISE_BINS],
    /// share of the sample during which the most visited spot lies within the box of what moves
    pub stay_share: f64,
    /// mean share of the picture that changes from one frame of the sample to the next
    pub motion_share: f64,
}

/// Checks that all frames have one size, and that it can be worked with.
pub(crate) fn size_of(frames: &[Image]) -> Result<(usize, usize)> {
    if frames.len() < FEWEST {
        return Err(Error::Sample { found: frames.len(), expected: FEWEST });
    }
    let (width, height) = (frames[0].width(), frames[0].height());
    if [width, height].iter().any(|side| !(32..=16384).contains(side)) {
        return Err(Error::Size { width, height });
    }
    for (frame, image) in frames.iter().enumerate() {
        if (image.width(), image.height()) != (width, height) {
            let (found_width, found_height) = (image.width(), image.height());
            return Err(Error::FrameSize { frame, found_width, found_height, width, height });
        }
    }
    Ok((width, height))
}

impl Sample {
    pub fn new(frames: &[Image]) -> Result<Self> {
        let (width, height) = size_of(frames)?;
        let mut median = Image::black(width, height);
        let mut values = vec![0; frames.len()];
        for (index, byte) in median.rgb_mut().iter_mut().enumerate() {
            for (value, frame) in values.iter_mut().zip(frames) {
                *value = frame.rgb()[index];
            }
            *byte = *values.select_nth_unstable(frames.len() / 2).1;
        }
        let (stay_share, motion_share) = motion(frames);
        Ok(Self { noise: noise(frames, &median), median, stay_share, motion_share })
    }

    /// Standard deviation of a channel of this brightness, grey levels.
    pub fn noise_at(&self, level: f32) -> f32 {
        self.noise[(level as usize * NOISE_BINS / 256).min(NOISE_BINS - 1)]
    }
}

/// From differences of consecutive frames of the sample: their median tells the noise as long as most of the picture
/// stands still.
fn noise(frames: &[Image], median: &Image) -> [f32; NOISE_BINS] {
    let mut counts = [[0u64; 256]; NOISE_BINS];
    for pair in frames.windows(2) {
        for ((&a, &b), &level) in pair[0].rgb().iter().zip(pair[1].rgb()).zip(median.rgb()) {
            counts[usize::from(level) * NOISE_BINS / 256][usize::from(a.abs_diff(b))] += 1;
        }
    }
    let mut noise = counts.map(|counts| {
        let total: u64 = counts.iter().sum();
        // too few pixels say nothing
        (total > 1000).then(|| {
            let mut below = 0;
            let middle = counts.iter().position(|count| {
                below += count;
                2 * below >= total
            });
            // differences of whole levels: half a level of rounding either way
            let difference = middle.unwrap_or(0).max(1) as f32 - 0.5;
            difference / (0.6745 * std::f32::consts::SQRT_2)
        })
    });
    // bins without pixels take over from the darker, then from the brighter
    for bin in 1..NOISE_BINS {
        noise[bin] = noise[bin].or(noise[bin - 1]);
    }
    for bin in (1..NOISE_BINS).rev() {
        noise[bin - 1] = noise[bin - 1].or(noise[bin]);
    }
    noise.map(|noise| noise.unwrap_or(1.0))
}

/// How long what moves stays over one spot, and how much moves.
fn motion(frames: &[Image]) -> (f64, f64) {
    let (columns, rows) = (frames[0].width() / BLOCK, frames[0].height() / BLOCK);
    let mut moved = Silhouette::empty(columns, rows);
    let mut components = Components::default();
    let mut visits = vec![0u32; columns * rows];
    let mut last = None;
    let (mut area, mut boxes) = (0, 0);
    let (mut before, mut now) = (block_means(&frames[0]), Vec::new());
    for frame in &frames[1..] {
        now.clone_from(&before);
        before = block_means(frame);
        for y in 0..rows {
            for x in 0..columns {
                let at = y * columns + x;
                let change = (0..3).map(|c| i32::from(now[at][c]).abs_diff(i32::from(before[at][c]))).max();
                moved.set(x, y, change > Some(MOTION as u32));
            }
        }
        area += moved.area();
        components.find(&moved, true, Neighbours::Eight);
        let largest = components.regions().iter().max_by_key(|region| region.area);
        // single blocks flicker; where nothing moves now, the person still is where it last moved
        if let Some(region) = largest.filter(|region| region.area >= 4) {
            last = Some(region.bounds);
        }
        if let Some([left, top, right, bottom]) = last {
            boxes += 1;
            for y in top..bottom {
                visits[y * columns + left..y * columns + right].iter_mut().for_each(|count| *count += 1);
            }
        }
    }
    let most = visits.into_iter().max().unwrap_or(0);
    let pairs = (frames.len() - 1) as f64;
    let stay = if boxes == 0 { 0.0 } else { f64::from(most) / f64::from(boxes) };
    (stay, area as f64 / (pairs * (columns * rows) as f64))
}

fn block_means(image: &Image) -> Vec<[u8; 3]> {
    let (columns, rows) = (image.width() / BLOCK, image.height() / BLOCK);
    let mut means = Vec::with_capacity(columns * rows);
    for y in 0..rows {
        for x in 0..columns {
            let mut sums = [0u32; 3];
            for row in y * BLOCK..(y + 1) * BLOCK {
                let block = &image.row(row)[3 * x * BLOCK..3 * (x + 1) * BLOCK];
                for pixel in block.chunks_exact(3) {
                    (0..3).for_each(|c| sums[c] += u32::from(pixel[c]));
                }
            }
            means.push(sums.map(|sum| (sum / (BLOCK * BLOCK) as u32) as u8));
        }
    }
    means
}
