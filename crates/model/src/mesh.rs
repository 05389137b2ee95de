use nalgebra::Vector3;

use crate::{Error, Result};

/// A triangle mesh: positions and corners, counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// metres, shape `[vertices]`
    pub vertices: Vec<Vector3<f64>>,
    /// indices of the corners of every triangle, shape `[faces, 3]`
    pub faces: Vec<[u32; 3]>,
}

impl Mesh {
    /// A mesh whose faces name vertices that are there, all of them finite.
    ///
    /// # Errors
    /// [`Error::Face`] or [`Error::Vertex`] with the first that is wrong.
    pub fn new(vertices: Vec<Vector3<f64>>, faces: Vec<[u32; 3]>) -> Result<Self> {
        if let Some(vertex) = vertices.iter().position(|vertex| vertex.iter().any(|x| !x.is_finite())) {
            return Err(Error::Vertex { vertex });
        }
        let outside = |face: &[u32; 3]| face.iter().any(|&corner| corner as usize >= vertices.len());
        if let Some(face) = faces.iter().position(outside) {
            return Err(Error::Face { face, found: faces[face], vertices: vertices.len() });
        }
        Ok(Self { vertices, faces })
    }

    /// Unit normals of the vertices, means of the faces' weighted with their areas; zero where no face is. Shape `[vertices]`.
    pub fn normals(&self) -> Vec<Vector3<f64>> {
        let mut normals = vec![Vector3::zeros(); self.vertices.len()];
        for face in &self.faces {
            let [a, b, c] = self.corners(face);
            let normal = (b - a).cross(&(c - a));
            for &corner in face {
                normals[corner as usize] += normal;
            }
        }
        for normal in &mut normals {
            *normal = normal.try_normalize(0.0).unwrap_or_default();
        }
        normals
    }

    /// Volume that a closed mesh encloses, cubic metres; negative if its faces look inwards.
    pub fn volume(&self) -> f64 {
        let six_times = |face: &[u32; 3]| {
            let [a, b, c] = self.corners(face);
            a.dot(&b.cross(&c))
        };
        self.faces.iter().map(six_times).sum::<f64>() / 6.0
    }

    /// Positions of the corners of a face, metres.
    pub fn corners(&self, face: &[u32; 3]) -> [Vector3<f64>; 3] {
        face.map(|corner| self.vertices[corner as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        let vertices = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
        Mesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap()
    }

    #[test]
    fn volume_and_normals_of_a_tetrahedron() {
        let mesh = tetrahedron();
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
        for (vertex, normal) in mesh.vertices.iter().zip(mesh.normals()) {
            assert!(normal.dot(&(vertex - Vector3::repeat(0.25))) > 0.0, "normals look outwards");
        }
    }

    #[test]
    fn a_face_without_its_vertex_is_refused() {
        let error = Mesh::new(vec![Vector3::zeros(); 3], vec![[0, 1, 3]]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "face 0 has corners [0, 1, 3], expected indices below 3, the number of vertices"
        );
    }
}
