use model::Silhouette;
use nalgebra::Vector3;

use super::{HullView, cube::Cube};
use crate::{DistanceField, View, raster::set_span, reduced};

/// What one view tells about places in space.
#[derive(Debug, Clone)]
pub(super) struct Cone {
    pub view: View,
    field: DistanceField,
    /// box around the silhouette, pixels
    pub bounds: [usize; 4],
    /// the silhouette touches the border of its image
    is_cut: bool,
    /// the silhouette and its view with fewer pixels
    pub small: Silhouette,
    small_view: View,
}

/// Pixels of the image along a side of one of the small silhouette.
const SMALL: usize = 4;

/// What a view tells about a ball.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// all of it is seen as background
    Outside,
    /// all of it is seen as the person
    Inside,
    /// neither, or not known
    Mixed,
}

impl Cone {
    pub fn new(view: &HullView<'_>) -> Self {
        let [width, height] = [view.silhouette.width(), view.silhouette.height()];
        let bounds = view.silhouette.bounds().unwrap_or_default();
        let [left, top, right, bottom] = bounds;
        Self {
            view: View::new(view.camera),
            field: DistanceField::new(view.silhouette, 1),
            bounds,
            is_cut: left == 0 || top == 0 || right == width || bottom == height,
            small: reduced(view.silhouette, SMALL),
            small_view: View::reduced(view.camera, SMALL),
        }
    }

    /// How far inside the cone a place is, metres at its depth, negative outside; and pixels a metre there. `None` for places
    /// that have no pixel.
    #[inline]
    fn depth_inside(&self, place: &Vector3<f64>) -> Option<(f64, f64)> {
        let (mut pixel, depth) = self.view.project(place)?;
        if self.is_cut {
            for axis in 0..2 {
                pixel[axis] = pixel[axis].clamp(0.0, self.view.size[axis] as f64 - 1.0);
            }
        }
        let pixels_a_metre = self.view.camera.focal.mean() / depth;
        Some((self.field.sample(pixel) / pixels_a_metre, pixels_a_metre))
    }

    /// How far inside the cone a place is, metres, negative outside.
    #[inline]
    pub fn inside_m(&self, place: &Vector3<f64>) -> f64 {
        self.depth_inside(place).map_or(-1.0, |(inside, _)| inside)
    }

    /// What the view tells about all places at most `radius` metres from `centre`, on the safe side.
    pub fn judge(&self, centre: &Vector3<f64>, radius: f64) -> Verdict {
        let Some((inside, pixels_a_metre)) = self.depth_inside(centre) else { return Verdict::Mixed };
        let camera = &self.view.camera;
        let from_camera = (centre - self.view.position).norm();
        let depth = camera.focal.mean() / pixels_a_metre;
        if depth <= 1.01 * radius {
            return Verdict::Mixed;
        }
        // a step of length r moves x / z by at most r sqrt(1 + (x/z)²) / (z - r), and from_camera is z sqrt(1 + (x/z)²);
        // a lens stretches that; the field between pixels is within a pixel of the true distance
        let lens = if camera.distortion.is_zero() { 1.0 } else { 1.5 };
        let reach = camera.focal.max() * lens * radius * (from_camera / depth) / (depth - radius) + 1.0;
        let inside_px = inside * pixels_a_metre;
        if inside_px < -reach {
            Verdict::Outside
        } else if inside_px > reach {
            Verdict::Inside
        } else {
            Verdict::Mixed
        }
    }
    /// Sets the box of pixels around a cube in an image of the size of the small silhouette.
    pub fn fill_small(&self, cube: &Cube, image: &mut Silhouette) {
        let Some((pixel, depth)) = self.small_view.project(&cube.centre) else { return };
        let reach = cube.half * 3f64.sqrt() * self.small_view.camera.focal.max() / depth;
        let [width, height] = self.small_view.size;
        let range = |middle: f64, size: usize| {
            let first = (middle - reach).ceil().max(0.0) as usize;
            first..((middle + reach).floor() + 1.0).clamp(0.0, size as f64) as usize
        };
        let (columns, rows) = (range(pixel.x, width), range(pixel.y, height));
        if !columns.is_empty() {
            rows.for_each(|y| set_span(image.row_mut(y), columns.start, columns.end));
        }
    }
}
