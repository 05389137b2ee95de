use crate::{Error, Result};

/// A colour picture: red, green and blue, one byte each (sRGB as files and videos have it).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    width: usize,
    height: usize,
    /// rows from the top, shape `[height, width, 3]`
    pixels: Vec<u8>,
}

impl Image {
    /// A black picture of `width` × `height` pixels.
    pub fn black(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![0; 3 * width * height] }
    }

    /// From bytes, rows from the top, shape `[height, width, 3]`.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if there are not three bytes for each pixel.
    pub fn from_rgb(width: usize, height: usize, pixels: Vec<u8>) -> Result<Self> {
        let expected = width.checked_mul(height).and_then(|count| count.checked_mul(3));
        if expected != Some(pixels.len()) {
            return Err(Error::PixelCount { found: pixels.len() / 3, width, height });
        }
        Ok(Self { width, height, pixels })
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All bytes, rows from the top, shape `[height, width, 3]`.
    pub fn rgb(&self) -> &[u8] {
        &self.pixels
    }

    /// All bytes, to be changed.
    pub fn rgb_mut(&mut self) -> &mut [u8] {
        &mut self.pixels
    }

    /// One row, shape `[width, 3]`.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, y: usize) -> &[u8] {
        &self.pixels[3 * y * self.width..3 * (y + 1) * self.width]
    }

    /// Red, green and blue of a pixel.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let pixel = &self.row(y)[3 * x..3 * x + 3];
        [pixel[0], pixel[1], pixel[2]]
    }

    /// Changes a pixel; nothing outside the picture.
    pub fn set(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            let start = 3 * (y * self.width + x);
            self.pixels[start..start + 3].copy_from_slice(&colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_found_where_it_was_set() {
        let mut image = Image::black(5, 4);
        image.set(3, 2, [1, 2, 3]);
        image.set(5, 0, [9, 9, 9]);
        assert_eq!(image.pixel(3, 2), [1, 2, 3]);
        assert_eq!(image.rgb().iter().map(|&byte| u32::from(byte)).sum::<u32>(), 6);
        assert_eq!(Image::from_rgb(5, 4, image.rgb().to_vec()).unwrap(), image);
    }

    #[test]
    fn the_number_of_bytes_is_checked() {
        let error = Image::from_rgb(4, 4, vec![0; 45]).unwrap_err();
        assert_eq!(error.to_string(), "found 15 pixels, expected 4 x 4");
        assert!(Image::from_rgb(usize::MAX, 2, Vec::new()).is_err());
    }
}
