/// Why recordings give no training poses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A recording that the body can't follow.
    #[error("{name}: {source}")]
    Recording {
        /// name of the recording
        name: String,
        /// what is wrong
        source: inverse_kinematics::Error,
    },
    /// Poses of a database that make no motion.
    #[error("{name}: {source}")]
    Motion {
        /// name of the clip
        name: String,
        /// what is wrong
        source: model::Error,
    },
    /// Fewer poses than were asked for.
    #[error("the recordings have {found} poses, {every} seconds apart, expected at least {expected}")]
    TooFew {
        /// poses found
        found: usize,
        /// seconds from one to the next
        every: f64,
        /// poses asked for
        expected: usize,
    },
}
