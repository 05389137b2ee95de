use model::Silhouette;
use nalgebra::Vector2;

/// The closed outline of a piece of a silhouette, or of a hole in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    /// points at equal distances along the outline; the person is on the right of their order as one sees the image
    pub points: Vec<ContourPoint>,
    /// length, pixels
    pub length: f64,
    /// true for the outline of a hole
    pub is_hole: bool,
}

/// A point of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContourPoint {
    /// where, pixels
    pub pixel: Vector2<f64>,
    /// away from the person, unit vector
    pub normal: Vector2<f64>,
    /// true where the image ends rather than the person
    pub is_border: bool,
}

/// How outlines are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContourOptions {
    /// standard deviation of the Gaussian that smooths the steps of the pixels away, pixels along the outline. A round limb
    /// of radius r is drawn too thin by smoothing² / 2r
    pub smoothing: f64,
    /// distance between points, pixels
    pub step: f64,
    /// shorter outlines are left out, pixels
    pub min_length: f64,
}

impl Default for ContourOptions {
    fn default() -> Self {
        Self { smoothing: 2.0, step: 2.0, min_length: 40.0 }
    }
}

/// Outlines of a silhouette, in the order of their topmost, then leftmost pixel.
///
/// They run through the midpoints between pixels of the person and of the background (marching squares; pixels that touch
/// at a corner are connected), are smoothed, and resampled by arc length.
pub fn contours(silhouette: &Silhouette, options: &ContourOptions) -> Vec<Contour> {
    let mut is_followed = Silhouette::empty(silhouette.width(), silhouette.height());
    let mut contours = Vec::new();
    for y in 0..silhouette.height() {
        for word in 0..silhouette.row(y).len() {
            let above = if y == 0 { 0 } else { silhouette.row(y - 1)[word] };
            let mut tops = silhouette.row(y)[word] & !above;
            while tops != 0 {
                let x = word * 64 + tops.trailing_zeros() as usize;
                tops &= tops - 1;
                if !is_followed.contains(x as isize, y as isize) {
                    let steps = follow(silhouette, x, y, &mut is_followed);
                    contours.extend(contour(&steps, options, silhouette));
                }
            }
        }
    }
    contours
}

/// A side of a pixel between person and background: its midpoint and the direction away from the person.
#[derive(Debug, Clone, Copy)]
struct Step {
    middle: Vector2<f64>,
    outward: [i32; 2],
}

/// Follows an outline from the upper side of pixel (x, y), the person on the right; marks all upper sides it passes.
fn follow(silhouette: &Silhouette, x: usize, y: usize, is_followed: &mut Silhouette) -> Vec<Step> {
    let contains = |[x, y]: [i32; 2]| silhouette.contains(x as isize, y as isize);
    let start = ([x as i32, y as i32], [1, 0]);
    let (mut pixel, mut direction) = start;
    let mut steps = Vec::new();
    loop {
        let [dx, dy] = direction;
        let outward = [dy, -dx];
        if dx == 1 {
            is_followed.set(pixel[0] as usize, pixel[1] as usize, true);
        }
        let middle = Vector2::new(
            f64::from(pixel[0]) + 0.5 * f64::from(outward[0]),
            f64::from(pixel[1]) + 0.5 * f64::from(outward[1]),
        );
        steps.push(Step { middle, outward });
        let ahead = [pixel[0] + dx, pixel[1] + dy];
        let ahead_left = [ahead[0] + outward[0], ahead[1] + outward[1]];
        (pixel, direction) = if contains(ahead_left) {
            (ahead_left, outward)
        } else if contains(ahead) {
            (ahead, direction)
        } else {
            (pixel, [-dy, dx])
        };
        if (pixel, direction) == start {
            return steps;
        }
    }
}

fn contour(steps: &[Step], options: &ContourOptions, silhouette: &Silhouette) -> Option<Contour> {
    if (steps.len() as f64) < options.min_length {
        return None;
    }
    // twice the area: positive if the person on the right is inside
    let twice_area: f64 = pairs(steps).map(|(a, b)| a.middle.perp(&b.middle)).sum();
    let is_border = |step: &Step| {
        let [x, y] = step.outward;
        let outside = step.middle + Vector2::new(f64::from(x), f64::from(y)) * 0.5;
        let [width, height] = [silhouette.width(), silhouette.height()].map(|side| side as f64);
        outside.x < 0.0 || outside.y < 0.0 || outside.x >= width || outside.y >= height
    };
    let smooth = smoothed(steps, options.smoothing);
    let mut lengths = Vec::with_capacity(smooth.len() + 1);
    let mut length = 0.0;
    for (a, b) in pairs(&smooth) {
        lengths.push(length);
        length += (b - a).norm();
    }
    let count = (length / options.step).round().max(3.0) as usize;
    let mut segment = 0;
    let points = (0..count).map(|i| {
        let at = length * i as f64 / count as f64;
        while segment + 1 < lengths.len() && lengths[segment + 1] <= at {
            segment += 1;
        }
        let (from, to) = (smooth[segment], smooth[(segment + 1) % smooth.len()]);
        let t = (at - lengths[segment]) / (to - from).norm().max(1e-12);
        let before = smooth[(segment + smooth.len() - 1) % smooth.len()];
        let after = smooth[(segment + 2) % smooth.len()];
        // tangents at both ends of the segment, blended
        let tangent = (to - before) * (1.0 - t) + (after - from) * t;
        ContourPoint {
            pixel: from + (to - from) * t.min(1.0),
            normal: Vector2::new(tangent.y, -tangent.x).try_normalize(1e-12).unwrap_or_else(Vector2::x),
            is_border: is_border(&steps[segment]),
        }
    });
    let points = points.collect();
    Some(Contour { points, length, is_hole: twice_area < 0.0 })
}

