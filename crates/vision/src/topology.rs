/// Edges of a triangle mesh with the faces on both sides: what stays the same while the mesh moves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    faces: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    num_vertices: usize,
    is_closed: bool,
}

/// An edge from one vertex to another, as the face `left` runs through it; the face `right` runs the other way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// first and second vertex
    pub vertices: [u32; 2],
    /// the face that runs from the first vertex to the second
    pub left: u32,
    /// the face that runs from the second vertex to the first; [`Edge::NONE`] at the rim of an open mesh
    pub right: u32,
}

impl Edge {
    /// Stands for a face that isn't there.
    pub const NONE: u32 = u32::MAX;
}

impl Topology {
    /// Edges of these faces.
    ///
    /// Any faces will do: edges of more than two faces become several edges, and faces that run through an edge in the same
    /// direction do not share it.
    ///
    /// # Panics
    /// If a face names a vertex that isn't there, or there are more than 2³² − 2 faces.
    pub fn new(faces: &[[u32; 3]], num_vertices: usize) -> Self {
        assert!(u32::try_from(faces.len()).is_ok_and(|count| count < Edge::NONE), "at most 2^32 - 2 faces");
        let mut half_edges = Vec::with_capacity(faces.len() * 3);
        for (index, face) in faces.iter().enumerate() {
            assert!(
                face.iter().all(|&corner| (corner as usize) < num_vertices),
                "face {index} has no vertex"
            );
            for side in 0..3 {
                let (from, to) = (face[side], face[(side + 1) % 3]);
                half_edges.push((from.min(to), from.max(to), from > to, index as u32));
            }
        }
        half_edges.sort_unstable();
        let mut edges = Vec::with_capacity(half_edges.len() / 2);
        let mut is_closed = true;
        for group in half_edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            // those that run upwards come first
            let forward = group.iter().filter(|half| !half.2).count();
            let (up, down) = group.split_at(forward);
            is_closed &= up.len() == down.len();
            for i in 0..up.len().max(down.len()) {
                edges.push(match (up.get(i), down.get(i)) {
                    (Some(&(a, b, _, left)), right) => {
                        Edge { vertices: [a, b], left, right: right.map_or(Edge::NONE, |half| half.3) }
                    }
                    (None, half) => {
                        let (a, b, _, left) = half.copied().unwrap_or_default();
                        Edge { vertices: [b, a], left, right: Edge::NONE }
                    }
                });
            }
        }
        Self { faces: faces.to_vec(), edges, num_vertices, is_closed }
    }

    /// Corners of the faces, shape `[faces, 3]`.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The edges.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.num_vertices
    }

    /// True if every edge has a face on both sides, which run through it in opposite directions.
    pub fn is_closed(&self) -> bool {
        self.is_closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_has_six_edges_with_a_face_on_both_sides() {
        let topology = Topology::new(&[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], 4);
        assert!(topology.is_closed());
        assert_eq!(topology.edges().len(), 6);
        for edge in topology.edges() {
            let runs = |face: u32, [a, b]: [u32; 2]| {
                let face = topology.faces()[face as usize];
                (0..3).any(|i| [face[i], face[(i + 1) % 3]] == [a, b])
            };
            let [a, b] = edge.vertices;
            assert!(runs(edge.left, [a, b]) && runs(edge.right, [b, a]));
        }
    }

    #[test]
    fn open_and_twisted_meshes_are_not_closed() {
        let open = Topology::new(&[[0, 1, 2], [2, 1, 3]], 4);
        assert!(!open.is_closed());
        assert_eq!(open.edges().iter().filter(|edge| edge.right == Edge::NONE).count(), 4);
        let twisted = Topology::new(&[[0, 1, 2], [1, 2, 3]], 4);
        assert_eq!(twisted.edges().iter().filter(|edge| edge.right == Edge::NONE).count(), 6);
    }
}
