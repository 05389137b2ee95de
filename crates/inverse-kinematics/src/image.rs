use model::Camera;
use nalgebra::Vector3;

use crate::{Chain, Support};

/// One camera and what it saw.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageView {
    /// the camera
    pub camera: Camera,
    /// its silhouette, made ready
    pub support: Support,
}

/// The overlap h of a chain with images, and its gradient (docs/papers.md#image-constrained-inverse-kinematics, eq.
/// 5–8, changed).
///
/// h is the mean of the supports at samples spaced evenly along the projections of all segments, over all views. Segments
/// with an end behind a camera and samples beyond an image are left out of the mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// h in [−1, 1]; 0 where nothing is seen
    pub value: f64,
    /// derivative of h with respect to each point, a metre, shape `[points]`
    pub by_point: Vec<Vector3<f64>>,
    samples: usize,
    /// relative width of the support at each point
    widths: Vec<f64>,
}

impl Overlap {
    /// Memory for the chain's points; `samples` is the number of samples on a segment.
    pub fn new(chain: &Chain, samples: usize) -> Self {
        Self {
            value: 0.0,
            by_point: vec![Vector3::zeros(); chain.points.len()],
            samples,
            widths: chain.widths.clone(),
        }
    }

    /// Takes the overlap of the segments between `positions` (metres, shape `[points]`) with the views.
    pub fn update(&mut self, segments: &[[usize; 2]], positions: &[Vector3<f64>], views: &[ImageView]) {
        self.by_point.fill(Vector3::zeros());
        let (mut sum, mut count) = (0.0, 0usize);
        for view in views {
            for &[from, to] in segments {
                let ends = [from, to].map(|end| view.camera.project_with_jacobian(&positions[end]));
                let [Some((start, start_jacobian)), Some((end, end_jacobian))] = ends else { continue };
                let (mut by_start, mut by_end) = (nalgebra::Vector2::zeros(), nalgebra::Vector2::zeros());
                for sample in 0..self.samples {
                    let t = (sample as f64 + 0.5) / self.samples as f64;
                    let width = self.widths[from] * (1.0 - t) + self.widths[to] * t;
                    let seen = view.support.sample(start + (end - start) * t, width);
                    let Some((value, gradient)) = seen else { continue };
                    sum += value;
                    count += 1;
                    by_start += gradient * (1.0 - t);
                    by_end += gradient * t;
                }
                self.by_point[from] += start_jacobian.tr_mul(&by_start);
                self.by_point[to] += end_jacobian.tr_mul(&by_end);
            }
        }
        let scale = 1.0 / count.max(1) as f64;
        self.value = sum * scale;
        self.by_point.iter_mut().for_each(|gradient| *gradient *= scale);
    }

    /// Gradient of h with respect to the coordinates: that by points times the kinematic Jacobian (row-major, shape
    /// `[3·points, dofs]`). `out` has shape `[dofs]`.
    pub fn gradient(&self, jacobian: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let rows = jacobian.chunks_exact(out.len());
        let weights = self.by_point.iter().flat_map(|gradient| [gradient.x, gradient.y, gradient.z]);
        for (row, weight) in rows.zip(weights) {
            if weight != 0.0 {
                dense::add_scaled(out, weight, row);
            }
        }
    }
}
