use model::counted;

/// Why feet cannot be held.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A joint or bone end that should be a foot's.
    #[error(
        "skeleton {skeleton} has no {side} ankle with a foot below it, expected one of the names of a known rig"
    )]
    NoFoot {
        /// name of the skeleton
        skeleton: String,
        /// left or right
        side: &'static str,
    },
    /// Trajectories of other frames than the motion's.
    #[error("found {} of control points, the motion has {expected}", counted(found, "frame"))]
    Frames {
        /// frames found
        found: usize,
        /// frames of the motion
        expected: usize,
    },
    /// The result is not a motion.
    #[error(transparent)]
    Model(#[from] model::Error),
}
