use crate::{Error, Result};

/// Fewest poses that a model is learned from.
const FEWEST_POSES: usize = 16;

/// Poses to learn from. Units are the targets' (degrees and centimetres), relative to the heading frame of the pose
/// before.
#[derive(Debug, Clone, Default)]
pub struct TrainingSet {
    /// numbers of a pose, D
    pub dofs: usize,
    /// row-major, shape `[poses, dofs]`
    pub poses: Vec<f64>,
    /// what each pose differs by from the one before, row-major, shape `[poses, dofs]`. Columns of zeros are left out
    /// of the model
    pub velocities: Vec<f64>,
}

impl TrainingSet {
    /// Number of poses.
    pub fn len(&self) -> usize {
        self.poses.len().checked_div(self.dofs).unwrap_or(0)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Checks shapes and numbers.
    pub(super) fn check(&self) -> Result<()> {
        let expected = self.len() * self.dofs;
        for found in [self.poses.len(), self.velocities.len()] {
            if found != expected {
                return Err(Error::Shape { found, expected, dofs: self.dofs });
            }
        }
        if self.len() < FEWEST_POSES {
            return Err(Error::TooFew { found: self.len(), expected: FEWEST_POSES });
        }
        let mut numbers = self.poses.iter().chain(&self.velocities).enumerate();
        match numbers.find(|(_, v)| !v.is_finite()) {
            Some((index, &found)) => Err(Error::NotFinite { index, found }),
            None => Ok(()),
        }
    }
}
