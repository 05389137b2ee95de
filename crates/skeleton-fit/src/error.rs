use model::counted;

/// Why no skeleton can be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A control point on a joint that the database's skeleton does not have.
    #[error("control point {name} is on joint {joint}, expected one of {joints} joints")]
    Point {
        /// the point
        name: String,
        /// index of its joint
        joint: usize,
        /// joints there are
        joints: usize,
    },
    /// Trajectories of other points than those given.
    #[error("found trajectories of {}, expected {expected}", counted(found, "point"))]
    Trajectories {
        /// number found
        found: usize,
        /// number of control points
        expected: usize,
    },
    /// Nothing to compare with.
    #[error(
        "found no span of {frames} frames with at least two measured points, or no database clip of that many frames"
    )]
    NothingToCompare {
        /// length of a span, frames
        frames: usize,
    },
    /// The skeleton refuses.
    #[error(transparent)]
    Model(#[from] model::Error),
}
