use model::Image;

/// Every so-manieth pixel of a row and row of pixels is looked at.
const STRIDE: usize = 8;
/// Values of a channel that tell its gain, grey levels: neither lost in noise nor saturated.
const USABLE: std::ops::RangeInclusive<u8> = 25..=235;
/// Fewest pixels that tell a gain.
const FEWEST: usize = 50;

/// Measures by which factors a frame's channels are to be multiplied to look like the background: medians of ratios, so
/// that a person on less than half of the picture does not matter.
#[derive(Debug, Clone)]
pub(crate) struct GainMeter {
    /// byte and expected value, by channel
    points: [Vec<(u32, f32)>; 3],
    ratios: Vec<f32>,
}

impl GainMeter {
    pub fn new(expected: &Image) -> Self {
        let (width, height) = (expected.width(), expected.height());
        let mut points: [Vec<(u32, f32)>; 3] = Default::default();
        for y in (STRIDE / 2..height).step_by(STRIDE) {
            for x in (STRIDE / 2..width).step_by(STRIDE) {
                for (c, value) in expected.pixel(x, y).into_iter().enumerate() {
                    if USABLE.contains(&value) {
                        points[c].push(((3 * (y * width + x) + c) as u32, f32::from(value)));
                    }
                }
            }
        }
        let most = points.iter().map(Vec::len).max().unwrap_or(0);
        Self { points, ratios: Vec::with_capacity(most) }
    }

    /// Factors of red, green and blue, within [0.5, 2]; 1 where too few pixels tell.
    pub fn measure(&mut self, frame: &Image) -> [f32; 3] {
        let bytes = frame.rgb();
        let mut gain = [1.0; 3];
        for (points, gain) in self.points.iter().zip(&mut gain) {
            self.ratios.clear();
            for &(byte, expected) in points {
                let value = bytes[byte as usize];
                if USABLE.contains(&value) {
                    self.ratios.push(expected / f32::from(value));
                }
            }
            if self.ratios.len() >= FEWEST {
                let half = self.ratios.len() / 2;
                *gain = self.ratios.select_nth_unstable_by(half, f32::total_cmp).1.clamp(0.5, 2.0);
            }
        }
        gain
    }
}
