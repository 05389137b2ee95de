use model::Silhouette;
use nalgebra::Vector3;

use crate::{Edge, Topology, View};

/// Draws silhouettes of meshes: a pixel is set if its centre lies inside a face.
///
/// Only edges between a face that looks at the camera and one that looks away (or none) are drawn. Along a row of pixels
/// each of them begins or ends as many layers of faces as its two faces say, edges between faces that look the same way
/// cancel, and the person is where the sum of layers is not zero. This is the union of all faces exactly, shared edges
/// leave no gaps, and a row crosses few such edges. The mesh need not be closed.
///
/// Faces with a corner that has no pixel (see [`View::project`]) are left out. The buffers are kept between calls, so
/// that drawing meshes and views of the same size takes no memory.
#[derive(Debug, Clone, Default)]
pub struct Rasteriser {
    /// pixels of the vertices, NaN where there is none, shape `[vertices]`
    pixels: Vec<[f32; 2]>,
    /// +1, -1 or 0: which way round the face is seen, shape `[faces]`
    turns: Vec<i8>,
    outline: Vec<OutlineEdge>,
    /// where the crossings of a row begin, shape `[rows + 1]`
    row_starts: Vec<u32>,
    /// crossings of edges with rows: first pixel right of it, times 256, plus 128, plus layers that begin there
    crossings: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct OutlineEdge {
    /// crossing with row `top`, pixels
    x: f32,
    /// pixels a row
    slope: f32,
    top: u32,
    /// first row below
    end: u32,
    /// layers that begin right of the edge
    layers: i32,
}

impl Rasteriser {
    /// A rasteriser with empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Draws the mesh with these vertices (metres, in the world) into `silhouette`, which gets the size of the view.
    /// Returns a box with all of it: left, top, and right and bottom just outside; `None` if nothing is seen.
    ///
    /// # Panics
    /// If the number of vertices is not that of the topology.
    pub fn silhouette(
        &mut self,
        view: &View,
        vertices: &[Vector3<f64>],
        topology: &Topology,
        silhouette: &mut Silhouette,
    ) -> Option<[usize; 4]> {
        assert_eq!(vertices.len(), topology.num_vertices(), "vertices of the topology");
        let [width, height] = view.size;
        if (silhouette.width(), silhouette.height()) == (width, height) {
            silhouette.clear();
        } else {
            *silhouette = Silhouette::empty(width, height);
        }
        self.project(view, vertices);
        self.turn(topology.faces());
        self.find_outline(topology.edges(), height);
        self.cross(width);
        self.fill(silhouette)
    }

    fn project(&mut self, view: &View, vertices: &[Vector3<f64>]) {
        self.pixels.clear();
        self.pixels.extend(vertices.iter().map(|vertex| {
            view.project(vertex).map_or([f32::NAN; 2], |(pixel, _)| [pixel.x as f32, pixel.y as f32])
        }));
    }

    fn turn(&mut self, faces: &[[u32; 3]]) {
        self.turns.clear();
        self.turns.extend(faces.iter().map(|face| {
            let area = twice_area(face.map(|corner| self.pixels[corner as usize]));
            // both are false for NaN
            i8::from(area > 0.0) - i8::from(area < 0.0)
        }));
    }

