//! Surface where a field passes zero: marching cubes (Lorensen and Cline 1987; docs/papers.md#other-sources).
//! The triangles of each of the 256 cases are derived from rules for the faces of a cell rather than from a table, so that
//! cells that share a face always agree and the surface is closed.

use std::sync::LazyLock;

use model::Mesh;
use nalgebra::Vector3;

use super::field::Field;

/// The edges of a cell: corner i has x = bit 0, y = bit 1 and z = bit 2 of i; an edge goes from its lower corner along an
/// axis.
const EDGES: [(usize, usize); 12] =
    [(0, 0), (2, 0), (4, 0), (6, 0), (0, 1), (1, 1), (4, 1), (5, 1), (0, 2), (1, 2), (2, 2), (3, 2)];

/// For each set of corners inside (bits): triangles of edges, seen from outside counter-clockwise.
static CASES: LazyLock<Vec<Vec<[u8; 3]>>> = LazyLock::new(|| (0..256).map(triangles_of).collect());

fn edge_between(a: usize, b: usize) -> usize {
    let axis = (a ^ b).trailing_zeros() as usize;
    EDGES.iter().position(|&edge| edge == (a.min(b), axis)).unwrap_or_default()
}

/// On each face, the surface cuts every run of corners inside off from the rest: a line from the edge where the run begins to
/// the one where it ends, as one goes around the face. The lines of all faces close to loops.
fn triangles_of(inside: usize) -> Vec<[u8; 3]> {
    let is_inside = |corner: usize| inside >> corner & 1 == 1;
    let mut next = [None; 12];
    for axis in 0..3 {
        for side in 0..2 {
            let (b, c) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            let mut around = [0, b, b | c, c].map(|corner| corner | side << axis);
            if side == 0 {
                // counter-clockwise seen from the other side
                around.reverse();
            }
            for i in 0..4 {
                let (before, first) = (around[(i + 3) % 4], around[i]);
                if is_inside(before) || !is_inside(first) {
                    continue;
                }
                let mut last = i;
                while is_inside(around[(last + 1) % 4]) {
                    last += 1;
                }
                next[edge_between(before, first)] =
                    Some(edge_between(around[last % 4], around[(last + 1) % 4]));
            }
        }
    }
    let mut triangles = Vec::new();
    for start in 0..12 {
        let mut edges = Vec::new();
        let mut edge = start;
        while let Some(following) = next[edge].take() {
            edges.push(edge as u8);
            edge = following;
        }
        for i in 2..edges.len() {
            triangles.push([edges[0], edges[i - 1], edges[i]]);
        }
    }
    triangles
}

/// The surface between positive and negative values, faces looking to the negative side. Points at the sides of the grid must
/// be negative for it to be closed.
pub(super) fn surface_of(field: &Field) -> Mesh {
    let [width, height, depth] = field.size;
    let layer = width * depth;
    let mut mesh = Mesh::default();
    // vertices on edges that begin at a point of this layer, or of the next: shape [points, axes]
    let mut here = vec![[NONE; 3]; layer];
    let mut above = here.clone();
    for y in 0..height.saturating_sub(1) {
        let layers =
            [&field.values[y * layer..(y + 1) * layer], &field.values[(y + 1) * layer..(y + 2) * layer]];
        for z in 0..depth - 1 {
            // in the order of bits 1 and 2
            let rows = [0, 1, 2, 3].map(|i| {
                let start = (z + i / 2) * width;
                &layers[i % 2][start..start + width]
            });
            let column = |x: usize| {
                let bit = |row: usize, corner: usize| usize::from(rows[row][x] > 0.0) << corner;
                bit(0, 0) | bit(1, 2) | bit(2, 4) | bit(3, 6)
            };
            let mut left = column(0);
            for x in 0..width - 1 {
                let right = column(x + 1);
                let case = left | right << 1;
                left = right;
                if case == 0 || case == 255 {
                    continue;
                }
                for triangle in &CASES[case] {
                    let face = triangle.map(|edge| {
                        let (corner, axis) = EDGES[edge as usize];
                        let [dx, dy, dz] = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
                        let at = (z + dz) * width + x + dx;
                        let vertex = if dy == 0 { &mut here[at][axis] } else { &mut above[at][axis] };
                        if *vertex == NONE {
                            *vertex = mesh.vertices.len() as u32;
                            mesh.vertices.push(crossing(field, [x + dx, y + dy, z + dz], axis));
                        }
                        *vertex
                    });
                    mesh.faces.push(face);
                }
            }
        }
        std::mem::swap(&mut here, &mut above);
        above.fill([NONE; 3]);
    }
    mesh
}

const NONE: u32 = u32::MAX;

/// Where the field passes zero between a point and its neighbour along an axis, metres.
fn crossing(field: &Field, [x, y, z]: [usize; 3], axis: usize) -> Vector3<f64> {
    let [width, _, depth] = field.size;
    let index = (y * depth + z) * width + x;
    let step = [1, width * depth, width][axis];
    let (from, to) = (f64::from(field.values[index]), f64::from(field.values[index + step]));
    // never quite at a point: triangles there would have no area
    let along = (from / (from - to)).clamp(0.01, 0.99);
    let mut at = Vector3::new(x as f64, y as f64, z as f64);
    at[axis] += along;
    field.origin + at * field.cell_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Topology;

    fn field(size: usize, value: impl Fn(Vector3<f64>) -> f64) -> Field {
        let mut values = Vec::new();
        for y in 0..size {
            for z in 0..size {
                for x in 0..size {
                    values.push(value(Vector3::new(x as f64, y as f64, z as f64)) as f32);
                }
            }
        }
        Field { origin: Vector3::zeros(), cell_m: 1.0, size: [size; 3], values }
    }

    #[test]
    fn a_ball_has_its_volume_and_a_closed_surface() {
        let centre = Vector3::new(14.2, 15.1, 14.7);
        let mesh = surface_of(&field(30, |point| 11.0 - (point - centre).norm()));
        assert!(Topology::new(&mesh.faces, mesh.vertices.len()).is_closed());
        let volume = 4.0 / 3.0 * std::f64::consts::PI * 11f64.powi(3);
        assert!((mesh.volume() / volume - 1.0).abs() < 0.005, "{} of {volume}", mesh.volume());
        assert!(mesh.vertices.iter().all(|vertex| ((vertex - centre).norm() - 11.0).abs() < 0.02));
    }

    #[test]
    fn any_field_has_a_closed_surface() {
        let mut state = 1u32;
        let noise: Vec<f64> = (0..12 * 12 * 12)
            .map(|_| {
                state = state.wrapping_mul(1664525).wrapping_add(1013904223);
                f64::from(state >> 8) / f64::from(1 << 24) - 0.4
            })
            .collect();
        let at_side = |x: f64| x == 0.0 || x == 11.0;
        let mesh = surface_of(&field(12, |point| {
            let index = (point.y * 144.0 + point.z * 12.0 + point.x) as usize;
            if point.iter().any(|&x| at_side(x)) { -1.0 } else { noise[index] }
        }));
        assert!(mesh.faces.len() > 1000);
        assert!(Topology::new(&mesh.faces, mesh.vertices.len()).is_closed());
        assert!(mesh.volume() > 0.0);
    }
}
