//! Whether the mesh of a template or a scan is of a person.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::Error;
use crate::extremes::lowest_and_highest;

/// Heights of people who stand, metres.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = 0.8..=2.6;

/// Checks that a template's mesh is closed, looks outwards, and is of a person's size.
pub fn check_template(rest: &[Vector3<f64>], faces: &[[u32; 3]]) -> crate::Result<()> {
    let fail = |what: String| Err(Error::Template { what });
    let mesh = model::Mesh::new(rest.to_vec(), faces.to_vec());
    let mesh = mesh.map_err(|e| Error::Template { what: e.to_string() })?;
    let open = open_edges(faces);
    if open > 0 || faces.is_empty() {
        return fail(format!("mesh has {} faces and {open} open edges, expected a closed mesh", faces.len()));
    }
    if mesh.volume() <= 0.0 {
        return fail("faces look inwards, expected corners counter-clockwise seen from outside".into());
    }
    check_size(rest).or_else(fail)
}

/// Checks that a body is of a person's height; says what is wrong.
pub fn check_size(vertices: &[Vector3<f64>]) -> Result<(), String> {
    let [low, high] = lowest_and_highest(vertices).map(|vertex| vertices[vertex].y);
    let height = high - low;
    if HEIGHTS_M.contains(&height) {
        return Ok(());
    }
    let unit = [("millimetres", 1e-3), ("centimetres", 0.01), ("inches", 0.0254)]
        .iter()
        .find(|(_, metres)| HEIGHTS_M.contains(&(height * metres)))
        .map_or(String::new(), |(unit, _)| format!(" (is the file in {unit}?)"));
    Err(format!(
        "the body is {height:.3} m tall, expected {} to {} m{unit}",
        HEIGHTS_M.start(),
        HEIGHTS_M.end()
    ))
}

/// Edges that have not one face on either side.
pub fn open_edges(faces: &[[u32; 3]]) -> usize {
    let mut edges: HashMap<[u32; 2], [u32; 2]> = HashMap::new();
    for &[a, b, c] in faces {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let counts = edges.entry([from.min(to), from.max(to)]).or_default();
            counts[usize::from(from > to)] += 1;
        }
    }
    edges.values().filter(|&&counts| counts != [1, 1]).count()
}
