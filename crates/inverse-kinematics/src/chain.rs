use kinematics::{ControlPoint, Kinematics, Parametrisation, PointSet};
use model::Skeleton;

use crate::{Error, Result};

/// A skeleton made ready for inverse kinematics: its points, the segments between them that images show, and limits.
#[derive(Debug, Clone)]
pub struct Chain {
    pub(crate) kinematics: Kinematics,
    pub(crate) points: PointSet,
    /// pairs of points
    pub(crate) segments: Vec<[usize; 2]>,
    /// lowest and highest value of every coordinate
    pub(crate) limits: Vec<[f64; 2]>,
    /// of the image support at each point, relative
    pub(crate) widths: Vec<f64>,
}

impl Chain {
    /// A chain without segments and without limits, in the coordinates of `parametrisation`.
    ///
    /// # Errors
    /// [`Error::Count`] if there are no points.
    pub fn new(
        skeleton: &Skeleton,
        parametrisation: Parametrisation,
        points: Vec<ControlPoint>,
    ) -> Result<Self> {
        if points.is_empty() {
            return Err(Error::Count { what: "points", found: 0, expected: 1 });
        }
        let kinematics = Kinematics::new(skeleton, parametrisation);
        let points = PointSet::new(&kinematics, points);
        let limits = vec![[f64::NEG_INFINITY, f64::INFINITY]; kinematics.num_dofs()];
        let widths = vec![1.0; points.len()];
        Ok(Self { kinematics, points, segments: Vec::new(), limits, widths })
    }

    /// The same chain with straight segments between pairs of its points, which the overlap with images is taken along.
    ///
    /// # Errors
    /// [`Error::UnknownPoint`] if a point is not there.
    pub fn with_segments(mut self, segments: Vec<[usize; 2]>) -> Result<Self> {
        let points = self.points.len();
        if let Some(&point) = segments.iter().flatten().find(|&&point| point >= points) {
            return Err(Error::UnknownPoint { what: "a segment", point, points });
        }
        self.segments = segments;
        Ok(self)
    }

    /// The same chain with flesh of different widths: by how much the image support's slope inside is wider at each point than
    /// [`crate::SupportWidth`] has it, shape `[points]`.
    ///
    /// # Errors
    /// [`Error::Count`] or [`Error::Setting`] with the first that is wrong.
    pub fn with_widths(mut self, widths: Vec<f64>) -> Result<Self> {
        let (found, expected) = (widths.len(), self.points.len());
        if found != expected {
            return Err(Error::Count { what: "widths", found, expected });
        }
        if let Some(&value) = widths.iter().find(|&&width| !(width > 0.0 && width.is_finite())) {
            return Err(Error::Setting { name: "width of a point", value, expected: "a positive number" });
        }
        self.widths = widths;
        Ok(self)
    }

    /// The same chain with limits, metres and radians, shape `[dofs]`. Where both are the same number, the coordinate is
    /// locked: it keeps the value it is given.
    ///
    /// # Errors
    /// [`Error::Count`] or [`Error::Limits`] with the first that is wrong.
    pub fn with_limits(mut self, limits: Vec<[f64; 2]>) -> Result<Self> {
        let (found, expected) = (limits.len(), self.num_dofs());
        if found != expected {
            return Err(Error::Count { what: "limits", found, expected });
        }
        for (dof, &[low, high]) in limits.iter().enumerate() {
            if low.is_nan() || high.is_nan() || low > high {
                return Err(Error::Limits { dof, low, high });
            }
        }
        self.limits = limits;
        Ok(self)
    }

    /// Forward kinematics of the chain.
    pub fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// The points: end effectors and ends of segments.
    pub fn points(&self) -> &PointSet {
        &self.points
    }

    /// Number of coordinates.
    pub fn num_dofs(&self) -> usize {
        self.kinematics.num_dofs()
    }

    /// Limits of the coordinates, metres and radians, shape `[dofs]`.
    pub fn limits(&self) -> &[[f64; 2]] {
        &self.limits
    }
}
