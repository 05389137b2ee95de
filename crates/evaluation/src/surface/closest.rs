use model::Mesh;
use nalgebra::Vector3;
use vision::Topology;

use crate::{Error, Result};

/// A triangle mesh in which the point nearest to another point is found fast: a tree of boxes around its triangles.
#[derive(Debug, Clone)]
pub struct Surface {
    /// in the order of the leaves
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
}

/// The point of a surface that is nearest to another point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// where, metres
    pub point: Vector3<f64>,
    /// face of the mesh it lies in
    pub face: u32,
    /// weights of the face's corners, not negative, sum 1
    pub weights: [f64; 3],
    /// distance from the surface, metres: positive outside (the side that faces look at), negative inside. The sign is
    /// that of angle-weighted normals (Bærentzen and Aanæs 2005; docs/papers.md#other-sources)
    pub signed_m: f64,
}

#[derive(Debug, Clone)]
struct Triangle {
    corners: [Vector3<f64>; 3],
    face: u32,
    /// unit normal of the face
    normal: Vector3<f64>,
    /// of the sides from corner i to i + 1, not of unit length
    side_normals: [Vector3<f64>; 3],
    /// of the corners, not of unit length
    corner_normals: [Vector3<f64>; 3],
}

#[derive(Debug, Clone)]
struct Node {
    least: Vector3<f64>,
    most: Vector3<f64>,
    /// of a leaf: its first triangle; else the second child (the first comes right after the node)
    start: u32,
    /// triangles of a leaf, 0 if it isn't one
    count: u32,
}

/// Triangles of a leaf at most.
const LEAF: usize = 4;

impl Surface {
    /// The surface of a mesh. Faces without area are left out.
    ///
    /// # Errors
    /// [`Error::NoSurface`] if no face has an area.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = mesh.corners(face);
            (b - a).cross(&(c - a)).try_normalize(1e-18)
        };
        let normals: Vec<_> = mesh.faces.iter().map(normal).collect();
        let mut corner_normals = vec![Vector3::zeros(); mesh.vertices.len()];
        for (face, normal) in mesh.faces.iter().zip(&normals) {
            let Some(normal) = normal else { continue };
            let corners = mesh.corners(face);
            for i in 0..3 {
                let (to_next, to_last) =
                    (corners[(i + 1) % 3] - corners[i], corners[(i + 2) % 3] - corners[i]);
                corner_normals[face[i] as usize] += normal * to_next.angle(&to_last);
            }
        }
        let mut triangles = Vec::with_capacity(mesh.faces.len());
        let mut place = vec![None; mesh.faces.len()];
        for (index, (face, normal)) in mesh.faces.iter().zip(&normals).enumerate() {
            let Some(normal) = *normal else { continue };
            place[index] = Some(triangles.len());
            triangles.push(Triangle {
                corners: mesh.corners(face),
                face: index as u32,
                normal,
                side_normals: [normal; 3],
                corner_normals: face.map(|corner| corner_normals[corner as usize]),
            });
        }
        if triangles.is_empty() {
            return Err(Error::NoSurface { faces: mesh.faces.len(), area_m2: 0.0 });
        }
        for edge in Topology::new(&mesh.faces, mesh.vertices.len()).edges() {
            let at = |face: u32| place.get(face as usize).copied().flatten();
            let (Some(left), Some(right)) = (at(edge.left), at(edge.right)) else { continue };
            let sum = triangles[left].normal + triangles[right].normal;
            for (triangle, from) in [(left, edge.vertices[0]), (right, edge.vertices[1])] {
                let face = mesh.faces[triangles[triangle].face as usize];
                if let Some(side) = face.iter().position(|&corner| corner == from) {
                    triangles[triangle].side_normals[side] = sum;
                }
            }
        }
        let mut nodes = Vec::with_capacity(triangles.len());
        build(&mut triangles, 0, &mut nodes);
        Ok(Self { triangles, nodes })
    }

    /// The point of the surface that is nearest to a point.
    pub fn closest(&self, point: &Vector3<f64>) -> Closest {
        let mut best = (f64::INFINITY, 0, [1.0, 0.0, 0.0]);
        let mut stack = [(0u32, 0.0); 64];
        let mut depth = 1;
        stack[0] = (0, self.nodes[0].squared_distance(point));
        while depth > 0 {
            depth -= 1;
            let (index, squared) = stack[depth];
            if squared >= best.0 {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for at in node.start..node.start + node.count {
                    let corners = &self.triangles[at as usize].corners;
                    let weights = nearest_weights(point, corners);
                    let squared = (blend(corners, weights) - point).norm_squared();
                    if squared < best.0 {
                        best = (squared, at as usize, weights);
                    }
                }
                continue;
            }
            let children = [index + 1, node.start]
                .map(|child| (child, self.nodes[child as usize].squared_distance(point)));
            // the nearer one is looked at first. The halves are balanced, so the stack is deep enough
            let [near, far] =
                if children[0].1 <= children[1].1 { children } else { [children[1], children[0]] };
            stack[depth] = far;
            stack[depth + 1] = near;
            depth += 2;
        }
        let (squared, at, weights) = best;
        let triangle = &self.triangles[at];
        let nearest = blend(&triangle.corners, weights);
        let side = triangle.normal_at(weights).dot(&(point - nearest));
        let distance = squared.sqrt();
        Closest {
            point: nearest,
            face: triangle.face,
            weights,
            signed_m: if side < 0.0 { -distance } else { distance },
        }
    }
}

