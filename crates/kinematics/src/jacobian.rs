use nalgebra::Vector3;

use crate::{Kinematics, PointSet, State};

impl PointSet {
    /// Derivative of the points' positions with respect to the coordinates, row-major, shape `[3·points, dofs]`,
    /// metres per metre or radian. `state` must be that of [`PointSet::positions`], `positions` its result.
    ///
    /// An angle turns the point about its axis through the joint, a translation shifts it along its axis.
    pub fn jacobian(
        &self,
        kinematics: &Kinematics,
        state: &State,
        positions: &[Vector3<f64>],
        out: &mut [f64],
    ) {
        let width = kinematics.num_dofs();
        out[..3 * self.points.len() * width].fill(0.0);
        for (p, (position, dofs)) in positions.iter().zip(&self.dofs).enumerate() {
            let rows = &mut out[3 * p * width..3 * (p + 1) * width];
            for &dof in dofs {
                let d = kinematics.dofs[dof];
                let axis = state.dof_axes[dof];
                let column =
                    if d.is_translation { axis } else { axis.cross(&(position - state.positions[d.joint])) };
                rows[dof] = column.x;
                rows[width + dof] = column.y;
                rows[2 * width + dof] = column.z;
            }
        }
    }
}

/// Compares an analytic Jacobian with central differences, and names the worst entry.
///
/// `function` fills a vector of length `rows` from coordinates; `jacobian` is row-major, shape `[rows, x.len()]`.
///
/// # Errors
/// The row, the coordinate and both values where they differ by more than `tolerance` (relative to 1 or to the
/// value, whichever is larger).
pub fn check_jacobian(
    x: &[f64],
    rows: usize,
    jacobian: &[f64],
    tolerance: f64,
    mut function: impl FnMut(&[f64], &mut [f64]),
) -> Result<(), String> {
    let step = 1e-6;
    let (mut high, mut low) = (vec![0.0; rows], vec![0.0; rows]);
    let mut moved = x.to_vec();
    for dof in 0..x.len() {
        moved[dof] = x[dof] + step;
        function(&moved, &mut high);
        moved[dof] = x[dof] - step;
        function(&moved, &mut low);
        moved[dof] = x[dof];
        for row in 0..rows {
            let difference = (high[row] - low[row]) / (2.0 * step);
            let analytic = jacobian[row * x.len() + dof];
            let is_close = (difference - analytic).abs() <= tolerance * difference.abs().max(1.0);
            // Also where one of them is not a number.
            if !is_close {
                return Err(format!(
                    "row {row}, coordinate {dof}: analytic {analytic}, differences {difference}"
                ));
            }
        }
    }
    Ok(())
}