    /// Lists the edges where layers begin or end, and counts how many of them cross each row.
    fn find_outline(&mut self, edges: &[Edge], height: usize) {
        self.outline.clear();
        self.row_starts.clear();
        self.row_starts.resize(height + 2, 0);
        for edge in edges {
            let right = if edge.right == Edge::NONE { 0 } else { self.turns[edge.right as usize] };
            let layers = self.turns[edge.left as usize] - right;
            if layers == 0 {
                continue;
            }
            let [from, to] = edge.vertices.map(|vertex| self.pixels[vertex as usize]);
            // v points down, so that what a face with positive area covers begins right of the edges that run up
            let (high, low, layers) = if from[1] > to[1] { (to, from, layers) } else { (from, to, -layers) };
            let (top, end) = (row_from(high[1], height), row_from(low[1], height));
            if top >= end {
                continue;
            }
            let slope = (low[0] - high[0]) / (low[1] - high[1]);
            let x = high[0] + (top as f32 - high[1]) * slope;
            // differences: summed up below
            self.row_starts[top as usize + 1] = self.row_starts[top as usize + 1].wrapping_add(1);
            self.row_starts[end as usize + 1] = self.row_starts[end as usize + 1].wrapping_sub(1);
            self.outline.push(OutlineEdge { x, slope, top, end, layers: i32::from(layers) });
        }
        let (mut in_row, mut start) = (0u32, 0u32);
        for entry in &mut self.row_starts {
            in_row = in_row.wrapping_add(*entry);
            start += in_row;
            *entry = start;
        }
    }

    /// Sorts the crossings into their rows. Afterwards `row_starts[y]` is the end of row y.
    fn cross(&mut self, width: usize) {
        let total = self.row_starts.last().copied().unwrap_or_default() as usize;
        self.crossings.clear();
        self.crossings.resize(total, 0);
        for edge in &self.outline {
            let rows = &mut self.row_starts[edge.top as usize..edge.end as usize];
            for (row, next) in rows.iter_mut().enumerate() {
                let x = edge.x + row as f32 * edge.slope;
                let column = first_at_or_after(x).clamp(0, width as i32);
                self.crossings[*next as usize] = (column as u32) << 8 | (edge.layers + 128) as u32;
                *next += 1;
            }
        }
    }

    fn fill(&mut self, silhouette: &mut Silhouette) -> Option<[usize; 4]> {
        let (mut start, mut bounds) = (0, None::<[usize; 4]>);
        for y in 0..silhouette.height() {
            let end = self.row_starts[y] as usize;
            let crossings = &mut self.crossings[start..end];
            start = end;
            if crossings.is_empty() {
                continue;
            }
            crossings.sort_unstable();
            let row = silhouette.row_mut(y);
            let (mut layers, mut left) = (0, 0);
            for &crossing in crossings.iter() {
                let x = (crossing >> 8) as usize;
                let after = layers + (crossing & 255) as i32 - 128;
                if layers == 0 {
                    left = x;
                } else if after == 0 && x > left {
                    set_span(row, left, x);
                    let [l, t, r, _] = bounds.unwrap_or([left, y, x, y]);
                    bounds = Some([l.min(left), t, r.max(x), y + 1]);
                }
                layers = after;
            }
        }
        bounds
    }
}

/// Twice the area of a triangle of the image, positive if it runs right, then down. NaN if a corner is.
pub(crate) fn twice_area([a, b, c]: [[f32; 2]; 3]) -> f64 {
    // differences of single precision are nearly exact in double precision, so that the sign is right
    let [ax, ay] = a.map(f64::from);
    let [bx, by] = b.map(f64::from);
    let [cx, cy] = c.map(f64::from);
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}

/// First row whose centre is at or below v, at most `height`.
pub(crate) fn row_from(v: f32, height: usize) -> u32 {
    first_at_or_after(v).clamp(0, height as i32) as u32
}

/// Rounds up, without the library call that `f32::ceil` is on processors of the baseline.
pub(crate) fn first_at_or_after(x: f32) -> i32 {
    let whole = x as i32;
    whole.saturating_add(i32::from(x > whole as f32))
}

/// Sets pixels `left..right` of a row of words.
pub(crate) fn set_span(row: &mut [u64], left: usize, right: usize) {
    let (first, last) = (left / 64, (right - 1) / 64);
    let from = !0u64 << (left % 64);
    let to = !0u64 >> (63 - (right - 1) % 64);
    if first == last {
        row[first] |= from & to;
    } else {
        row[first] |= from;
        row[first + 1..last].fill(!0);
        row[last] |= to;
    }
}
