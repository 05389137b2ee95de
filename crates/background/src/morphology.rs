//! Growing and shrinking of bit-packed silhouettes, whole words at a time.
//!
//! A step grows by one pixel, in turn to the four and to the eight neighbours, so that several steps have the shape of an
//! octagon. What is outside the picture neither grows into it nor eats of it: a person cut by the border stays.

use model::Silhouette;

/// Grows and shrinks silhouettes of one size; keeps the memory for it.
#[derive(Debug, Clone)]
pub struct Morphology {
    other: Silhouette,
}

impl Morphology {
    /// For silhouettes of `width` × `height` pixels.
    pub fn new(width: usize, height: usize) -> Self {
        Self { other: Silhouette::empty(width, height) }
    }

    /// Grows by `steps` pixels.
    pub fn dilate(&mut self, silhouette: &mut Silhouette, steps: u32) {
        self.steps::<true>(silhouette, steps);
    }

    /// Shrinks by `steps` pixels.
    pub fn erode(&mut self, silhouette: &mut Silhouette, steps: u32) {
        self.steps::<false>(silhouette, steps);
    }

    /// Removes what is at most `2 * steps` pixels wide.
    pub fn open(&mut self, silhouette: &mut Silhouette, steps: u32) {
        self.erode(silhouette, steps);
        self.dilate(silhouette, steps);
    }

    /// Closes gaps of at most `2 * steps` pixels.
    pub fn close(&mut self, silhouette: &mut Silhouette, steps: u32) {
        self.dilate(silhouette, steps);
        self.erode(silhouette, steps);
    }

    fn steps<const GROW: bool>(&mut self, silhouette: &mut Silhouette, steps: u32) {
        for number in 0..steps {
            step::<GROW>(silhouette, &mut self.other, number % 2 == 1);
            std::mem::swap(silhouette, &mut self.other);
        }
    }
}

/// One step; shrinking is growing of what is not the person.
fn step<const GROW: bool>(from: &Silhouette, to: &mut Silhouette, to_diagonals: bool) {
    let (width, height) = (from.width(), from.height());
    let count = width.div_ceil(64);
    let last_mask = last_mask(width);
    for y in 0..height {
        let row = from.row(y);
        let above = y.checked_sub(1).map(|y| from.row(y));
        let below = (y + 1 < height).then(|| from.row(y + 1));
        for (i, target) in to.row_mut(y).iter_mut().enumerate() {
            let mask = |i| if i + 1 == count { last_mask } else { u64::MAX };
            let load = |row: &[u64], i: usize| if GROW { row[i] } else { !row[i] & mask(i) };
            let wide = |row: &[u64]| {
                let word = load(row, i);
                let left = if i > 0 { load(row, i - 1) >> 63 } else { 0 };
                let right = if i + 1 < count { load(row, i + 1) << 63 } else { 0 };
                word | word << 1 | left | word >> 1 | right
            };
            let beside = |row: Option<&[u64]>| match row {
                Some(row) if to_diagonals => wide(row),
                Some(row) => load(row, i),
                None => 0,
            };
            let grown = wide(row) | beside(above) | beside(below);
            *target = if GROW { grown } else { !grown } & mask(i);
        }
    }
}

/// The bits of a row's last word that are pixels.
pub(crate) fn last_mask(width: usize) -> u64 {
    match width % 64 {
        0 => u64::MAX,
        used => (1 << used) - 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize) -> Silhouette {
        let pixels: Vec<u32> = (0..width * height)
            .map(|i| ((i as u32).wrapping_mul(2_654_435_761) >> 28) % 3 + ((i / 7) as u32 % 3))
            .collect();
        Silhouette::from_pixels(width, height, &pixels, |pixel| pixel > 1).unwrap()
    }

    /// One step, pixel by pixel.
    fn slow(from: &Silhouette, grow: bool, diagonals: bool) -> Silhouette {
        let (width, height) = (from.width() as isize, from.height() as isize);
        let mut to = Silhouette::empty(from.width(), from.height());
        for y in 0..height {
            for x in 0..width {
                let mut found = from.contains(x, y);
                for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                    let (u, v) = (x + dx, y + dy);
                    let inside = (0..width).contains(&u) && (0..height).contains(&v);
                    if inside && (diagonals || dx == 0 || dy == 0) {
                        found =
                            if grow { found || from.contains(u, v) } else { found && from.contains(u, v) };
                    }
                }
                to.set(x as usize, y as usize, found);
            }
        }
        to
    }

    #[test]
    fn words_do_as_single_pixels_do() {
        for (width, height) in [(130, 20), (128, 9), (64, 3), (31, 31), (1, 5)] {
            let start = picture(width, height);
            let mut morphology = Morphology::new(width, height);
            let (mut grown, mut shrunk) = (start.clone(), start.clone());
            morphology.dilate(&mut grown, 2);
            morphology.erode(&mut shrunk, 2);
            assert!(grown == slow(&slow(&start, true, false), true, true));
            assert!(shrunk == slow(&slow(&start, false, false), false, true));
        }
    }

    #[test]
    fn opening_removes_specks_and_closing_closes_cracks() {
        let mut silhouette = Silhouette::empty(200, 100);
        for y in 20..100 {
            for x in 50..120 {
                silhouette.set(x, y, x != 64);
            }
        }
        let whole = {
            let mut whole = silhouette.clone();
            (20..100).for_each(|y| whole.set(64, y, true));
            whole
        };
        silhouette.set(150, 50, true);
        let mut morphology = Morphology::new(200, 100);
        morphology.close(&mut silhouette, 2);
        morphology.open(&mut silhouette, 1);
        assert!(!silhouette.contains(150, 50));
        assert!(silhouette.iou(&whole) > 0.999, "{}", silhouette.iou(&whole));
        assert!(silhouette.contains(80, 99), "what touches the border stays");
    }
}