fn blend(corners: &[Vector3<f64>; 3], weights: [f64; 3]) -> Vector3<f64> {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

impl Triangle {
    /// Normal of the part (inside, side or corner) that the point with these weights lies in.
    fn normal_at(&self, weights: [f64; 3]) -> Vector3<f64> {
        let zero = weights.map(|weight| weight == 0.0);
        for i in 0..3 {
            if zero[(i + 1) % 3] && zero[(i + 2) % 3] {
                return self.corner_normals[i];
            }
        }
        // the side from corner i to i + 1 is opposite corner i + 2
        (0..3).find(|i| zero[(i + 2) % 3]).map_or(self.normal, |i| self.side_normals[i])
    }
}

impl Node {
    fn squared_distance(&self, point: &Vector3<f64>) -> f64 {
        (self.least - point).sup(&(point - self.most)).sup(&Vector3::zeros()).norm_squared()
    }
}

/// Adds the node of these triangles, the first of which is number `first`, and all below it; sorts the triangles.
fn build(triangles: &mut [Triangle], first: u32, nodes: &mut Vec<Node>) {
    let mut least = Vector3::repeat(f64::INFINITY);
    let mut most = -least;
    for corner in triangles.iter().flat_map(|triangle| &triangle.corners) {
        least = least.inf(corner);
        most = most.sup(corner);
    }
    let index = nodes.len();
    nodes.push(Node { least, most, start: first, count: triangles.len() as u32 });
    if triangles.len() <= LEAF {
        return;
    }
    let axis = (most - least).imax();
    let middle = triangles.len() / 2;
    let key = |triangle: &Triangle| triangle.corners.iter().map(|corner| corner[axis]).sum::<f64>();
    triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.face.cmp(&b.face)));
    let (left, right) = triangles.split_at_mut(middle);
    build(left, first, nodes);
    let second = nodes.len() as u32;
    build(right, first + middle as u32, nodes);
    nodes[index].start = second;
    nodes[index].count = 0;
}

/// Weights of the corners of a triangle for its point nearest to `point`; exactly 0 for corners that have no part in it.
/// After Ericson 2005 (docs/papers.md#other-sources), section 5.1.5.
fn nearest_weights(point: &Vector3<f64>, [a, b, c]: &[Vector3<f64>; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let from_a = point - a;
    let (d1, d2) = (ab.dot(&from_a), ac.dot(&from_a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let from_b = point - b;
    let (d3, d4) = (ab.dot(&from_b), ac.dot(&from_b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let weight_c = d1 * d4 - d3 * d2;
    if weight_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let from_c = point - c;
    let (d5, d6) = (ab.dot(&from_c), ac.dot(&from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let weight_b = d5 * d2 - d1 * d6;
    if weight_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let weight_a = d3 * d6 - d5 * d4;
    if weight_a <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = weight_a + weight_b + weight_c;
    [weight_a / sum, weight_b / sum, weight_c / sum]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_is_right_next_to_sharp_edges_and_corners() {
        // a thin wedge: faces seen from a point near its edge may both look away from it
        let vertices = vec![
            Vector3::zeros(),
            Vector3::new(0.0, 0.0, 1.0),
            Vector3::new(1.0, 0.05, 0.5),
            Vector3::new(1.0, -0.05, 0.5),
        ];
        let mesh = Mesh::new(vertices, vec![[0, 1, 2], [1, 0, 3], [0, 2, 3], [2, 1, 3]]).unwrap();
        assert!(mesh.volume() > 0.0);
        let surface = Surface::new(&mesh).unwrap();
        for outside in [
            Vector3::new(-0.1, 0.2, 0.5),
            Vector3::new(-0.1, -0.002, 0.4),
            Vector3::new(-0.3, 0.1, -0.2),
            Vector3::new(1.2, 0.3, 0.5),
        ] {
            assert!(surface.closest(&outside).signed_m > 0.0, "{outside}");
        }
        let inside = surface.closest(&Vector3::new(0.7, 0.01, 0.5));
        assert!(inside.signed_m < 0.0 && inside.signed_m > -0.05);
    }

    #[test]
    fn a_mesh_without_area_is_refused() {
        let mesh = Mesh::new(vec![Vector3::zeros(); 3], vec![[0, 1, 2]]).unwrap();
        assert!(matches!(Surface::new(&mesh), Err(Error::NoSurface { faces: 1, .. })));
    }
}
