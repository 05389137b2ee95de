//! PLY: meshes as text or binary of either byte order. Only positions and faces are read.

mod header;
mod values;

use model::{Mesh, counted};
use nalgebra::Vector3;

use crate::{Error, Place, Read, Result, read::Warnings};
use header::{Element, Header, Property};
use values::Values;

/// Reads the triangles of a PLY file; coordinates are taken as metres with y up, as they are.
///
/// Polygons become fans of triangles. Other properties (normals, colours) and other elements are left out. A file without
/// faces is a cloud of points.
///
/// # Errors
/// If the header is not as the format wants it, the data ends early, or a face names a vertex that isn't there.
pub fn read(bytes: &[u8]) -> Result<Read<Mesh>> {
    let mut warnings = Warnings::default();
    let header = Header::read(bytes)?;
    let mut values = Values::new(bytes, &header);
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    let mut polygons = 0;
    for element in &header.elements {
        values.check_room(element)?;
        match element.name.as_str() {
            "vertex" => read_vertices(element, &mut values, &mut vertices)?,
            "face" => polygons += read_faces(element, &mut values, &mut faces)?,
            _ => {
                for _ in 0..element.count {
                    element.properties.iter().try_for_each(|property| values.skip(property))?;
                }
            }
        }
    }
    if vertices.is_empty() {
        return Err(Error::whole_file("no vertex", "an element vertex with x, y and z"));
    }
    if polygons > 0 {
        let message = format!("{} of more than three corners became triangles", counted(polygons, "face"));
        warnings.add(Place::File, message);
    }
    if !values.is_at_end() {
        warnings.add(Place::File, "data after the last element is left out");
    }
    Ok(warnings.beside(Mesh::new(vertices, faces)?))
}

fn read_vertices(element: &Element, values: &mut Values<'_>, vertices: &mut Vec<Vector3<f64>>) -> Result<()> {
    let axis_of = |property: &Property| ["x", "y", "z"].iter().position(|axis| *axis == property.name);
    let axes: Vec<_> = element.properties.iter().map(axis_of).collect();
    for axis in 0..3 {
        let on_axis = || element.properties.iter().zip(&axes).filter(|(_, found)| **found == Some(axis));
        if on_axis().count() != 1 || on_axis().any(|(property, _)| property.count.is_some()) {
            return Err(Error::at_line(element.line, "an element vertex", "one number x, y and z each"));
        }
    }
    for _ in 0..element.count {
        let mut vertex = Vector3::zeros();
        for (property, axis) in element.properties.iter().zip(&axes) {
            match axis {
                Some(axis) => vertex[*axis] = values.number(property.kind)?,
                None => values.skip(property)?,
            }
        }
        vertices.push(vertex);
    }
    Ok(())
}

/// Adds the triangles of the faces; gives the number of faces with more than three corners.
fn read_faces(element: &Element, values: &mut Values<'_>, faces: &mut Vec<[u32; 3]>) -> Result<usize> {
    let is_corners = |property: &&Property| {
        ["vertex_indices", "vertex_index"].contains(&property.name.as_str()) && property.count.is_some()
    };
    if element.properties.iter().filter(is_corners).count() != 1 {
        return Err(Error::at_line(element.line, "an element face", "one list vertex_indices"));
    }
    let mut polygons = 0;
    for _ in 0..element.count {
        for property in &element.properties {
            let Some(count) = property.count.filter(|_| is_corners(&property)) else {
                values.skip(property)?;
                continue;
            };
            let corners = values.index(count)?;
            if corners < 3 {
                return Err(values.unexpected(format!("a face of {corners} corners"), "at least three"));
            }
            let first = values.index(property.kind)?;
            let mut last = values.index(property.kind)?;
            for _ in 2..corners {
                let corner = values.index(property.kind)?;
                faces.push([first, last, corner]);
                last = corner;
            }
            polygons += usize::from(corners > 3);
        }
    }
    Ok(polygons)
}

/// A mesh as binary little-endian PLY: metres, y up, in single precision.
pub fn write(mesh: &Mesh) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres, y up\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.faces.len()
    );
    let mut bytes = header.into_bytes();
    bytes.reserve(12 * mesh.vertices.len() + 13 * mesh.faces.len());
    for vertex in &mesh.vertices {
        vertex.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
    }
    for face in &mesh.faces {
        bytes.push(3);
        face.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
    }
    bytes
}
