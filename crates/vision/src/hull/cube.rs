use nalgebra::Vector3;

/// A cube, metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cube {
    pub centre: Vector3<f64>,
    /// half a side
    pub half: f64,
}
