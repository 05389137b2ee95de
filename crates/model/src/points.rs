use nalgebra::Vector3;

use crate::{Error, Result};

/// Trajectories of named points: markers or control points.
#[derive(Debug, Clone, PartialEq)]
pub struct PointTrajectories {
    names: Vec<String>,
    frame_rate: f64,
    positions: Vec<Vector3<f64>>,
    /// metres, shape `[frames, points]`, NaN where unknown; empty where none is known
    sigmas: Vec<f64>,
}

/// What was measured of all points in one frame.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// metres in the world, shape `[points]`; NaN where not measured
    pub positions: &'a [Vector3<f64>],
    /// standard deviation of each coordinate, metres, shape `[points]`; NaN where unknown; empty where none is known
    pub sigmas: &'a [f64],
}

impl Samples<'_> {
    /// Standard deviation of each coordinate of a point, metres; `None` where unknown.
    pub fn sigma(&self, point: usize) -> Option<f64> {
        self.sigmas.get(point).copied().filter(|s| s.is_finite())
    }
}

impl<'a> From<&'a [Vector3<f64>]> for Samples<'a> {
    fn from(positions: &'a [Vector3<f64>]) -> Self {
        Self { positions, sigmas: &[] }
    }
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
        Ok(Self { names, frame_rate, positions, sigmas: Vec::new() })
    }

    /// The same with the standard deviation of each sample: `sigmas` in metres, of each coordinate, row-major, shape
    /// `[frames, points]`; NaN, or no numbers at all, where it is unknown.
    ///
    /// # Errors
    /// If there is another number of them than of positions, or one is not positive.
    pub fn with_sigmas(mut self, sigmas: Vec<f64>) -> Result<Self> {
        if !sigmas.is_empty() && sigmas.len() != self.positions.len() {
            return Err(Error::SigmaCount { sigmas: sigmas.len(), positions: self.positions.len() });
        }
        if let Some(at) = sigmas.iter().position(|s| !(s.is_nan() || s.is_finite() && *s > 0.0)) {
            let points = self.names.len().max(1);
            let point = self.names[at % points].clone();
            return Err(Error::Sigma { frame: at / points, point, found: sigmas[at] });
        }
        self.sigmas = if sigmas.iter().all(|s| s.is_nan()) { Vec::new() } else { sigmas };
        Ok(self)
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

    /// Positions of a frame and how sure they are.
    pub fn samples(&self, frame: usize) -> Samples<'_> {
        let n = self.names.len();
        let sigmas = self.sigmas.get(frame * n..(frame + 1) * n).unwrap_or_default();
        Samples { positions: self.frame(frame), sigmas }
    }

    /// Whether the standard deviation of any sample is known.
    pub fn has_sigmas(&self) -> bool {
        !self.sigmas.is_empty()
    }

    /// Standard deviation of each coordinate of a sample, metres; `None` where it is unknown.
    pub fn sigma(&self, frame: usize, point: usize) -> Option<f64> {
        self.samples(frame).sigma(point)
    }

    /// Standard deviations of all samples, metres, row-major, shape `[frames, points]`, NaN where unknown; empty where
    /// none is known.
    pub fn sigmas(&self) -> &[f64] {
        &self.sigmas
    }

    /// The same trajectories under other names, one for each point.
    ///
    /// # Errors
    /// If the number of names is another.
    pub fn renamed(self, names: Vec<String>) -> Result<Self> {
        if names.len() != self.names.len() {
            return Err(Error::PositionCount { positions: self.positions.len(), points: names.len() });
        }
        Ok(Self { names, ..self })
    }

    /// Index of the point of that name.
    pub fn point_index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_frames_of_two() -> PointTrajectories {
        let positions = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::repeat(f64::NAN)];
        PointTrajectories::new(vec!["a".into(), "b".into()], 60.0, positions).unwrap()
    }

    #[test]
    fn a_sigma_is_known_where_it_was_said() {
        let points = two_frames_of_two();
        assert_eq!((points.sigma(1, 0), points.samples(0).sigma(1)), (None, None));
        let points = points.with_sigmas(vec![f64::NAN, 0.01, 0.02, f64::NAN]).unwrap();
        assert_eq!(
            (points.sigma(0, 0), points.sigma(0, 1), points.sigma(1, 0)),
            (None, Some(0.01), Some(0.02))
        );
        assert!(!points.with_sigmas(vec![f64::NAN; 4]).unwrap().has_sigmas());
    }

    #[test]
    fn sigmas_that_make_no_sense_are_refused_with_the_place() {
        let refused = |sigmas| two_frames_of_two().with_sigmas(sigmas).unwrap_err().to_string();
        assert_eq!(refused(vec![0.1]), "found 1 standard deviations, expected one for each of 4 positions");
        for bad in [0.0, -1.0, f64::INFINITY] {
            let message = refused(vec![0.1, 0.1, 0.1, bad]);
            assert_eq!(
                message,
                format!("frame 1, point b has a standard deviation of {bad} m, expected a positive number")
            );
        }
    }
}
