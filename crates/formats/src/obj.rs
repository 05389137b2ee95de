//! OBJ: meshes as text. Only positions and faces are read.

use model::{Mesh, counted};
use nalgebra::Vector3;

use crate::{
    Error, Place, Read, Result,
    read::Warnings,
    text::{Line, Lines, finite, quote, words},
};

/// Reads the triangles of an OBJ file; coordinates are taken as metres with y up, as they are.
///
/// Polygons become fans of triangles. Texture coordinates, normals, groups, objects, materials, lines and points are
/// left out; vertices without a face stay, so that their numbers are those of the file.
///
/// # Errors
/// If a vertex or a face is not as the format wants it, or names a vertex that isn't there.
pub fn read(bytes: &[u8]) -> Result<Read<Mesh>> {
    let mut warnings = Warnings::default();
    let mut mesh = Mesh::default();
    let mut polygons = 0;
    for line in Lines::new(bytes) {
        let mut words = words(line.text);
        match words.next() {
            Some(b"v") => mesh.vertices.push(vertex(line, words)?),
            Some(b"f") => polygons += usize::from(push_face(line, words, &mut mesh)? > 1),
            Some(b"vp" | b"curv" | b"surf") => {
                return Err(Error::at_line(line.number, "a free-form surface", "vertices and faces"));
            }
            _ => {}
        }
    }
    if mesh.vertices.is_empty() {
        return Err(Error::whole_file("no vertex", "lines that begin with v"));
    }
    if polygons > 0 {
        let message = format!("{} of more than three corners became triangles", counted(polygons, "face"));
        warnings.add(Place::File, message);
    }
    Ok(warnings.beside(Mesh::new(mesh.vertices, mesh.faces)?))
}

fn vertex<'a>(line: Line<'_>, words: impl Iterator<Item = &'a [u8]>) -> Result<Vector3<f64>> {
    let mut vertex = Vector3::zeros();
    let mut found = 0;
    // a weight or a colour may follow
    for (coordinate, word) in vertex.iter_mut().zip(words) {
        *coordinate = finite(word).ok_or_else(|| Error::at_line(line.number, quote(word), "a coordinate"))?;
        found += 1;
    }
    if found == 3 {
        Ok(vertex)
    } else {
        Err(Error::at_line(line.number, quote(line.text), "three coordinates"))
    }
}

/// Adds the triangles of a face; gives their number.
fn push_face<'a>(line: Line<'_>, words: impl Iterator<Item = &'a [u8]>, mesh: &mut Mesh) -> Result<usize> {
    let vertices = mesh.vertices.len();
    let before = mesh.faces.len();
    let mut corners = words.map(|word| {
        corner(word, vertices).ok_or_else(|| {
            let expected = format!("a vertex from 1 to {vertices}, or from -{vertices} to -1");
            Error::at_line(line.number, quote(word), expected)
        })
    });
    let (first, mut last) = (corners.next().transpose()?, corners.next().transpose()?);
    for corner in corners {
        let corner = corner?;
        if let (Some(first), Some(last)) = (first, last.replace(corner)) {
            mesh.faces.push([first, last, corner]);
        }
    }
    if mesh.faces.len() == before {
        return Err(Error::at_line(line.number, quote(line.text), "at least three corners"));
    }
    Ok(mesh.faces.len() - before)
}

/// Index of the vertex of `7`, `7/1`, `7//3`, `7/1/3`; negative numbers count from the vertex read last.
fn corner(word: &[u8], vertices: usize) -> Option<u32> {
    let number = word.split(|byte| *byte == b'/').next()?;
    let number: i64 = std::str::from_utf8(number).ok()?.parse().ok()?;
    let vertices = i64::try_from(vertices).ok()?;
    let index = if number < 0 { vertices.checked_add(number)? } else { number.checked_sub(1)? };
    (0..vertices).contains(&index).then(|| u32::try_from(index).ok()).flatten()
}

/// A mesh as OBJ: metres, y up; a micrometre is kept.
pub fn write(mesh: &Mesh) -> String {
    use std::fmt::Write as _;
    let mut text = String::from("# metres, y up\n");
    for v in &mesh.vertices {
        // writing to a String can't fail
        let _ = writeln!(text, "v {:.6} {:.6} {:.6}", v.x, v.y, v.z);
    }
    for [a, b, c] in &mesh.faces {
        let _ = writeln!(text, "f {} {} {}", u64::from(*a) + 1, u64::from(*b) + 1, u64::from(*c) + 1);
    }
    text
}
