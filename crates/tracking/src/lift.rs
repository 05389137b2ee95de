//! Points that one camera saw before, on the surface of the body as it was tracked then.

use std::collections::VecDeque;

use body::{BodyModel, Limb, Posed, Shape};
use model::PointMatch;
use nalgebra::Vector3;
use rayon::prelude::*;
use vision::{DepthBuffer, Topology, View, reduced_pixel};

use crate::{Misalignment, ObservedFrame, observed_frame::ObservedView};

/// Frames that are remembered: matches may lead back so far.
const REMEMBERED: usize = 16;
/// A surface that is seen more slantingly than this cosine says little about where the point is.
const LEAST_COSINE: f64 = 0.25;
/// So many points of a limb in a view count in full; more share their weight, for what the body can't express shifts all of them
/// alike.
const POINTS_A_LIMB: f64 = 8.0;

/// A point of the skin, and the ray on which it is seen now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// corners of the face that it lies in
    pub vertices: [u32; 3],
    /// barycentric, sum 1
    pub weights: [f64; 3],
    /// where the ray begins: position of the camera, metres
    pub origin: Vector3<f64>,
    /// direction of the ray, unit vector: d of the Plücker line, whose moment l is origin × d
    pub direction: Vector3<f64>,
    /// weight among the points of its limb in its view, less for points of long ago, in (0, 1]
    pub share: f64,
}

/// A frame that was tracked.
#[derive(Debug, Clone)]
struct Past {
    frame: usize,
    pose: Vec<f64>,
    misaligned: Vec<Limb>,
}

/// Remembers poses and lifts matches to them.
#[derive(Debug, Default)]
pub struct Lifter {
    past: VecDeque<Past>,
    posed: Posed,
    depths: Vec<DepthBuffer>,
}

impl Lifter {
    /// Remembers how a frame was tracked.
    pub fn remember(&mut self, frame: usize, pose: &[f64], misalignment: &Misalignment) {
        // a frame that is tracked again
        self.past.retain(|past| past.frame != frame);
        if self.past.len() == REMEMBERED {
            self.past.pop_front();
        }
        let misaligned = misalignment.misaligned().collect();
        self.past.push_back(Past { frame, pose: pose.to_vec(), misaligned });
    }

    /// Forgets all frames.
    pub fn forget(&mut self) {
        self.past.clear();
    }

    /// The points of every view's matches, in their order; shape `[views]`. Left out are matches that lead to a frame that isn't
    /// remembered, beside the body, to a limb that was misaligned then, or to a surface seen slantingly.
    pub fn lift(
        &mut self,
        model: &BodyModel,
        topology: &Topology,
        shape: &Shape,
        frame: &ObservedFrame,
    ) -> Vec<Vec<SurfacePoint>> {
        let mut points = vec![Vec::new(); frame.views.len()];
        if frame.views.iter().all(|view| view.matches.is_empty()) {
            return points;
        }
        self.depths.resize_with(frame.views.len().max(self.depths.len()), DepthBuffer::new);
        for past in self.past.iter().rev() {
            let is_of =
                |found: &&PointMatch| past.frame.checked_add(found.frames_back as usize) == Some(frame.index);
            if !frame.views.iter().any(|view| view.matches.iter().any(|found| is_of(&found))) {
                continue;
            }
            shape.pose(model, &past.pose, &mut self.posed);
            let vertices = &self.posed.vertices;
            let jobs = frame.views.par_iter().zip(&mut points).zip(&mut self.depths);
            jobs.for_each(|((view, points), depths)| {
                let reduced = &view.observation.levels[1].view;
                if view.matches.iter().any(|found| is_of(&found)) {
                    depths.draw(reduced, vertices, topology);
                }
                let scene = Scene { view, reduced, depths, vertices, faces: topology.faces() };
                for found in view.matches.iter().filter(is_of) {
                    let point = scene.lift(found);
                    let limb = |point: &SurfacePoint| model.limbs()[point.vertices[0] as usize];
                    points.extend(point.filter(|point| !past.misaligned.contains(&limb(point))));
                }
            });
        }
        points.iter_mut().for_each(|points| share(model, points));
        points
    }
}

