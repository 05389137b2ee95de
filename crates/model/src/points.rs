use nalgebra::Vector3;

use crate::{Error, Result};

/// Trajectories of named points: markers or control points.
#[derive(Debug, Clone, PartialEq)]
pub struct PointTrajectories {
    names: Vec<String>,
    frame_rate: f64,
    positions: Vec<Vector3<f64>>,
}

impl PointTrajectories {
    /// `positions`: metres in the world (y up), row-major, shape `[frames, points]`; a sample that was not
    /// measured is NaN in all three coordinates (a sample with any coordinate that is not finite becomes so).
    ///
    /// # Errors
    /// If the number of positions is not a multiple of the number of names, or the rate is not positive.
    pub fn new(names: Vec<String>, frame_rate: f64, mut positions: Vec<Vector3<f64>>) -> Result<Self> {
        if !(frame_rate.is_finite() && frame_rate > 0.0) {
            return Err(Error::FrameRate { found: frame_rate });
        }
        if names.is_empty() && !positions.is_empty()
            || !names.is_empty() && !positions.len().is_multiple_of(names.len())
        {
            return Err(Error::PositionCount { positions: positions.len(), points: names.len() });
        }
        for p in &mut positions {
            if !p.iter().all(|v| v.is_finite()) {
                *p = Vector3::repeat(f64::NAN);
            }
        }
        Ok(Self { names, frame_rate, positions })
    }

    /// Names of the points.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of points.
    pub fn num_points(&self) -> usize {
        self.names.len()
    }

    /// Frames per second.
    pub fn frame_rate(&self) -> f64 {
        self.frame_rate
    }

    /// Number of frames.
    pub fn num_frames(&self) -> usize {
        self.positions.len().checked_div(self.names.len()).unwrap_or(0)
    }

    /// Position in metres, `None` where it was not measured.
    pub fn position(&self, frame: usize, point: usize) -> Option<Vector3<f64>> {
        let p = self.positions[frame * self.names.len() + point];
        p.x.is_finite().then_some(p)
    }

    /// Positions of a frame, metres, shape `[points]`; NaN where not measured.
    pub fn frame(&self, frame: usize) -> &[Vector3<f64>] {
        let n = self.names.len();
        &self.positions[frame * n..(frame + 1) * n]
    }

    /// Index of the point of that name.
    pub fn point_index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }
}
