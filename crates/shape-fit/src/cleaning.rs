//! Noise is taken out of silhouettes before anything is measured on them.

use background::{Components, Neighbours};
use model::Silhouette;

/// Regions smaller than this share of the largest are not people.
const LEAST_REGION: f64 = 0.04;
/// Larger holes than this share of the person are real: between arm and body.
const LARGEST_HOLE: f64 = 0.004;

/// A silhouette without single wrong pixels, specks beside the person and small holes in it: the majority of every 3 × 3
/// pixels, then regions of some size, then holes filled. Outlines stay where they are, but for corners of a pixel or two.
pub fn cleaned(silhouette: &Silhouette) -> Silhouette {
    let mut clean = majority(silhouette);
    let mut regions = Components::default();
    regions.find(&clean, true, Neighbours::Eight);
    let largest = regions.regions().iter().map(|region| region.area).max().unwrap_or_default();
    let is_speck = |region: usize| (regions.regions()[region].area as f64) < LEAST_REGION * largest as f64;
    regions.draw(&mut clean, false, is_speck);
    let mut holes = Components::default();
    holes.find(&clean, false, Neighbours::Four);
    let (width, height) = (clean.width(), clean.height());
    let area = clean.area() as f64;
    let is_small_hole = |hole: usize| {
        let found = holes.regions()[hole];
        let [left, top, right, bottom] = found.bounds;
        let is_enclosed = left > 0 && top > 0 && right < width && bottom < height;
        is_enclosed && (found.area as f64) < LARGEST_HOLE * area
    };
    holes.draw(&mut clean, true, is_small_hole);
    clean
}

/// What most of the 3 × 3 pixels around each are. Beyond the image the border's pixels go on.
fn majority(silhouette: &Silhouette) -> Silhouette {
    let (width, height) = (silhouette.width(), silhouette.height());
    let mut result = Silhouette::empty(width, height);
    let words = width.div_ceil(64);
    // sums of three neighbours in a row, as ones and twos
    let row_words = |y: usize| -> Vec<(u64, u64)> {
        let row = silhouette.row(y);
        let last = (width - 1) % 64;
        (0..words)
            .map(|i| {
                let from_left = if i == 0 { row[0] & 1 } else { row[i - 1] >> 63 };
                let from_right = if i + 1 < words { row[i + 1] << 63 } else { (row[i] >> last & 1) << last };
                let (left, middle, right) = (row[i] << 1 | from_left, row[i], row[i] >> 1 | from_right);
                (left ^ middle ^ right, left & middle | left & right | middle & right)
            })
            .collect()
    };
    if width == 0 || height == 0 {
        return result;
    }
    let mask = if width % 64 == 0 { !0 } else { (1 << (width % 64)) - 1 };
    let (mut above, mut here) = (row_words(0), row_words(0));
    for y in 0..height {
        let below = row_words((y + 1).min(height - 1));
        let row = result.row_mut(y);
        for i in 0..words {
            let ((a1, a2), (b1, b2), (c1, c2)) = (above[i], here[i], below[i]);
            // ones: a1 + b1 + c1 = s1 + 2 k1; twos: a2 + b2 + c2 = s2 + 2 k2, so the sum is s1 + 2 (k1 + s2) + 4 k2
            let (s1, k1) = (a1 ^ b1 ^ c1, a1 & b1 | a1 & c1 | b1 & c1);
            let (s2, k2) = (a2 ^ b2 ^ c2, a2 & b2 | a2 & c2 | b2 & c2);
            let (twos, fours) = (k1 ^ s2, k1 & s2);
            // at least five: two fours, or one four and anything else
            row[i] = fours & k2 | (fours ^ k2) & (s1 | twos);
        }
        row[words - 1] &= mask;
        above = std::mem::replace(&mut here, below);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_majority_is_that_of_counting() {
        let (width, height) = (131, 40);
        let pixels: Vec<u32> =
            (0..width * height).map(|i| (i as u32).wrapping_mul(2_654_435_761) >> 28).collect();
        let silhouette = Silhouette::from_pixels(width, height, &pixels, |pixel| pixel > 6).unwrap();
        let found = majority(&silhouette);
        for (x, y) in (0..height as isize).flat_map(|y| (0..width as isize).map(move |x| (x, y))) {
            let at = |x: isize, y: isize| {
                silhouette.contains(x.clamp(0, width as isize - 1), y.clamp(0, height as isize - 1))
            };
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
            let count = around.filter(|(dx, dy)| at(x + dx, y + dy)).count();
            assert_eq!(found.contains(x, y), count >= 5, "at {x}, {y}");
        }
        let whole = found.words().iter().map(|word| word.count_ones() as usize).sum::<usize>();
        assert_eq!(whole, found.area());
    }

    #[test]
    fn specks_go_and_holes_close_but_a_second_person_and_the_gap_below_an_arm_stay() {
        let mut silhouette = Silhouette::empty(400, 300);
        let mut fill = |[left, top, right, bottom]: [usize; 4], is_person: bool| {
            (top..bottom).for_each(|y| (left..right).for_each(|x| silhouette.set(x, y, is_person)));
        };
        fill([50, 20, 150, 280], true);
        fill([250, 20, 330, 280], true);
        fill([200, 100, 215, 115], true);
        fill([90, 50, 96, 56], false);
        fill([80, 100, 110, 160], false);
        let found = cleaned(&silhouette);
        assert!(found.contains(93, 53) && !found.contains(95, 130));
        assert!(found.contains(300, 100) && !found.contains(207, 107));
    }
}
