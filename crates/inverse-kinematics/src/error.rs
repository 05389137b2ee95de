use model::shown;

/// Why a chain or a problem cannot be solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A list of the wrong length.
    #[error("found {found} {what}, the chain has {expected}")]
    Count {
        /// what was counted
        what: &'static str,
        /// how many there are
        found: usize,
        /// how many there should be
        expected: usize,
    },
    /// A figure of which nothing is measured.
    #[error("there is no measured point to reach, expected at least one")]
    NoPoints,
    /// A point that is not there.
    #[error("{what} names point {point}, the chain has {points}")]
    UnknownPoint {
        /// who names it
        what: &'static str,
        /// the point named
        point: usize,
        /// number of points
        points: usize,
    },
    /// Limits that leave no value.
    #[error("limits of coordinate {dof} are {low} to {high}, expected low <= high")]
    Limits {
        /// index of the coordinate
        dof: usize,
        /// lowest value
        low: f64,
        /// highest value
        high: f64,
    },
    /// A setting out of range.
    #[error("{name} is {}, expected {expected}", shown(*value))]
    Setting {
        /// name of the setting
        name: &'static str,
        /// its value
        value: f64,
        /// what is valid
        expected: &'static str,
    },
    /// Coordinates that are not finite.
    #[error("coordinate {dof} is {value}, expected a finite number")]
    NotFinite {
        /// index of the coordinate
        dof: usize,
        /// its value
        value: f64,
    },
    /// A skeleton that cannot be made.
    #[error(transparent)]
    Skeleton(#[from] model::Error),
    /// Coordinates or points that the skeleton has not.
    #[error(transparent)]
    Kinematics(#[from] kinematics::Error),
}
