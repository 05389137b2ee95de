//! What the sections of an ASF file say, in file units.

use model::{Axis, Channel, ChannelKind};
use nalgebra::Vector3;

/// What the `:root` section says, in file units.
#[derive(Debug)]
pub(super) struct Root {
    pub(super) line: usize,
    pub(super) channels: Vec<Channel>,
    pub(super) axis_order: Option<[Axis; 3]>,
    pub(super) position: Vector3<f64>,
    pub(super) orientation: [f64; 3],
}

/// One `begin … end` of `:bonedata`, in file units.
#[derive(Debug)]
pub(super) struct RawBone {
    pub(super) line: usize,
    pub(super) name: String,
    pub(super) direction: Vector3<f64>,
    pub(super) length: f64,
    pub(super) axis: [f64; 3],
    pub(super) axis_order: [Axis; 3],
    pub(super) channels: Vec<Channel>,
    pub(super) limits: Vec<f64>,
}

/// One line of `:hierarchy`.
#[derive(Debug)]
pub(super) struct Children<'a> {
    pub(super) line: usize,
    pub(super) parent: &'a [u8],
    pub(super) children: Vec<&'a [u8]>,
}

/// Lengths and angles of the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Units {
    pub(super) metres: Option<f64>,
    pub(super) radians: Option<f64>,
}

impl Units {
    /// Factor from file units to metres or radians.
    pub(super) fn factor(self, kind: ChannelKind) -> f64 {
        match kind {
            ChannelKind::Translation => self.metres.unwrap_or(0.0254),
            ChannelKind::Rotation => self.radians.unwrap_or(1f64.to_radians()),
        }
    }
}
