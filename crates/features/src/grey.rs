//! The region of the person in grey.

use model::{Image, Silhouette};

/// Larger regions are reduced by two along each side until they are smaller, pixels: work and memory are bounded.
const MAX_PIXELS: usize = 1_600_000;
/// Smaller ones are doubled, pixels: on a person of less than 600 pixels, forearms are too thin for the first octave.
const DOUBLED: usize = 200_000;
/// Pixels around the person that are taken with it: what the widest Gaussian of the first octave reaches.
const AROUND: usize = 8;

/// Grey values of a region and where the person is in it.
#[derive(Debug, Default)]
pub struct Grey {
    pub width: usize,
    pub height: usize,
    /// pixel of the picture that the first value stands for, its centre
    pub origin: [f64; 2],
    /// pixels of the picture from value to value: 0.5 where it was doubled
    pub step: f64,
    /// 0 is black, 1 white; the person's mean outside the person, so that nothing depends on the background; shape
    /// `[height, width]`
    pub values: Vec<f32>,
    /// 1 where the person is, shape `[height, width]`
    pub inside: Vec<u8>,
}

impl Grey {
    /// Reads the region of the person; `false` if nobody is there. What lies outside picture or silhouette is not the person.
    pub fn read(&mut self, image: &Image, silhouette: &Silhouette) -> bool {
        let Some([left, top, right, bottom]) = silhouette.bounds() else { return false };
        let (right, bottom) = (right.min(image.width()), bottom.min(image.height()));
        if left >= right || top >= bottom {
            return false;
        }
        let [left, top] = [left, top].map(|side| side.saturating_sub(AROUND));
        let (right, bottom) = ((right + AROUND).min(image.width()), (bottom + AROUND).min(image.height()));
        let mut block = 1;
        let size = |block: usize| [(right - left) / block, (bottom - top) / block];
        while size(block)[0] * size(block)[1] > MAX_PIXELS {
            block *= 2;
        }
        [self.width, self.height] = size(block);
        if self.width == 0 || self.height == 0 {
            return false;
        }
        self.step = block as f64;
        let to_centre = (block - 1) as f64 / 2.0;
        self.origin = [left, top].map(|side| side as f64 + to_centre);
        self.values.clear();
        self.inside.clear();
        for y in 0..self.height {
            if block == 1 {
                let row = image.row(top + y)[3 * left..3 * (left + self.width)].as_chunks::<3>().0;
                self.values.extend(row.iter().map(luminance));
            } else {
                self.values
                    .extend((0..self.width).map(|x| mean(image, left + x * block, top + y * block, block)));
            }
            let is_inside = |x: usize| {
                let pixels = (0..block).flat_map(|dy| (0..block).map(move |dx| (dx, dy)));
                pixels
                    .map(|(dx, dy)| bit(silhouette, left + x * block + dx, top + y * block + dy))
                    .fold(1, |a, b| a & b)
            };
            self.inside.extend((0..self.width).map(is_inside));
        }
        if !self.fill_background() {
            return false;
        }
        if block == 1 && self.width * self.height < DOUBLED {
            self.double();
        }
        true
    }

    /// Puts a value between each two, along both sides.
    fn double(&mut self) {
        let [width, height] = [self.width, self.height];
        let (values, inside) = (std::mem::take(&mut self.values), std::mem::take(&mut self.inside));
        for y in 0..2 * height - 1 {
            let [above, below] = [y / 2, y.div_ceil(2)].map(|row| row * width);
            for x in 0..2 * width - 1 {
                let [left, right] = [x / 2, x.div_ceil(2)];
                let around = [above + left, above + right, below + left, below + right];
                self.values.push(around.iter().map(|&at| values[at]).sum::<f32>() / 4.0);
                self.inside.push(around.iter().fold(1, |all, &at| all & inside[at]));
            }
        }
        (self.width, self.height, self.step) = (2 * width - 1, 2 * height - 1, 0.5);
    }

    /// Gives the background the person's mean; `false` without a person.
    fn fill_background(&mut self) -> bool {
        let (mut sum, mut count) = (0.0, 0usize);
        for (value, &inside) in self.values.iter().zip(&self.inside) {
            sum += f64::from(value * f32::from(inside));
            count += usize::from(inside);
        }
        let mean = (sum / count.max(1) as f64) as f32;
        for (value, &inside) in self.values.iter_mut().zip(&self.inside) {
            *value = if inside == 1 { *value } else { mean };
        }
        count > 0
    }
}

/// Mean of a block of pixels.
fn mean(image: &Image, left: usize, top: usize, block: usize) -> f32 {
    let row_sum = |y: usize| -> f32 {
        image.row(y)[3 * left..3 * (left + block)].as_chunks::<3>().0.iter().map(luminance).sum()
    };
    (top..top + block).map(row_sum).sum::<f32>() / (block * block) as f32
}

/// 1 where the person is.
fn bit(silhouette: &Silhouette, x: usize, y: usize) -> u8 {
    if x >= silhouette.width() || y >= silhouette.height() {
        return 0;
    }
    (silhouette.row(y)[x / 64] >> (x % 64) & 1) as u8
}

fn luminance([red, green, blue]: &[u8; 3]) -> f32 {
    (0.299 * f32::from(*red) + 0.587 * f32::from(*green) + 0.114 * f32::from(*blue)) * (1.0 / 255.0)
}