/// Points of a limb together weigh no more than [`POINTS_A_LIMB`].
fn share(model: &BodyModel, points: &mut [SurfacePoint]) {
    let limb = |point: &SurfacePoint| {
        let limb = model.limbs()[point.vertices[0] as usize];
        Limb::ALL.iter().position(|other| *other == limb).unwrap_or_default()
    };
    let mut counts = [0.0f64; Limb::ALL.len()];
    points.iter().for_each(|point| counts[limb(point)] += 1.0);
    points.iter_mut().for_each(|point| point.share *= (POINTS_A_LIMB / counts[limb(point)]).min(1.0));
}

/// A posed body as a camera saw it.
struct Scene<'a> {
    view: &'a ObservedView,
    /// in which the depths are drawn
    reduced: &'a View,
    depths: &'a DepthBuffer,
    vertices: &'a [Vector3<f64>],
    faces: &'a [[u32; 3]],
}

impl Scene<'_> {
    /// The point of the surface that is seen at the match's earlier pixel, with its ray of now.
    fn lift(&self, found: &PointMatch) -> Option<SurfacePoint> {
        let camera = &self.view.observation.camera;
        if !found.before.iter().chain(&found.now).all(|x| x.is_finite()) {
            return None;
        }
        let (before, direction) = (camera.ray(found.before)?, camera.ray(found.now)?);
        let origin = self.reduced.position;
        let at = reduced_pixel(found.before, self.reduced.scale);
        let (x, y) = (at.x.round() as isize, at.y.round() as isize);
        // at lower resolution the face is that of the pixel or of a neighbour
        let around =
            (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x.saturating_add(dx), y.saturating_add(dy))));
        // what was wrong with the pose then, and what changed since, grow with time
        let share = 1.0 / f64::from(found.frames_back.max(1));
        let mut nearest: Option<(f64, SurfacePoint)> = None;
        for face in around.filter_map(|(x, y)| self.depths.face(x, y)) {
            let vertices = self.faces[face as usize];
            let corners = vertices.map(|vertex| self.vertices[vertex as usize]);
            let Some((distance, weights)) = crossing(&origin, &before, &corners) else { continue };
            if nearest.as_ref().is_none_or(|(least, _)| distance < *least) {
                nearest = Some((distance, SurfacePoint { vertices, weights, origin, direction, share }));
            }
        }
        nearest.map(|(_, point)| point)
    }
}

/// Where a ray meets a triangle from its front: distance and barycentric coordinates (Möller and Trumbore 1997;
/// docs/papers.md#other-sources); `None` if it doesn't, or too slantingly.
fn crossing(
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
    [a, b, c]: &[Vector3<f64>; 3],
) -> Option<(f64, [f64; 3])> {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(&ac);
    let facing = -normal.dot(direction);
    // false for slivers without a normal as well
    let is_seen = facing > LEAST_COSINE * normal.norm();
    if !is_seen {
        return None;
    }
    let from = origin - a;
    let turned = direction.cross(&from);
    let (v, w) = (-ac.dot(&turned) / facing, ab.dot(&turned) / facing);
    let distance = from.dot(&normal) / facing;
    // neighbours overlap by rounding, so that no ray passes between them
    let rounding = -1e-9;
    let is_inside = v >= rounding && w >= rounding && v + w <= 1.0 - rounding && distance > 0.0;
    is_inside.then_some((distance, [1.0 - v - w, v, w]))
}

#[cfg(test)]
mod tests {
    use vision::scene::{Ring, silhouettes};

    use super::*;

