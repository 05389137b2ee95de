use crate::{Error, Result};

/// Which pixels of an image show the person: one bit a pixel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Silhouette {
    width: usize,
    height: usize,
    words_per_row: usize,
    /// rows from the top, each of whole words; pixel x is bit x % 64 of word x / 64; bits right of the image are 0
    words: Vec<u64>,
}

impl Silhouette {
    /// An image of `width` × `height` pixels without the person.
    pub fn empty(width: usize, height: usize) -> Self {
        let words_per_row = width.div_ceil(64);
        Self { width, height, words_per_row, words: vec![0; words_per_row * height] }
    }

    /// From one value a pixel, row-major, shape `[height, width]`; the person is where `is_person` says so.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if there are not as many values as pixels.
    pub fn from_pixels<T: Copy>(
        width: usize,
        height: usize,
        pixels: &[T],
        is_person: impl Fn(T) -> bool,
    ) -> Result<Self> {
        if width.checked_mul(height) != Some(pixels.len()) {
            return Err(Error::PixelCount { found: pixels.len(), width, height });
        }
        let mut silhouette = Self::empty(width, height);
        for y in 0..height {
            let pixels = &pixels[y * width..(y + 1) * width];
            for (word, pixels) in silhouette.row_mut(y).iter_mut().zip(pixels.chunks(64)) {
                *word = pixels
                    .iter()
                    .enumerate()
                    .fold(0, |bits, (x, &pixel)| bits | u64::from(is_person(pixel)) << x);
            }
        }
        Ok(silhouette)
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// True where the person is; false outside the image as well.
    pub fn contains(&self, x: isize, y: isize) -> bool {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return false };
        x < self.width && y < self.height && self.row(y)[x / 64] >> (x % 64) & 1 == 1
    }

    /// Sets one pixel; nothing outside the image.
    pub fn set(&mut self, x: usize, y: usize, is_person: bool) {
        if x < self.width && y < self.height {
            let word = &mut self.row_mut(y)[x / 64];
            *word = *word & !(1 << (x % 64)) | u64::from(is_person) << (x % 64);
        }
    }

    /// Takes the person away.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// One row of words: pixel x is bit x % 64 of word x / 64.
    pub fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.words_per_row..(y + 1) * self.words_per_row]
    }

    /// One row of words, to be changed; bits right of the image must stay 0.
    pub fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.words[y * self.words_per_row..(y + 1) * self.words_per_row]
    }

    /// All words, row after row.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Number of pixels that show the person.
    pub fn area(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Smallest box with all of the person: left, top, and right and bottom just outside; `None` if nobody is there.
    pub fn bounds(&self) -> Option<[usize; 4]> {
        let is_row = |y: &usize| self.row(*y).iter().any(|&word| word != 0);
        let top = (0..self.height).find(is_row)?;
        let bottom = (0..self.height).rev().find(is_row)? + 1;
        let (mut left, mut right) = (self.width, 0);
        for y in top..bottom {
            let row = self.row(y);
            if let Some(word) = row.iter().position(|&word| word != 0) {
                left = left.min(word * 64 + row[word].trailing_zeros() as usize);
            }
            if let Some(word) = row.iter().rposition(|&word| word != 0) {
                right = right.max(word * 64 + 64 - row[word].leading_zeros() as usize);
            }
        }
        Some([left, top, right, bottom])
    }

    /// Intersection over union with another silhouette of the same size, in [0, 1]; 1 if both are empty.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn iou(&self, other: &Self) -> f64 {
        assert_eq!((self.width, self.height), (other.width, other.height), "silhouettes of the same size");
        let (mut both, mut any) = (0u64, 0u64);
        for (a, b) in self.words.iter().zip(&other.words) {
            both += u64::from((a & b).count_ones());
            any += u64::from((a | b).count_ones());
        }
        if any == 0 { 1.0 } else { both as f64 / any as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_kept_across_words() {
        let (width, height) = (130, 3);
        let pixels: Vec<u8> = (0..width * height).map(|i| u8::from(i % 7 == 3)).collect();
        let silhouette = Silhouette::from_pixels(width, height, &pixels, |pixel| pixel == 1).unwrap();
        for y in 0..height {
            for x in 0..width {
                assert_eq!(silhouette.contains(x as isize, y as isize), pixels[y * width + x] == 1);
            }
        }
        assert_eq!(silhouette.area(), pixels.iter().filter(|&&pixel| pixel == 1).count());
        assert!(!silhouette.contains(-1, 0) && !silhouette.contains(130, 0) && !silhouette.contains(0, 3));
    }

    #[test]
    fn the_box_is_the_smallest() {
        let mut silhouette = Silhouette::empty(200, 100);
        assert_eq!(silhouette.bounds(), None);
        silhouette.set(70, 20, true);
        silhouette.set(150, 60, true);
        silhouette.set(300, 60, true);
        assert_eq!(silhouette.bounds(), Some([70, 20, 151, 61]));
        silhouette.set(150, 60, false);
        assert_eq!(silhouette.bounds(), Some([70, 20, 71, 21]));
    }

    #[test]
    fn overlap_is_intersection_over_union() {
        let mut a = Silhouette::empty(100, 10);
        let mut b = a.clone();
        assert!((a.iou(&b) - 1.0).abs() < f64::EPSILON);
        for x in 0..60 {
            a.set(x, 4, true);
            b.set(x + 30, 4, true);
        }
        assert!((a.iou(&b) - 30.0 / 90.0).abs() < 1e-15);
    }

    #[test]
    fn the_number_of_pixels_is_checked() {
        let error = Silhouette::from_pixels(4, 4, &[0u8; 15], |pixel| pixel > 0).unwrap_err();
        assert_eq!(error.to_string(), "found 15 pixels, expected 4 x 4");
    }
}
