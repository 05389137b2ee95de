use nalgebra::Vector2;

/// One point of the person, seen at two moments by one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMatch {
    /// how many frames of the camera the earlier moment is before the later one, at least 1
    pub frames_back: u32,
    /// where it was then, pixels
    pub before: Vector2<f64>,
    /// where it is now, pixels
    pub now: Vector2<f64>,
}