    #[test]
    fn a_ray_meets_the_point_of_the_triangle_that_it_was_drawn_through() {
        let corners = [Vector3::new(0.1, 0.2, 2.0), Vector3::new(0.4, 0.3, 2.2), Vector3::new(0.2, 0.9, 1.9)];
        let origin = Vector3::new(0.3, 0.3, 5.0);
        let weights = [0.2, 0.5, 0.3];
        let point: Vector3<f64> = corners.iter().zip(weights).map(|(corner, weight)| corner * weight).sum();
        let direction = (point - origin).normalize();
        let (distance, found) = crossing(&origin, &direction, &corners).unwrap();
        assert!((distance - (point - origin).norm()).abs() < 1e-12);
        assert!(found.iter().zip(weights).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        // from behind, and beside it
        let [a, b, c] = corners;
        assert_eq!(crossing(&origin, &direction, &[a, c, b]), None);
        assert_eq!(crossing(&origin, &Vector3::new(0.3, 0.0, -1.0).normalize(), &corners), None);
    }

    #[test]
    fn matches_are_lifted_to_the_surface_that_was_seen() {
        let model = BodyModel::shipped();
        let (topology, shape) = (Topology::new(model.faces(), model.num_vertices()), model.shape(&[]));
        let pose = vec![0.0; model.rig().num_dofs()];
        let mut posed = Posed::default();
        shape.pose(&model, &pose, &mut posed);
        let mut cameras = Ring { cameras: 2, size: 502, focal: 663.0, ..Ring::default() }.cameras();
        cameras[1].distortion.k1 = -0.1;
        let mesh = model::Mesh::new(posed.vertices.clone(), model.faces().to_vec()).unwrap();
        let views: Vec<_> = cameras.iter().cloned().zip(silhouettes(&mesh, &cameras)).collect();
        // vertices that face the camera, where it sees them
        let normals = mesh.normals();
        let seen = |camera: &model::Camera| -> Vec<(u32, PointMatch)> {
            let mut depths = DepthBuffer::new();
            let view = View::new(camera);
            depths.draw(&view, &mesh.vertices, &topology);
            let vertices = (0..mesh.vertices.len()).step_by(37).filter(|&vertex| {
                let point = mesh.vertices[vertex];
                let to_camera = (camera.position() - point).normalize();
                normals[vertex].dot(&to_camera) > 0.6 && depths.sees(&view, &point, 0.002)
            });
            let pixel = |vertex: usize| camera.project(&mesh.vertices[vertex]).unwrap();
            let at = |vertex: usize| PointMatch { frames_back: 2, before: pixel(vertex), now: pixel(vertex) };
            vertices.map(|vertex| (vertex as u32, at(vertex))).collect()
        };
        let mut lifter = Lifter::default();
        let right = Misalignment::from_errors([0.0; 10], 1.0);
        lifter.remember(5, &pose, &right);
        for (index, camera) in cameras.iter().enumerate() {
            let seen = seen(camera);
            assert!(seen.len() > 20);
            let matches: Vec<_> = seen.iter().map(|(_, found)| *found).collect();
            let frame = ObservedFrame::new(7, &views).unwrap().with_matches(index, &matches);
            let points = lifter.lift(&model, &topology, &shape, &frame).swap_remove(index);
            let lifted = points.len() as f64 / seen.len() as f64;
            assert!(lifted > 0.95, "{lifted} of the points in view {index}");
            for point in &points {
                let corners = point.vertices.iter().zip(point.weights);
                let on_skin: Vector3<f64> =
                    corners.map(|(&i, weight)| posed.vertices[i as usize] * weight).sum();
                let off = (on_skin - point.origin).cross(&point.direction).norm();
                assert!(off < 1e-9, "{off} m off the ray");
                assert!(point.share > 0.0 && point.share <= 1.0);
            }
            // no such frame, a limb that was wrong, no numbers
            let other = ObservedFrame::new(8, &views).unwrap().with_matches(index, &matches);
            assert!(lifter.lift(&model, &topology, &shape, &other)[index].is_empty());
            let wrong = Misalignment::from_errors([1.0; 10], 0.1);
            let mut misled = Lifter::default();
            misled.remember(5, &pose, &wrong);
            assert!(misled.lift(&model, &topology, &shape, &frame)[index].is_empty());
            let odd = PointMatch { before: nalgebra::Vector2::repeat(f64::NAN), ..matches[0] };
            let far = PointMatch { before: nalgebra::Vector2::repeat(1e300), ..matches[0] };
            let frame = ObservedFrame::new(7, &views).unwrap().with_matches(index, &[odd, far]);
            assert!(lifter.lift(&model, &topology, &shape, &frame)[index].is_empty());
        }
    }
}
