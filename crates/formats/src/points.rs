//! What the readers of point trajectories share: axes, units, and placing samples.

use model::{Axis, PointTrajectories};
use nalgebra::Vector3;

use crate::{
    Error, Place, Result,
    read::Warnings,
    text::{Names, quote},
    time_grid::Grid,
};

/// What a file of points may not say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointsOptions {
    /// the axis of the file that points up; by default what the file says, else Y for CSV and TRC and Z for C3D
    pub up: Option<Axis>,
    /// standard deviation of a sample of full confidence, metres (default 0.0015): what a confidence divides, and the
    /// least residual that is taken for a standard deviation
    pub sigma_m: f64,
}

impl Default for PointsOptions {
    fn default() -> Self {
        Self { up: None, sigma_m: 0.0015 }
    }
}

/// A standard deviation above this says nothing of where on earth a point is: it was not measured. Metres.
pub(crate) const MAX_SIGMA: f64 = 1e3;

/// Point of a file whose `up` axis points up, in the world, where y does. The rotation is z up: `(x, z, -y)`;
/// x up: `(z, x, y)`.
pub(crate) fn y_up(up: Axis, p: Vector3<f64>) -> Vector3<f64> {
    match up {
        Axis::X => Vector3::new(p.z, p.x, p.y),
        Axis::Y => p,
        Axis::Z => Vector3::new(p.x, p.z, -p.y),
    }
}

/// The axis as messages call it.
pub(crate) fn letter(axis: Axis) -> char {
    match axis {
        Axis::X => 'x',
        Axis::Y => 'y',
        Axis::Z => 'z',
    }
}

/// Metres in a unit of length.
pub(crate) fn metres(unit: &[u8]) -> Option<f64> {
    match unit.to_ascii_lowercase().as_slice() {
        b"mm" | b"millimeters" | b"millimetres" => Some(1e-3),
        b"cm" | b"centimeters" | b"centimetres" => Some(1e-2),
        b"m" | b"meters" | b"metres" => Some(1.0),
        b"in" | b"inch" | b"inches" => Some(0.0254),
        _ => None,
    }
}

/// `unit` of a file; nothing is millimetres, with a warning.
pub(crate) fn metres_or_mm(unit: &[u8], place: Place, warnings: &mut Warnings) -> Result<f64> {
    if unit.is_empty() {
        warnings.add(place, "no unit of length is given; it is taken as mm");
        return Ok(1e-3);
    }
    let expected = || "mm, cm, m or in".into();
    metres(unit).ok_or_else(|| Error::Unexpected { place, found: quote(unit), expected: expected() })
}

/// Names of points, kept apart.
#[derive(Debug, Default)]
pub(crate) struct PointNames {
    names: Names,
    pub(crate) list: Vec<String>,
}

impl PointNames {
    pub(crate) fn push(&mut self, given: &str, place: Place, warnings: &mut Warnings) {
        let name = self.names.unique(given);
        if name != given {
            warnings.add(place, format!("two points are named {given}; the second was renamed {name}"));
        }
        self.list.push(name);
    }
}

/// Frames of a text file that may be filled with points at all: a sample takes three separators, so more than this
/// comes from rows that end early or are missing, and memory must stay in proportion to the file.
pub(crate) fn max_frames(file_bytes: usize, points: usize) -> usize {
    const FREE: usize = 1 << 20;
    (file_bytes.saturating_add(FREE)) / points.max(1)
}

/// Rows of samples, shape `[rows, points]`, placed in the frames of the grid; `sigmas` of the same shape, or none.
pub(crate) fn place(
    names: Vec<String>,
    rows: &[Vector3<f64>],
    sigmas: &[f64],
    grid: &Grid,
) -> Result<PointTrajectories> {
    let points = names.len();
    let positions = placed(rows, points, grid, Vector3::repeat(f64::NAN));
    let sigmas = if sigmas.is_empty() { Vec::new() } else { placed(sigmas, points, grid, f64::NAN) };
    Ok(PointTrajectories::new(names, grid.rate, positions)?.with_sigmas(sigmas)?)
}

fn placed<T: Copy>(rows: &[T], points: usize, grid: &Grid, missing: T) -> Vec<T> {
    let mut frames = vec![missing; grid.num_frames() * points];
    for (row, frame) in rows.chunks_exact(points).zip(&grid.frames) {
        frames[frame * points..(frame + 1) * points].copy_from_slice(row);
    }
    frames
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_stay_right_handed_and_up_becomes_y() {
        for up in [Axis::X, Axis::Y, Axis::Z] {
            assert_eq!(y_up(up, up.unit().into_inner()), Vector3::y());
            let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| y_up(up, v));
            assert_eq!(x.cross(&y), z);
        }
    }
}
