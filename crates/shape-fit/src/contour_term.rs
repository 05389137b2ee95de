//! The energy of one view: squared distances between the model's rim and the image's contours, robust, both ways.
//!
//! A pair of rim point u and contour point c with normal n has the residual n · (u − c), and a share of the distance along
//! the contour, in metres at the point's depth. Its weight is that of Geman and McClure, `ρ(s) = s² σ² / (s² + σ²)`. All pairs
//! of one rim point are gathered into a 2 × 2 matrix before its derivative is taken, so that the work is that of the rim.

use body::{BodyModel, Posed, Shape, ShapeDrift};
use model::Silhouette;
use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};
use vision::{Rasteriser, RimPoint, Topology, find_rim};

use crate::{
    Options,
    match_outlines::{Matches, NONE},
    observation::Level,
};

/// How the distances are weighted: from coarse to fine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighting {
    /// σ of the robust weight, metres
    pub scale_m: f64,
    /// weight of distances along the contour beside those across it
    pub tangential: f64,
    /// opposite normals count as twice this distance, metres
    pub normal_m: f64,
}

/// A body in a pose, with what its derivatives need.
#[derive(Debug, Clone, Default)]
pub struct PosedBody {
    /// the body at rest; without one there are no derivatives
    pub shape: Option<Shape>,
    /// the body in its pose, all vertices
    pub posed: Posed,
    /// how bones shift with the shape; only looked at for derivatives with respect to the shape
    pub drift: ShapeDrift,
}

impl PosedBody {
    /// Poses the body; the drift stays as it was.
    ///
    /// # Panics
    /// As [`Shape::pose`].
    pub fn pose(&mut self, model: &BodyModel, pose: &[f64]) {
        if let Some(shape) = &self.shape {
            shape.pose(model, pose, &mut self.posed);
        }
    }
}

/// Half a quadratic energy: `½ xᵀ H x + gᵀ x` with half its value.
#[derive(Debug, Clone)]
pub struct Quadratic {
    /// JᵀJ and, in the last column, Jᵀr, row-major, shape `[n + 1, n + 1]`
    pub product: Vec<f64>,
    /// robust energy
    pub energy: f64,
}

/// Buffers of one thread.
#[derive(Debug, Default)]
pub struct Scratch {
    rasteriser: Rasteriser,
    drawn: Option<Silhouette>,
    rim: Vec<RimPoint>,
    matches: Matches,
    /// information and gradient of every rim point
    gathered: Vec<(Matrix2<f64>, Vector2<f64>)>,
    rows: Vec<f64>,
    derivatives: Vec<Vector3<f64>>,
    block: Vec<f64>,
}

/// Points of the rim whose derivatives are held at a time.
const BLOCK: usize = 64;
/// How far a point just outside the rim is looked at, pixels.
const REACH_PX: f64 = 1.5;

/// What all views share.
#[derive(Clone, Copy)]
pub struct Term<'a> {
    /// whose body it is
    pub model: &'a BodyModel,
    /// of the model's faces
    pub topology: &'a Topology,
    /// in the pose at which the energy is wanted
    pub body: &'a PosedBody,
    /// how distances count
    pub weighting: Weighting,
    /// coefficients of the shape with respect to which derivatives are taken, after those of the pose: 0 for a shape that
    /// is known
    pub components: usize,
    /// what the silhouettes are worth
    pub options: &'a Options,
}

