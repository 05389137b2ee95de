use model::{counted, shown};

/// Why nothing could be tracked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A pose of another rig.
    #[error(
        "the pose has {}, expected {expected}, the DOFs of the rig, all finite",
        counted(found, "number")
    )]
    Pose {
        /// numbers of the pose
        found: usize,
        /// DOFs of the rig
        expected: usize,
    },
    /// A shape of another model.
    #[error("the shape has {found} coefficients, expected at most {expected}, all finite")]
    Shape {
        /// coefficients given
        found: usize,
        /// components of the model
        expected: usize,
    },
    /// Training poses that no prior can be made of.
    #[error(
        "{found} training poses, expected at least {least}, of {dofs} finite numbers each, not all alike"
    )]
    TrainingPoses {
        /// poses given
        found: usize,
        /// poses needed
        least: usize,
        /// DOFs of the rig
        dofs: usize,
    },
    /// Settings that make no search.
    #[error("{what} is {}, expected {expected}", shown(*found))]
    Option {
        /// which setting
        what: &'static str,
        /// its value
        found: f64,
        /// what is valid
        expected: &'static str,
    },
    /// A silhouette or a calibration that can't be used.
    #[error("frame {frame}: {source}")]
    View {
        /// index of the frame
        frame: usize,
        /// what is wrong
        source: shape_fit::Error,
    },
    /// Chunks that don't follow one another.
    #[error(
        "chunk {index} begins with frame {found}, expected at most {expected}, the end of the chunk before it"
    )]
    Gap {
        /// index of the chunk
        index: usize,
        /// its first frame
        found: usize,
        /// where the chunk before it ends
        expected: usize,
    },
    /// Bytes that are not a file of tracked frames.
    #[error("not a file of tracked frames: {found}")]
    File {
        /// what is wrong with it
        found: String,
    },
    /// Who called wanted no more.
    #[error("stopped in frame {frame}")]
    Stopped {
        /// the frame that was worked on
        frame: usize,
    },
}
