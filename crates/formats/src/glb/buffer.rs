//! The binary part of a GLB, and the accessors that say what lies where in it.

use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::{Error, Result};

// component types of glTF
const U8: u32 = 5121;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// What a buffer view is for: attributes of vertices, indices of faces, or anything else.
const ATTRIBUTES: Option<u32> = Some(34962);
const INDICES: Option<u32> = Some(34963);

#[derive(Debug, Default)]
pub(super) struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds a buffer view and its accessor; gives the accessor's index. All kinds are of whole words, so that every view
    /// begins at a multiple of four bytes.
    fn push(
        &mut self,
        kind: (&str, u32),
        count: usize,
        target: Option<u32>,
        bytes: impl Iterator<Item = [u8; 4]>,
    ) -> usize {
        let offset = self.bytes.len();
        bytes.for_each(|word| self.bytes.extend(word));
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": self.bytes.len() - offset });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.accessors.push(json!({
            "bufferView": self.views.len(), "componentType": kind.1, "count": count, "type": kind.0,
        }));
        self.views.push(view);
        self.accessors.len() - 1
    }

    /// Says how far the numbers of an accessor reach, as the format wants for positions and times.
    fn set_range(&mut self, accessor: usize, least: &[f32], most: &[f32]) {
        self.accessors[accessor]["min"] = json!(least);
        self.accessors[accessor]["max"] = json!(most);
    }

    pub(super) fn positions(&mut self, positions: &[Vector3<f64>]) -> usize {
        let (mut least, mut most) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for position in positions {
            for axis in 0..3 {
                least[axis] = least[axis].min(position[axis] as f32);
                most[axis] = most[axis].max(position[axis] as f32);
            }
        }
        let bytes = positions.iter().flat_map(words);
        let accessor = self.push(("VEC3", F32), positions.len(), ATTRIBUTES, bytes);
        self.set_range(accessor, &least, &most);
        accessor
    }

    /// Normals of the vertices.
    pub(super) fn normals(&mut self, normals: impl ExactSizeIterator<Item = Vector3<f64>>) -> usize {
        let count = normals.len();
        self.push(("VEC3", F32), count, ATTRIBUTES, normals.flat_map(|normal| words(&normal)))
    }

    /// Places of the root.
    pub(super) fn places(&mut self, places: &[Vector3<f64>]) -> usize {
        self.push(("VEC3", F32), places.len(), None, places.iter().flat_map(words))
    }

    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        self.push(("SCALAR", U32), indices.len(), INDICES, indices.iter().map(|index| index.to_le_bytes()))
    }

    pub(super) fn joints(&mut self, joints: &[[u8; 4]]) -> usize {
        self.push(("VEC4", U8), joints.len(), ATTRIBUTES, joints.iter().copied())
    }

    pub(super) fn weights(&mut self, weights: &[[f32; 4]]) -> usize {
        let words = weights.as_flattened().iter().map(|weight| weight.to_le_bytes());
        self.push(("VEC4", F32), weights.len(), ATTRIBUTES, words)
    }

    pub(super) fn rotations(&mut self, rotations: &[[f32; 4]]) -> usize {
        let words = rotations.as_flattened().iter().map(|number| number.to_le_bytes());
        self.push(("VEC4", F32), rotations.len(), None, words)
    }

    pub(super) fn times(&mut self, times: &[f32]) -> usize {
        let accessor =
            self.push(("SCALAR", F32), times.len(), None, times.iter().map(|time| time.to_le_bytes()));
        if let (Some(first), Some(last)) = (times.first(), times.last()) {
            self.set_range(accessor, &[*first], &[*last]);
        }
        accessor
    }

    /// Matrices that take away translations, column-major.
    pub(super) fn inverse_translations(
        &mut self,
        places: impl ExactSizeIterator<Item = Vector3<f64>>,
    ) -> usize {
        let count = places.len();
        let words = places.flat_map(|place| {
            let [x, y, z] = [-place.x, -place.y, -place.z].map(|number| number as f32);
            let matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0];
            matrix.map(f32::to_le_bytes)
        });
        self.push(("MAT4", F32), count, None, words)
    }

    /// The file: a header, the document as JSON, and the bytes.
    pub(super) fn into_glb(self, mut document: Value) -> Result<Vec<u8>> {
        document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        document["bufferViews"] = Value::Array(self.views);
        document["accessors"] = Value::Array(self.accessors);
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let too_large = |_| Error::whole_file("a mesh of more than 4 GiB", "at most 4 GiB in a GLB");
        let length = 12 + 8 + json.len() + 8 + self.bytes.len();
        let length = u32::try_from(length).map_err(too_large)?;
        let mut glb = Vec::with_capacity(length as usize);
        glb.extend(b"glTF");
        glb.extend(2_u32.to_le_bytes());
        glb.extend(length.to_le_bytes());
        for (kind, chunk) in [(b"JSON", json), (b"BIN\0", self.bytes)] {
            glb.extend(u32::try_from(chunk.len()).map_err(too_large)?.to_le_bytes());
            glb.extend(kind);
            glb.extend(chunk);
        }
        Ok(glb)
    }
}

fn words(vector: &Vector3<f64>) -> [[u8; 4]; 3] {
    [vector.x, vector.y, vector.z].map(|number| (number as f32).to_le_bytes())
}
