use std::sync::Arc;

use model::{Camera, Silhouette};
use nalgebra::{Vector2, Vector3};
use vision::DistanceField;

/// How wide the slopes of an image support are, metres at the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportWidth {
    /// depth inside the silhouette from which on the support is 1: half the width of a limb. More than that and limbs in
    /// front of the trunk would be drawn to its middle.
    pub inside_m: f64,
    /// distance outside at which the support is −1
    pub outside_m: f64,
}

impl Default for SupportWidth {
    fn default() -> Self {
        Self { inside_m: 0.05, outside_m: 0.3 }
    }
}

/// The image support I_c (docs/papers.md#image-constrained-inverse-kinematics, eq. 5, changed): signed distance to
/// the outline of a silhouette, scaled to [−1, 1].
///
/// At distance d inside it is `s (2 − s)` with s = d / inside, at most 1: it rises at the outline and levels out in the
/// middle of a limb. Outside it is −d / outside, at least −1: a slope back into the body. What lies beyond the image has no
/// support: it says nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    field: Arc<DistanceField>,
    inside: f64,
    outside: f64,
}

impl Support {
    /// From the distances of a silhouette; `inside` and `outside` (pixels, positive) are the widths of the slopes.
    pub fn new(field: Arc<DistanceField>, inside: f64, outside: f64) -> Self {
        Self { field, inside, outside }
    }

    /// From a silhouette of a camera, with widths in metres as they are seen at `place` (metres, in the world).
    ///
    /// # Panics
    /// If the silhouette is wider or higher than 32,768 pixels.
    pub fn from_silhouette(
        silhouette: &Silhouette,
        camera: &Camera,
        place: &Vector3<f64>,
        width: SupportWidth,
    ) -> Self {
        Self::seen_at(Arc::new(DistanceField::new(silhouette, 1)), camera, place, width)
    }

    /// As [`from_silhouette`](Self::from_silhouette), from distances that several supports share.
    pub fn seen_at(
        field: Arc<DistanceField>,
        camera: &Camera,
        place: &Vector3<f64>,
        width: SupportWidth,
    ) -> Self {
        let depth = (camera.camera_from_world * nalgebra::Point3::from(*place)).z.max(0.1);
        let pixels_per_metre = 0.5 * (camera.focal.x + camera.focal.y) / depth;
        // less than a pixel would be a step, which has no slope
        let pixels = |metres: f64| (metres * pixels_per_metre).max(1.0);
        Self::new(field, pixels(width.inside_m), pixels(width.outside_m))
    }

    /// Value in [−1, 1] and its derivative, a pixel, at a position; `None` beyond the image. The slope inside is `width` times
    /// as wide as the support's, at least a pixel.
    #[inline]
    pub fn sample(&self, pixel: Vector2<f64>, width: f64) -> Option<(f64, Vector2<f64>)> {
        if !self.field.contains(pixel) {
            return None;
        }
        let (distance, gradient) = self.field.sample_with_gradient(pixel);
        let (value, slope) = if distance >= 0.0 {
            let inside = (width * self.inside).max(1.0);
            let s = (distance / inside).min(1.0);
            (s * (2.0 - s), 2.0 * (1.0 - s) / inside)
        } else if distance > -self.outside {
            (distance / self.outside, 1.0 / self.outside)
        } else {
            (-1.0, 0.0)
        };
        Some((value, gradient * slope))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Silhouette {
        let mut silhouette = Silhouette::empty(100, 80);
        for y in 20..60 {
            for x in 30..70 {
                silhouette.set(x, y, true);
            }
        }
        silhouette
    }

    #[test]
    fn the_support_lies_between_minus_one_and_one_and_is_zero_at_the_outline() {
        let support = Support::new(Arc::new(DistanceField::new(&square(), 1)), 8.0, 20.0);
        let at = |x: f64| support.sample(Vector2::new(x, 40.0), 1.0).unwrap().0;
        assert!((at(50.0) - 1.0).abs() < 1e-12);
        assert!(at(29.5).abs() < 1e-12);
        assert!((at(5.0) + 1.0).abs() < 1e-12);
        assert!(at(24.0) < at(27.0) && at(27.0) < 0.0 && 0.0 < at(32.0) && at(32.0) < at(35.0));
        assert_eq!(support.sample(Vector2::new(-3.0, 40.0), 1.0), None);
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let support = Support::new(Arc::new(DistanceField::new(&square(), 1)), 8.0, 20.0);
        for at in [Vector2::new(33.3, 41.7), Vector2::new(22.4, 35.3), Vector2::new(50.2, 30.3)] {
            let (_, gradient) = support.sample(at, 1.0).unwrap();
            for axis in 0..2 {
                let mut step = Vector2::zeros();
                step[axis] = 1e-6;
                let value = |at| support.sample(at, 1.0).unwrap().0;
                let slope = (value(at + step) - value(at - step)) / 2e-6;
                assert!((slope - gradient[axis]).abs() < 1e-6, "{slope} {} at {at}", gradient[axis]);
            }
        }
    }
}
