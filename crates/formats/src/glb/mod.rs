//! GLB (glTF 2.0 in one binary file): meshes, also with skeleton, skin and animation, for Blender, three.js and others.
//! Metres, y up, as in glTF itself.

mod buffer;
mod skin;

use model::Mesh;
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::{Error, Result};
use buffer::Buffer;

/// A joint of a skeleton whose rest rotations are all identity.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// name of its node
    pub name: String,
    /// index of the joint above, which comes earlier; only the first joint, the root, has none
    pub parent: Option<usize>,
    /// where it is in the rest pose, in the world, metres
    pub rest_position: Vector3<f64>,
}

/// A mesh in the rest pose, with what moves it.
#[derive(Debug, Clone, PartialEq)]
pub struct SkinnedMesh {
    /// metres, y up
    pub mesh: Mesh,
    /// unit normals, shape `[vertices]`
    pub normals: Vec<Vector3<f64>>,
    /// parents first
    pub joints: Vec<Joint>,
    /// joints that move a vertex, shape `[vertices, 4]`
    pub joint_indices: Vec<[u8; 4]>,
    /// how much each of them does, shape `[vertices, 4]`; brought to a sum of 1
    pub weights: Vec<[f32; 4]>,
}

/// A motion of the joints of a [`SkinnedMesh`].
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// seconds, rising, shape `[frames]`
    pub times: Vec<f64>,
    /// rotation of each joint relative to the joint above, the rest pose being the identity, shape `[frames, joints]`
    pub rotations: Vec<UnitQuaternion<f64>>,
    /// where the root is, in the world, metres, shape `[frames]`
    pub translations: Vec<Vector3<f64>>,
}

/// A mesh that doesn't move, with its normals.
///
/// # Errors
/// If it has no face, or is too large for the format (4 GiB).
pub fn write_mesh(name: &str, mesh: &Mesh) -> Result<Vec<u8>> {
    let mut buffer = Buffer::default();
    let primitive = primitive(&mut buffer, mesh, &mesh.normals())?;
    let document = document(name, primitive, json!([{ "name": name, "mesh": 0 }]), &[0]);
    buffer.into_glb(document)
}

/// A mesh with its skeleton and skin, and a motion if there is one.
///
/// # Errors
/// If counts do not agree, a parent does not come before its child, a vertex has no weight or one of a joint that isn't
/// there, times do not rise, or it is too large for the format (4 GiB).
pub fn write_skinned(name: &str, body: &SkinnedMesh, animation: Option<&Animation>) -> Result<Vec<u8>> {
    count("normals", body.normals.len(), body.mesh.vertices.len())?;
    let mut buffer = Buffer::default();
    let mut primitive = primitive(&mut buffer, &body.mesh, &body.normals)?;
    let (joints, weights) = skin::attributes(body)?;
    primitive["attributes"]["JOINTS_0"] = json!(buffer.joints(&joints));
    primitive["attributes"]["WEIGHTS_0"] = json!(buffer.weights(&weights));
    // a skinned mesh stands beside its skeleton: its own place would not count
    let mut nodes = vec![json!({ "name": name, "mesh": 0, "skin": 0 })];
    nodes.extend(skin::nodes(&body.joints)?);
    let mut document = document(name, primitive, json!(nodes), &[0, 1]);
    let joint_nodes: Vec<_> = (1..=body.joints.len()).collect();
    let inverse = buffer.inverse_translations(body.joints.iter().map(|joint| joint.rest_position));
    document["skins"] = json!([{ "joints": joint_nodes, "skeleton": 1, "inverseBindMatrices": inverse }]);
    if let Some(animation) = animation {
        document["animations"] = json!([skin::animation(&mut buffer, body.joints.len(), animation)?]);
    }
    buffer.into_glb(document)
}

fn count(what: &str, found: usize, expected: usize) -> Result<()> {
    if found == expected {
        return Ok(());
    }
    Err(Error::whole_file(format!("{found} {what}"), format!("{expected}")))
}

fn primitive(buffer: &mut Buffer, mesh: &Mesh, normals: &[Vector3<f64>]) -> Result<Value> {
    if mesh.faces.is_empty() {
        return Err(Error::whole_file("a mesh without faces", "at least one face"));
    }
    // vertices without faces have no normal, and the format wants one
    let unit = |normal: &Vector3<f64>| normal.try_normalize(1e-12).unwrap_or_else(Vector3::y);
    let position = buffer.positions(&mesh.vertices);
    let normal = buffer.normals(normals.iter().map(unit));
    let indices = buffer.indices(mesh.faces.as_flattened());
    Ok(json!({ "attributes": { "POSITION": position, "NORMAL": normal }, "indices": indices, "material": 0 }))
}

fn document(name: &str, primitive: Value, nodes: Value, roots: &[usize]) -> Value {
    json!({
        "asset": { "version": "2.0", "generator": "Marey" },
        "scene": 0,
        "scenes": [{ "nodes": roots }],
        "nodes": nodes,
        "meshes": [{ "name": name, "primitives": [primitive] }],
        "materials": [{
            "name": "skin",
            "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.7, 0.62, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8 },
        }],
    })
}