impl Term<'_> {
    /// Energy and derivatives of a view with respect to pose and shape; pairs are made anew.
    pub fn evaluate(&self, level: &Level, scratch: &mut Scratch) -> Quadratic {
        let energy = self.gather(level, scratch);
        let width = self.model.rig().num_dofs() + self.components;
        let columns = width + 1;
        let mut product = vec![0.0; columns * columns];
        scratch.block.resize(columns * columns, 0.0);
        scratch.derivatives.resize(2 * width, Vector3::zeros());
        for start in (0..scratch.rim.len()).step_by(BLOCK) {
            scratch.rows.clear();
            for i in start..(start + BLOCK).min(scratch.rim.len()) {
                self.push_rows(level, scratch, i);
            }
            dense::self_product(&scratch.rows, columns, &mut scratch.block);
            product.iter_mut().zip(&scratch.block).for_each(|(sum, x)| *sum += x);
        }
        Quadratic { product, energy }
    }

    /// Finds the rim and its pairs; information and gradient of each rim point in the image.
    fn gather(&self, level: &Level, scratch: &mut Scratch) -> f64 {
        let Level { view, outline } = level;
        let vertices = &self.body.posed.vertices;
        let drawn = scratch.drawn.get_or_insert_with(|| Silhouette::empty(0, 0));
        scratch.rasteriser.silhouette(view, vertices, self.topology, drawn);
        find_rim(view, vertices, self.topology, drawn, REACH_PX, &mut scratch.rim);
        let rim = &scratch.rim;
        let focal = view.camera.focal.mean();
        let depth = |point: &Vector3<f64>| (point - view.position).dot(&view.camera.direction());
        let mean_depth = rim.iter().map(|p| depth(&p.point)).sum::<f64>() / rim.len().max(1) as f64;
        let metres = if rim.is_empty() { 3.0 / focal } else { mean_depth / focal };
        let Weighting { scale_m, tangential, normal_m } = self.weighting;
        scratch.matches.find(rim, outline, normal_m / metres);
        // both directions tell the same thing twice, so each counts half
        let pixel_m = 0.3 * metres / view.scale as f64;
        let sigma2 = self.options.sigma_m.powi(2) + pixel_m * pixel_m + (0.15 * scale_m).powi(2);
        let per_px = metres / (2.0 * self.options.correlation_m * sigma2);
        let outline_px = outline.step_px * outline.pixels.len() as f64;
        let rim_px: f64 = rim.iter().map(|point| point.length).sum();
        let rim_share = if rim_px > 0.0 { outline_px / rim_px } else { 0.0 };
        scratch.gathered.clear();
        scratch.gathered.resize(rim.len(), (Matrix2::zeros(), Vector2::zeros()));
        let mut energy = 0.0;
        let mut add = |i: u32, at: u32, weight: f64| {
            let most = weight * scale_m * scale_m;
            if i == NONE || at == NONE {
                energy += most;
                return;
            }
            let (i, at) = (i as usize, at as usize);
            let normal = outline.normals[at];
            if normal.dot(&rim[i].image_normal) < 0.0 {
                energy += most;
                return;
            }
            let miss = (rim[i].pixel - outline.pixels[at]) * metres;
            let across = normal * normal.transpose();
            let metric = across + (Matrix2::identity() - across) * tangential;
            let squared = miss.dot(&(metric * miss));
            let robust = scale_m * scale_m / (squared + scale_m * scale_m);
            energy += weight * squared * robust;
            let weight = weight * robust * robust;
            let (information, gradient) = &mut scratch.gathered[i];
            *information += metric * (weight * metres * metres);
            *gradient += metric * miss * (weight * metres);
        };
        for (i, point) in rim.iter().enumerate() {
            add(i as u32, scratch.matches.by_rim[i], point.length * rim_share * per_px);
        }
        for (at, &i) in scratch.matches.by_outline.iter().enumerate() {
            add(i, at as u32, outline.step_px * per_px);
        }
        energy
    }

    /// Two rows whose squares are the energy of a rim point, linearised: `Lᵀ J` and `L⁻¹ g` for information `L Lᵀ`.
    fn push_rows(&self, level: &Level, scratch: &mut Scratch, i: usize) {
        let (mut information, gradient) = scratch.gathered[i];
        let trace = information.trace();
        if trace.is_nan() || trace <= 0.0 {
            return;
        }
        information += Matrix2::identity() * (1e-9 * trace);
        let point = &scratch.rim[i];
        let Some((_, pixel_by_point)) = level.view.camera.project_with_jacobian(&point.point) else { return };
        let Some(factor) = information.cholesky() else { return };
        let lower = factor.l();
        let Some(residual) = lower.solve_lower_triangular(&gradient) else { return };
        self.differentiate(point.vertices, &mut scratch.derivatives);
        let by_point: Matrix2x3<f64> = lower.transpose() * pixel_by_point;
        let width = scratch.derivatives.len() / 2;
        for row in 0..2 {
            let along = by_point.row(row).transpose();
            let both_ends = scratch.derivatives[..width].iter().zip(&scratch.derivatives[width..]);
            scratch.rows.extend(both_ends.map(|(from, to)| 0.5 * along.dot(&(from + to))));
            scratch.rows.push(residual[row]);
        }
    }

    /// Derivatives of two vertices with respect to pose and shape, one after the other.
    fn differentiate(&self, vertices: [u32; 2], out: &mut [Vector3<f64>]) {
        let Some(shape) = &self.body.shape else { return };
        let dofs = self.model.rig().num_dofs();
        let width = out.len() / 2;
        for (vertex, out) in vertices.into_iter().zip(out.chunks_exact_mut(width)) {
            let (by_pose, by_shape) = out.split_at_mut(dofs);
            self.body.posed.vertex_by_pose(self.model, shape, vertex as usize, by_pose);
            if !by_shape.is_empty() {
                self.body.posed.vertex_by_shape(self.model, &self.body.drift, vertex as usize, by_shape);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use kinematics::check_jacobian;
    use model::Camera;
    use vision::{View, scene::Ring};

    use super::*;

    fn posed(model: &BodyModel, x: &[f64]) -> PosedBody {
        let (pose, alpha) = x.split_at(model.rig().num_dofs());
        let shape = model.shape(alpha);
        let mut body = PosedBody::default();
        shape.pose(model, pose, &mut body.posed);
        body.drift.update(model, &body.posed);
        body.shape = Some(shape);
        body
    }

    #[test]
    fn the_derivative_of_a_rim_point_in_the_image_is_that_of_differences() {
        let model = BodyModel::shipped();
        let width = model.rig().num_dofs() + model.num_components();
        let x: Vec<f64> = (0..width).map(|i| 0.4 * (i as f64 * 1.7).sin()).collect();
        let topology = Topology::new(model.faces(), model.num_vertices());
        let camera: Camera = Ring::default().cameras().swap_remove(1);
        let view = View::new(&camera);
        let body = posed(&model, &x);
        let mut drawn = Silhouette::empty(0, 0);
        Rasteriser::new().silhouette(&view, &body.posed.vertices, &topology, &mut drawn);
        let mut rim = Vec::new();
        find_rim(&view, &body.posed.vertices, &topology, &drawn, REACH_PX, &mut rim);
        assert!(rim.len() > 200, "{} points", rim.len());
        let weighting = Weighting { scale_m: 0.1, tangential: 0.1, normal_m: 0.1 };
        let term = Term {
            model: &model,
            topology: &topology,
            body: &body,
            weighting,
            components: model.num_components(),
            options: &Options::default(),
        };
        let chosen: Vec<&RimPoint> = rim.iter().step_by(rim.len() / 12).collect();
        let mut jacobian = Vec::new();
        let mut derivatives = vec![Vector3::zeros(); 2 * width];
        for point in &chosen {
            let (_, by_point) = camera.project_with_jacobian(&point.point).unwrap();
            term.differentiate(point.vertices, &mut derivatives);
            for axis in 0..2 {
                let along = by_point.row(axis).transpose();
                let both_ends = derivatives[..width].iter().zip(&derivatives[width..]);
                jacobian.extend(both_ends.map(|(from, to)| 0.5 * along.dot(&(from + to))));
            }
        }
        check_jacobian(&x, 2 * chosen.len(), &jacobian, 1e-4, |x, pixels| {
            let vertices = posed(&model, x).posed.vertices;
            for (point, pixel) in chosen.iter().zip(pixels.chunks_exact_mut(2)) {
                let [from, to] = point.vertices.map(|vertex| vertices[vertex as usize]);
                pixel.copy_from_slice(camera.project(&((from + to) / 2.0)).unwrap().as_slice());
            }
        })
        .unwrap();
    }
}
