use model::Silhouette;
use nalgebra::{Vector2, Vector3};

use crate::{Edge, Topology, View};

/// A point of the rim of a mesh: where it turns away from the camera, at the outline of its silhouette.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RimPoint {
    /// the vertices at both ends of the edge it lies on; it is their midpoint
    pub vertices: [u32; 2],
    /// in the world, metres
    pub point: Vector3<f64>,
    /// of the surface, in the world, unit vector: the sum of both faces' normals weighted with their areas
    pub normal: Vector3<f64>,
    /// in the view, pixels of the view
    pub pixel: Vector2<f64>,
    /// away from the mesh in the image, unit vector at a right angle to the edge
    pub image_normal: Vector2<f64>,
    /// length of the edge in the image, pixels of the view: how much of the outline the point stands for (a rim
    /// that zigzags is longer than the outline)
    pub length: f64,
}

/// Finds the rim: midpoints of edges between a face that looks at the camera and one that doesn't, whose neighbour
/// `reach` pixels outwards is not a pixel of `silhouette`, the rendering of the same mesh in the same view. Points outside the
/// image are left out. What `rim` held is replaced.
///
/// Edges before another part of the body, or hidden behind one by more than `reach`, are not part of the outline and are not
/// found. One or two pixels of reach serve.
///
/// # Panics
/// If the number of vertices is not that of the topology.
pub fn find_rim(
    view: &View,
    vertices: &[Vector3<f64>],
    topology: &Topology,
    silhouette: &Silhouette,
    reach: f64,
    rim: &mut Vec<RimPoint>,
) {
    assert_eq!(vertices.len(), topology.num_vertices(), "vertices of the topology");
    rim.clear();
    let normal_of = |face: u32| {
        let [a, b, c] = topology.faces()[face as usize].map(|corner| vertices[corner as usize]);
        (b - a).cross(&(c - a))
    };
    let faces_camera = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|corner| vertices[corner as usize]);
        (b - a).cross(&(c - a)).dot(&(view.position - a)) > 0.0
    };
    let is_front: Vec<bool> = topology.faces().iter().map(faces_camera).collect();
    for edge in topology.edges() {
        let is_rim =
            edge.right == Edge::NONE || is_front[edge.left as usize] != is_front[edge.right as usize];
        if !is_rim {
            continue;
        }
        let [from, to] = edge.vertices.map(|vertex| vertices[vertex as usize]);
        let (Some((start, _)), Some((end, _))) = (view.project(&from), view.project(&to)) else { continue };
        let along = end - start;
        let length = along.norm();
        if length < 1e-9 {
            continue;
        }
        // what is left of the edge in space is left of it in the image if its face looks at the camera
        let mut image_normal = Vector2::new(-along.y, along.x) / length;
        if !is_front[edge.left as usize] {
            image_normal = -image_normal;
        }
        let pixel = (start + end) / 2.0;
        let [width, height] = view.size.map(|side| side as f64);
        let is_inside = pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x < width - 0.5 && pixel.y < height - 0.5;
        let outside = pixel + image_normal * reach;
        if !is_inside || silhouette.contains(outside.x.round() as isize, outside.y.round() as isize) {
            continue;
        }
        let mut normal = normal_of(edge.left);
        if edge.right != Edge::NONE {
            normal += normal_of(edge.right);
        }
        let Some(normal) = normal.try_normalize(0.0) else { continue };
        rim.push(RimPoint {
            vertices: edge.vertices,
            point: (from + to) / 2.0,
            normal,
            pixel,
            image_normal,
            length,
        });
    }
}
