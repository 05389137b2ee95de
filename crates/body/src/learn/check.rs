//! Whether scans are what they should be: faults of files that would spoil a model without a word.

use nalgebra::Vector3;

use super::options::Scan;
use crate::mesh_check::{check_size, open_edges};
use crate::procrustes::{Rigid, rigid};
use crate::{Error, Template};

/// Mean distance from the template, after turning and scaling, beyond which vertices must be in another order, metres.
const MOST_APART_M: f64 = 0.15;

/// Checks one scan against the template.
pub fn check_scan(scan: &Scan<'_>, template: &Template) -> crate::Result<()> {
    let result = check_topology(scan, template)
        .and_then(|()| check_axes(scan.vertices, &template.rest))
        .and_then(|()| check_size(scan.vertices));
    result.map_err(|what| Error::Scan { name: scan.name.to_owned(), what })
}

fn check_topology(scan: &Scan<'_>, template: &Template) -> Result<(), String> {
    let (found, expected) = (scan.vertices.len(), template.rest.len());
    if found != expected {
        return Err(format!("{found} vertices, expected the template's {expected}"));
    }
    if let Some(vertex) = scan.vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
        return Err(format!("vertex {vertex} is not finite"));
    }
    let Some(faces) = scan.faces else { return Ok(()) };
    if let Some(face) = faces.iter().find(|face| face.iter().any(|&corner| corner as usize >= expected)) {
        return Err(format!("a face has corners {face:?}, expected indices below {expected}"));
    }
    let open = open_edges(faces);
    if open > 0 {
        return Err(format!("the mesh has holes: {open} open edges, expected a closed mesh"));
    }
    let canonical = |faces: &[[u32; 3]]| {
        let mut faces: Vec<_> = faces.iter().map(|&face| first_smallest(face)).collect();
        faces.sort_unstable();
        faces
    };
    if canonical(faces) == canonical(&template.faces) {
        return Ok(());
    }
    let turned: Vec<_> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    if canonical(&turned) == canonical(&template.faces) {
        return Err("faces look inwards, expected corners counter-clockwise seen from outside".into());
    }
    Err(format!("{} faces that are not the template's {}", faces.len(), template.faces.len()))
}

/// Axes, from the similarity that brings the template to the scan: registered vertices tell every turn and mirroring.
fn check_axes(scan: &[Vector3<f64>], template: &[Vector3<f64>]) -> Result<(), String> {
    let Rigid { rotation, is_mirrored, scale, .. } = rigid(template.iter().zip(scan));
    if scale <= 0.0 || scale.is_nan() {
        return Err("all vertices are in one place".into());
    }
    if is_mirrored {
        return Err(
            "the body is mirrored: an axis is flipped, expected x to its left, y up, z to its front".into()
        );
    }
    let up = rotation * Vector3::y();
    if up.y < -0.7 {
        return Err("the body stands upside down, expected y up".into());
    }
    if up.y < 0.7 {
        let axis = if up.z.abs() > up.x.abs() { 'z' } else { 'x' };
        return Err(format!("the body stands along the {axis} axis, expected y up"));
    }
    let moved = rigid(template.iter().zip(scan));
    let apart = |(t, s): (&Vector3<f64>, &Vector3<f64>)| ((moved.apply(t) - s) / scale).norm();
    let mean = template.iter().zip(scan).map(apart).sum::<f64>() / scan.len() as f64;
    if mean > MOST_APART_M {
        return Err(format!(
            "vertices are {:.0} mm from the template's on average: another order of vertices, or not the base pose",
            mean * 1000.0
        ));
    }
    Ok(())
}

fn first_smallest([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a <= b && a <= c {
        [a, b, c]
    } else if b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}
