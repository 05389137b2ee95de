use std::fmt;

use nalgebra::{Rotation3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// first axis
    X,
    /// second axis; up in the world
    Y,
    /// third axis
    Z,
}

impl Axis {
    /// Index of the axis: 0, 1, 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Unit vector along the axis.
    pub fn unit(self) -> Unit<Vector3<f64>> {
        match self {
            Self::X => Vector3::x_axis(),
            Self::Y => Vector3::y_axis(),
            Self::Z => Vector3::z_axis(),
        }
    }
}

impl std::fmt::Display for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(["x", "y", "z"][self.index()])
    }
}

/// A word that names no axis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("found {found:?}, expected x, y or z")]
pub struct UnknownAxis {
    /// the word
    pub found: String,
}

impl std::str::FromStr for Axis {
    type Err = UnknownAxis;

    fn from_str(word: &str) -> Result<Self, UnknownAxis> {
        match word {
            "x" => Ok(Self::X),
            "y" => Ok(Self::Y),
            "z" => Ok(Self::Z),
            found => Err(UnknownAxis { found: found.to_owned() }),
        }
    }
}

/// What a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChannelKind {
    /// translation along an axis of the parent, metres
    Translation,
    /// rotation about an axis, radians
    Rotation,
}

/// One degree of freedom of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// translation (metres) or rotation (radians)
    pub kind: ChannelKind,
    /// about or along which axis of the joint
    pub axis: Axis,
    /// lowest and highest value that the file allows, radians or metres
    pub limits: Option<(f64, f64)>,
}

impl Channel {
    /// A translation along `axis`, without limits.
    pub fn translation(axis: Axis) -> Self {
        Self { kind: ChannelKind::Translation, axis, limits: None }
    }

    /// A rotation about `axis`, without limits.
    pub fn rotation(axis: Axis) -> Self {
        Self { kind: ChannelKind::Rotation, axis, limits: None }
    }
}

impl fmt::Display for Channel {
    /// Acclaim's name: `tx` … `rz`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            ChannelKind::Translation => 't',
            ChannelKind::Rotation => 'r',
        };
        write!(f, "{kind}{}", ['x', 'y', 'z'][self.axis.index()])
    }
}

/// A joint and the bone that hangs from it.
///
/// With channel values `q`, the transform of the joint in its parent is
///
/// ```text
/// parent_from_joint = Translate(offset + Σ q_t e_t) · axes · R(a₁, q₁) · R(a₂, q₂) · … · axes⁻¹
/// ```
///
/// where `e_t` are the axes of the translation channels and `a₁, a₂, …` are the axes of `rotation_order`,
/// leftmost first. Acclaim's `C M C⁻¹` has `axes = C`; BVH has `axes = 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// unique in the skeleton
    pub name: String,
    /// index of the parent joint, `None` for the root
    pub parent: Option<usize>,
    /// position in the parent joint's frame when all channels are 0, metres
    pub offset: Vector3<f64>,
    /// end of the bone in the joint's own frame, metres; zero where the file gives none
    pub tip: Vector3<f64>,
    /// the frame in which the rotation axes are given (Acclaim's `axis`, C)
    pub axes: Rotation3<f64>,
    /// degrees of freedom, in the order of the file's columns
    pub channels: Vec<Channel>,
    /// axes of the rotation channels in the order in which their matrices are multiplied, leftmost first
    pub rotation_order: Vec<Axis>,
}

impl Joint {
    /// A root at the origin whose rotation matrices are multiplied in the order of `channels`.
    pub fn root(name: impl Into<String>, channels: Vec<Channel>) -> Self {
        Self::child(name, None, Vector3::zeros(), channels)
    }

    /// A joint at `offset` in `parent` whose rotation matrices are multiplied in the order of `channels`.
    pub fn child(
        name: impl Into<String>,
        parent: impl Into<Option<usize>>,
        offset: Vector3<f64>,
        channels: Vec<Channel>,
    ) -> Self {
        let rotation_order =
            channels.iter().filter(|c| c.kind == ChannelKind::Rotation).map(|c| c.axis).collect();
        Self {
            name: name.into(),
            parent: parent.into(),
            offset,
            tip: Vector3::zeros(),
            axes: Rotation3::identity(),
            channels,
            rotation_order,
        }
    }

    /// Number of rotation channels: 0 to 3.
    pub fn num_rotations(&self) -> usize {
        self.channels.iter().filter(|c| c.kind == ChannelKind::Rotation).count()
    }
}
