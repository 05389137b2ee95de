/// Why a skeleton or a control point cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The root must be free to move for a motion to be put anywhere on the floor.
    #[error("root {joint} has channels {channels}, expected three translations and three rotations")]
    RootNotFree {
        /// name of the root
        joint: String,
        /// its channels
        channels: String,
    },
    /// No joint or standard point has that name.
    #[error("the skeleton has no {name:?}; use {known}")]
    UnknownPoint {
        /// the name asked for
        name: String,
        /// valid names
        known: String,
    },
    /// A pose of the wrong length.
    #[error("pose has {found} DOFs, skeleton has {expected}")]
    DofMismatch {
        /// numbers in the pose
        found: usize,
        /// DOFs of the skeleton
        expected: usize,
    },
}
