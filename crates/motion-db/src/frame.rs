use kinematics::HEADING;
use nalgebra::Vector3;

/// The frame that stands on the floor under a root and looks where it looks (docs/papers.md#heading-frame).
///
/// `world_from_local`: turn by `heading` about y, then shift by (x, 0, z). Heights are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingFrame {
    /// horizontal position, metres
    pub x: f64,
    /// horizontal position, metres
    pub z: f64,
    /// heading, radians, counter-clockwise about y
    pub heading: f64,
    sin: f64,
    cos: f64,
}

impl HeadingFrame {
    /// A frame at (x, z), metres, with a heading in radians.
    pub fn new(x: f64, z: f64, heading: f64) -> Self {
        let (sin, cos) = heading.sin_cos();
        Self { x, z, heading, sin, cos }
    }

    /// The frame of a pose in smooth coordinates, shape `[dofs]`.
    pub fn from_coordinates(coordinates: &[f64]) -> Self {
        Self::new(coordinates[0], coordinates[2], coordinates[HEADING])
    }

    /// A world point (metres) in this frame.
    pub fn local_from_world(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let (dx, dz) = (p.x - self.x, p.z - self.z);
        Vector3::new(self.cos * dx - self.sin * dz, p.y, self.sin * dx + self.cos * dz)
    }

    /// A point of this frame (metres) in the world.
    pub fn world_from_local(&self, p: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.x + self.cos * p.x + self.sin * p.z, p.y, self.z - self.sin * p.x + self.cos * p.z)
    }

    /// Writes world coordinates, shape `[dofs]`, relative to this frame into `out`.
    pub fn relative(&self, coordinates: &[f64], out: &mut [f64]) {
        out.copy_from_slice(coordinates);
        let root = self.local_from_world(&Vector3::new(coordinates[0], 0.0, coordinates[2]));
        (out[0], out[2], out[HEADING]) = (root.x, root.z, coordinates[HEADING] - self.heading);
    }

    /// Puts coordinates relative to this frame back into the world, in place.
    pub fn absolute(&self, coordinates: &mut [f64]) {
        let root = self.world_from_local(&Vector3::new(coordinates[0], 0.0, coordinates[2]));
        (coordinates[0], coordinates[2]) = (root.x, root.z);
        coordinates[HEADING] += self.heading;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absolute_undoes_relative() {
        let frame = HeadingFrame::new(1.0, -2.0, 2.5);
        let world = [0.3, 0.9, 0.4, 5.0, 0.1, 0.2, 7.0];
        let mut local = [0.0; 7];
        frame.relative(&world, &mut local);
        let mut back = local;
        frame.absolute(&mut back);
        for (a, b) in back.iter().zip(world) {
            assert!((a - b).abs() < 1e-12);
        }
        let p = Vector3::new(0.3, 1.0, 0.4);
        assert!((frame.world_from_local(&frame.local_from_world(&p)) - p).norm() < 1e-12);
    }

    #[test]
    fn heading_frames_agree_with_rotations_about_y() {
        let frame = HeadingFrame::new(0.0, 0.0, 0.7);
        let p = Vector3::new(0.2, 0.5, -1.0);
        let rotation = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), 0.7);
        assert!((frame.world_from_local(&p) - rotation * p).norm() < 1e-12);
    }
}
