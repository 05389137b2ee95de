use model::Image;

/// Brightness of a picture: a quarter of red and blue each, half of green.
#[derive(Debug, Clone)]
pub(crate) struct Grey {
    pub width: usize,
    pub height: usize,
    values: Vec<u8>,
}

impl Grey {
    pub fn new(image: &Image) -> Self {
        let (width, height) = (image.width(), image.height());
        let mut grey = Self { width, height, values: vec![0; width * height] };
        grey.set(image);
        grey
    }

    /// Takes the brightness of another picture of the same size.
    pub fn set(&mut self, image: &Image) {
        for (value, pixel) in self.values.iter_mut().zip(image.rgb().as_chunks::<3>().0) {
            *value = ((u16::from(pixel[0]) + 2 * u16::from(pixel[1]) + u16::from(pixel[2])) / 4) as u8;
        }
    }

    pub fn get(&self, x: usize, y: usize) -> i32 {
        i32::from(self.values[y * self.width + x])
    }

    /// Between the pixels, linearly; `None` outside.
    pub fn sample(&self, u: f32, v: f32) -> Option<f32> {
        if !(u >= 0.0 && v >= 0.0) {
            return None;
        }
        let (x, y) = (u as usize, v as usize);
        if x + 1 >= self.width || y + 1 >= self.height {
            return None;
        }
        let (a, b) = (u - x as f32, v - y as f32);
        let value = |x, y| self.get(x, y) as f32;
        let above = value(x, y) * (1.0 - a) + value(x + 1, y) * a;
        let below = value(x, y + 1) * (1.0 - a) + value(x + 1, y + 1) * a;
        Some(above * (1.0 - b) + below * b)
    }

    /// Means of 3 × 3 pixels, twice; the border stays.
    pub fn blurred(&self) -> Self {
        let mut blurred = self.clone();
        for _ in 0..2 {
            let from = blurred.clone();
            for y in 1..self.height.saturating_sub(1) {
                for x in 1..self.width.saturating_sub(1) {
                    let sum: i32 = (0..9).map(|i| from.get(x + i % 3 - 1, y + i / 3 - 1)).sum();
                    blurred.values[y * self.width + x] = ((sum + 4) / 9) as u8;
                }
            }
        }
        blurred
    }

    /// How steep brightness is, grey levels over two pixels; 0 at the border.
    pub fn slope(&self, x: usize, y: usize) -> i32 {
        if x == 0 || y == 0 || x + 1 >= self.width || y + 1 >= self.height {
            return 0;
        }
        let along_x = (self.get(x + 1, y) - self.get(x - 1, y)).abs();
        along_x.max((self.get(x, y + 1) - self.get(x, y - 1)).abs())
    }

    /// The steepest slope at most two pixels away along rows and columns.
    pub fn slope_near(&self, x: usize, y: usize) -> i32 {
        let (left, above) = (x.saturating_sub(2), y.saturating_sub(2));
        let (right, below) = ((x + 2).min(self.width - 1), (y + 2).min(self.height - 1));
        [(x, y), (left, y), (right, y), (x, above), (x, below)]
            .into_iter()
            .map(|(x, y)| self.slope(x, y))
            .max()
            .unwrap_or(0)
    }
}
