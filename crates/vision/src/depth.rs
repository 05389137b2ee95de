use nalgebra::Vector3;

use crate::{
    Topology, View,
    raster::{first_at_or_after, row_from, twice_area},
};

/// Which face is seen at each pixel of a view, and how far away it is.
///
/// Faces of closed meshes that look away from the camera are never seen and left out. Edges are crossed as
/// [`Rasteriser`](crate::Rasteriser) crosses them, but face by face, so pixels at the very outline may differ by rounding.
#[derive(Debug, Clone, Default)]
pub struct DepthBuffer {
    width: usize,
    height: usize,
    /// 1 / depth, 0 where nothing is seen
    inverse_depths: Vec<f32>,
    faces: Vec<u32>,
    /// pixel and 1 / depth of the vertices
    vertices: Vec<[f32; 3]>,
}

const NOTHING: u32 = u32::MAX;

impl DepthBuffer {
    /// A buffer of no pixels yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Draws the mesh with these vertices (metres, in the world); what was drawn before is forgotten. Takes no memory for
    /// meshes and views of the same size as before.
    ///
    /// # Panics
    /// If the number of vertices is not that of the topology.
    pub fn draw(&mut self, view: &View, vertices: &[Vector3<f64>], topology: &Topology) {
        assert_eq!(vertices.len(), topology.num_vertices(), "vertices of the topology");
        [self.width, self.height] = view.size;
        let pixels = self.width * self.height;
        self.inverse_depths.clear();
        self.inverse_depths.resize(pixels, 0.0);
        self.faces.clear();
        self.faces.resize(pixels, NOTHING);
        self.vertices.clear();
        self.vertices.extend(vertices.iter().map(|vertex| {
            view.project(vertex).map_or([f32::NAN; 3], |(pixel, depth)| {
                [pixel.x as f32, pixel.y as f32, (1.0 / depth) as f32]
            })
        }));
        for (index, face) in topology.faces().iter().enumerate() {
            let corners = face.map(|corner| self.vertices[corner as usize]);
            let area = twice_area(corners.map(|[x, y, _]| [x, y]));
            // counter-clockwise from outside is the other way round where v points down
            if area < 0.0 || (area > 0.0 && !topology.is_closed()) {
                self.draw_face(index as u32, corners, area as f32);
            }
        }
    }

    fn draw_face(&mut self, index: u32, corners: [[f32; 3]; 3], twice_area: f32) {
        let [a, b, c] = corners;
        // 1/depth is linear in the image
        let (bz, cz) = (b[2] - a[2], c[2] - a[2]);
        let per_x = (bz * (c[1] - a[1]) - cz * (b[1] - a[1])) / twice_area;
        let per_y = (cz * (b[0] - a[0]) - bz * (c[0] - a[0])) / twice_area;
        let nearest = a[2].max(b[2]).max(c[2]);
        let farthest = a[2].min(b[2]).min(c[2]);
        let mut sorted = corners;
        sorted.sort_unstable_by(|p, q| p[1].total_cmp(&q[1]));
        let [high, middle, low] = sorted;
        let crossing = |from: [f32; 3], to: [f32; 3], y: f32| {
            from[0] + (y - from[1]) * ((to[0] - from[0]) / (to[1] - from[1]))
        };
        for row in row_from(high[1], self.height)..row_from(low[1], self.height) {
            let y = row as f32;
            let long = crossing(high, low, y);
            let short = if y < middle[1] { crossing(high, middle, y) } else { crossing(middle, low, y) };
            let column = |x: f32| first_at_or_after(x).clamp(0, self.width as i32) as usize;
            let (left, right) = (column(long.min(short)), column(long.max(short)));
            if left >= right {
                continue;
            }
            let start = row as usize * self.width;
            let depths = &mut self.inverse_depths[start + left..start + right];
            let faces = &mut self.faces[start + left..start + right];
            let at_left = a[2] + (y - a[1]) * per_y + (left as f32 - a[0]) * per_x;
            for (i, (depth, face)) in depths.iter_mut().zip(faces).enumerate() {
                // slivers have steep planes; none is nearer or farther than its corners
                let inverse = (at_left + i as f32 * per_x).clamp(farthest, nearest);
                if inverse > *depth {
                    (*depth, *face) = (inverse, index);
                }
            }
        }
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Index of the face that is seen at a pixel; `None` where none is, and outside the image.
    pub fn face(&self, x: isize, y: isize) -> Option<u32> {
        let face = self.faces[self.index(x, y)?];
        (face != NOTHING).then_some(face)
    }

    /// Distance from the plane of the camera of what is seen at a pixel, metres; `None` where nothing is.
    pub fn depth(&self, x: isize, y: isize) -> Option<f64> {
        let inverse = self.inverse_depths[self.index(x, y)?];
        (inverse > 0.0).then(|| 1.0 / f64::from(inverse))
    }

    /// True if a point of the world is seen: nothing drawn at its pixel is more than `tolerance_m` nearer. False outside
    /// the image.
    pub fn sees(&self, view: &View, point: &Vector3<f64>, tolerance_m: f64) -> bool {
        view.project(point).is_some_and(|(pixel, depth)| {
            let (x, y) = (pixel.x.round() as isize, pixel.y.round() as isize);
            self.index(x, y).is_some()
                && self.depth(x, y).is_none_or(|nearest| depth <= nearest + tolerance_m)
        })
    }

    fn index(&self, x: isize, y: isize) -> Option<usize> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.width && y < self.height).then(|| y * self.width + x)
    }
}
