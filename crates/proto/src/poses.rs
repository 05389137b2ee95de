//! Poses and windows of poses.

use crate::{Error, v1};

/// A pose on the wire. `pose`: metres and radians, shape `[dofs]`.
pub fn to_wire(pose: &[f64]) -> v1::Pose {
    v1::Pose { values: pose.to_vec() }
}

/// The values of a window, oldest pose first, row-major, shape `[poses, dofs]`, metres and radians.
///
/// # Errors
/// A pose with another number of values than `dofs`, or a value that is not finite.
pub fn window(poses: &[v1::Pose], dofs: usize) -> Result<Vec<f64>, Error> {
    let mut values = Vec::with_capacity(poses.len().saturating_mul(dofs));
    for (index, pose) in poses.iter().enumerate() {
        if pose.values.len() != dofs {
            return Err(Error::DofMismatch { pose: index, found: pose.values.len(), expected: dofs });
        }
        if let Some(bad) = pose.values.iter().position(|v| !v.is_finite()) {
            let what = format!("value {bad} of the pose");
            return Err(Error::NotFinite { frame: index, what, found: pose.values[bad] });
        }
        values.extend_from_slice(&pose.values);
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_comes_back_as_it_went() {
        let poses = [to_wire(&[1.0, 2.0]), to_wire(&[3.0, 4.0])];
        assert_eq!(window(&poses, 2).unwrap(), [1.0, 2.0, 3.0, 4.0]);
        assert!(window(&[], 2).unwrap().is_empty());
    }

    #[test]
    fn a_pose_that_does_not_fit_is_refused_with_both_numbers() {
        let error = window(&[to_wire(&[1.0, 2.0]), to_wire(&[1.0])], 2).unwrap_err();
        assert_eq!(error, Error::DofMismatch { pose: 1, found: 1, expected: 2 });
        assert!(matches!(window(&[to_wire(&[f64::INFINITY])], 1), Err(Error::NotFinite { frame: 0, .. })));
    }
}
