/// Why a model cannot be trained or read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A training option out of range.
    #[error("{name} is {found}, expected {expected}")]
    Option {
        /// name of the option
        name: &'static str,
        /// value found
        found: usize,
        /// what is valid
        expected: &'static str,
    },
    /// A training set whose numbers do not fit together.
    #[error(
        "training set has {found} numbers, expected {expected}: the same number of poses and velocities of {dofs} numbers"
    )]
    Shape {
        /// numbers found
        found: usize,
        /// numbers expected
        expected: usize,
        /// numbers of a pose
        dofs: usize,
    },
    /// Too few poses to learn from.
    #[error("found {found} poses with motion before them, expected at least {expected}")]
    TooFew {
        /// poses found
        found: usize,
        /// fewest needed
        expected: usize,
    },
    /// A number that is not finite.
    #[error("number {index} of the training set is {found}, expected a finite number")]
    NotFinite {
        /// which
        index: usize,
        /// what it is
        found: f64,
    },
    /// The covariance of the active set has no inverse.
    #[error("covariance of the {active} active poses cannot be inverted")]
    Singular {
        /// size of the active set
        active: usize,
    },
    /// The caller asked to stop.
    #[error("stopped after {iterations} of {total} steps")]
    Stopped {
        /// steps done
        iterations: usize,
        /// steps planned
        total: usize,
    },
    /// Bytes that are not a trained model.
    #[error("not a trained latent variable model: {found}")]
    Bytes {
        /// what was found
        found: String,
    },
}
