use crate::Action;

/// Why a model could not be learned, read or drawn from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Not one of the four actions.
    #[error("action is {found:?}, expected walk, run, jump or boxing")]
    UnknownAction {
        /// the name found
        found: String,
    },
    /// The model holds nothing of that action.
    #[error("the model has no movement for action {action}")]
    ActionNotLearned {
        /// the action asked for
        action: Action,
    },
    /// A drawn motion must fit in memory.
    #[error("asked for {found} frames, expected at most {most}")]
    TooManyFrames {
        /// frames asked for
        found: usize,
        /// the limit
        most: usize,
    },
    /// There is nothing to learn from.
    #[error("no motions to learn from")]
    NoMotions,
    /// Too few cycles or events were found to speak of a mean and a variation.
    #[error("found {found} segments of {movement} in {motions} motions, expected at least {least}")]
    TooFewSegments {
        /// name of the movement
        movement: String,
        /// segments found
        found: usize,
        /// motions searched
        motions: usize,
        /// the least number that will do
        least: usize,
    },
    /// A motion is not on a skeleton of the CMU structure, or not on the same one as the first motion.
    #[error("motion {motion}: {reason}")]
    Skeleton {
        /// name of the motion
        motion: String,
        /// what is wrong with its skeleton
        reason: String,
    },
    /// The bytes are not a model file.
    #[error("not a sample-motion model: {reason}")]
    BadFile {
        /// what was found, where, and what was expected
        reason: String,
    },
    /// The model file is of another version.
    #[error("sample-motion model has version {found}, expected {expected}")]
    Version {
        /// version of the file
        found: u32,
        /// version this program reads
        expected: u32,
    },
    /// A skeleton or a motion could not be made.
    #[error(transparent)]
    Model(#[from] model::Error),
    /// The skeleton has no free root.
    #[error(transparent)]
    Kinematics(#[from] kinematics::Error),
}