/// Every element of a closed line with the one after it.
fn pairs<T: Copy>(line: &[T]) -> impl Iterator<Item = (T, T)> + '_ {
    line.iter().copied().zip(line.iter().copied().cycle().skip(1))
}

/// The midpoints, each the mean of its neighbours along the line under a Gaussian.
fn smoothed(steps: &[Step], sigma: f64) -> Vec<Vector2<f64>> {
    // a step is 0.71 to 1 pixel long
    let radius = ((3.0 * sigma).ceil() as usize).min((steps.len() - 1) / 2);
    let weight = |i: usize| if i == 0 { 1.0 } else { (-0.5 * (i as f64 / sigma).powi(2)).exp() };
    let weights: Vec<_> = (0..=radius).map(weight).collect();
    let total = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    let count = steps.len();
    (0..count)
        .map(|i| {
            let mut sum = steps[i].middle;
            for (offset, weight) in weights.iter().enumerate().skip(1) {
                let (a, b) = ((i + count - offset) % count, (i + offset) % count);
                sum += (steps[a].middle + steps[b].middle) * *weight;
            }
            sum / total
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(radius: f64) -> Silhouette {
        let mut silhouette = Silhouette::empty(300, 280);
        for y in 0..280 {
            for x in 0..300 {
                let from_centre = Vector2::new(x as f64 - 150.3, y as f64 - 140.8);
                silhouette.set(x, y, from_centre.norm() <= radius);
            }
        }
        silhouette
    }

    #[test]
    fn the_outline_of_a_disc_is_a_circle_to_a_quarter_pixel() {
        let radius = 80.0;
        let options = ContourOptions::default();
        let found = contours(&disc(radius), &options);
        assert_eq!(found.len(), 1);
        assert!(!found[0].is_hole);
        let centre = Vector2::new(150.3, 140.8);
        let mut squares = 0.0;
        for point in &found[0].points {
            let from_centre = point.pixel - centre;
            let miss = from_centre.norm() - radius;
            assert!(miss.abs() < 0.5, "{miss} pixels off the circle");
            squares += miss * miss;
            assert!(point.normal.dot(&from_centre.normalize()) > 0.98 && !point.is_border);
        }
        let rms = (squares / found[0].points.len() as f64).sqrt();
        assert!(rms < 0.25, "{rms} pixels off the circle");
        assert!((found[0].length / (2.0 * std::f64::consts::PI * radius) - 1.0).abs() < 0.01);
        for (a, b) in pairs(&found[0].points) {
            assert!(((b.pixel - a.pixel).norm() - options.step).abs() < 0.1);
        }
    }

    #[test]
    fn holes_and_the_border_of_the_image_are_marked() {
        let mut silhouette = Silhouette::empty(100, 100);
        for y in 20..80 {
            for x in 0..70 {
                silhouette.set(x, y, !(30..50).contains(&x) || !(40..60).contains(&y));
            }
        }
        let found = contours(&silhouette, &ContourOptions::default());
        assert_eq!(found.iter().map(|contour| contour.is_hole).collect::<Vec<_>>(), [false, true]);
        let on_border = found[0].points.iter().filter(|point| point.is_border).count();
        assert!((28..=32).contains(&on_border), "{on_border} of 60 pixels at steps of two");
        // away from the person: into the hole
        assert!(found[1].points.iter().all(|p| p.normal.dot(&(Vector2::new(39.5, 49.5) - p.pixel)) > 0.0));
    }

    #[test]
    fn pixels_that_touch_at_a_corner_have_one_outline() {
        let mut silhouette = Silhouette::empty(40, 40);
        for i in 0..10 {
            for j in 0..10 {
                silhouette.set(10 + i, 10 + j, true);
                silhouette.set(20 + i, 20 + j, true);
            }
        }
        let found = contours(&silhouette, &ContourOptions::default());
        assert_eq!(found.len(), 1);
    }
}
