//! Which axis of a file's world points up.

use std::{fmt, str::FromStr};

use model::Axis;
use nalgebra::{Rotation3, Vector3};

use crate::points;

/// An axis, or its opposite, that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UpAxis {
    /// x
    X,
    /// y, as in Marey, OpenSim and many renderers
    Y,
    /// z, as in Qualisys and Pose2Sim
    Z,
    /// x points down
    MinusX,
    /// y points down, as in a camera
    MinusY,
    /// z points down
    MinusZ,
}

impl UpAxis {
    const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::MinusX, Self::MinusY, Self::MinusZ];

    /// The axis in the file's world, unit vector.
    pub fn unit(self) -> Vector3<f64> {
        let (axis, sign) = self.parts();
        axis.unit().into_inner() * sign
    }

    /// The rotation from the file's world into Marey's, where y is up. Where the person looks stays as it was, except that
    /// axes that point down are first turned half round: about z for x and y, about x for z.
    pub fn world_from_file(self) -> Rotation3<f64> {
        let (axis, sign) = self.parts();
        let half = match axis {
            _ if sign > 0.0 => Rotation3::identity(),
            Axis::X | Axis::Y => Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI),
            Axis::Z => Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
        };
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|unit| points::y_up(axis, unit));
        Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&columns)) * half
    }

    fn parts(self) -> (Axis, f64) {
        match self {
            Self::X => (Axis::X, 1.0),
            Self::Y => (Axis::Y, 1.0),
            Self::Z => (Axis::Z, 1.0),
            Self::MinusX => (Axis::X, -1.0),
            Self::MinusY => (Axis::Y, -1.0),
            Self::MinusZ => (Axis::Z, -1.0),
        }
    }

    /// The axis within 45° of a direction of the file's world; `None` if the direction is near none, or has no length.
    pub(super) fn nearest(direction: Vector3<f64>) -> Option<Self> {
        let direction = direction.try_normalize(1e-3)?;
        Self::ALL.into_iter().find(|up| up.unit().dot(&direction) > std::f64::consts::FRAC_1_SQRT_2)
    }
}

impl From<Axis> for UpAxis {
    fn from(axis: Axis) -> Self {
        match axis {
            Axis::X => Self::X,
            Axis::Y => Self::Y,
            Axis::Z => Self::Z,
        }
    }
}

impl fmt::Display for UpAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusX => "-x",
            Self::MinusY => "-y",
            Self::MinusZ => "-z",
        })
    }
}

impl FromStr for UpAxis {
    type Err = String;

    /// `x`, `y`, `z`, `-x`, `-y` or `-z`.
    fn from_str(text: &str) -> Result<Self, String> {
        let name = text.to_ascii_lowercase();
        let found = Self::ALL.into_iter().find(|up| up.to_string() == name);
        found.ok_or_else(|| format!("found {text:?}, expected x, y, z, -x, -y or -z"))
    }
}

/// What a file says about the axis that points up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stated {
    /// the file, or its format, says it
    Certain(UpAxis),
    /// the file doesn't say it; this is usual for its format
    Usual(UpAxis),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_becomes_y_by_a_rotation() {
        for up in UpAxis::ALL {
            let rotation = up.world_from_file();
            assert!((rotation * up.unit() - Vector3::y()).norm() < 1e-12, "{up}");
            assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-12, "{up}");
            assert_eq!(up.to_string().parse(), Ok(up));
            assert_eq!(UpAxis::nearest(up.unit() + Vector3::new(0.3, 0.2, -0.1)), Some(up));
        }
        assert_eq!(UpAxis::nearest(Vector3::repeat(1.0)), None);
    }
}
