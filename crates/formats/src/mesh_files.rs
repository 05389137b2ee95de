//! Meshes of any format, which a file's name tells.

use model::Mesh;

use crate::{Error, Read, Result, extension::extension, obj, ply};

/// Reads a mesh, metres, from OBJ or PLY.
///
/// # Errors
/// [`Error::Unexpected`] if the file has another ending, and those of [`obj::read`] and [`ply::read`].
pub fn read(name: &str, bytes: &[u8]) -> Result<Read<Mesh>> {
    match extension(name).as_str() {
        "obj" => obj::read(bytes),
        "ply" => ply::read(bytes),
        _ => Err(Error::whole_file(format!("the name {name:?}"), "an ending .obj or .ply")),
    }
}
