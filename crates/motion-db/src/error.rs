use model::{counted, shown};

/// Why a database cannot be built, read or asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Nothing to build from.
    #[error("found no clip of at least {min_frames} frames at 60 frames a second")]
    NoMotion {
        /// shortest useful clip
        min_frames: usize,
    },
    /// Clips must share joints and channels.
    #[error(
        "clip {clip} has another skeleton than clip {first}: {difference}; expected the same joints and channels"
    )]
    SkeletonMismatch {
        /// the clip that differs
        clip: String,
        /// the first clip
        first: String,
        /// the first difference found
        difference: String,
    },
    /// A skeleton that cannot move freely.
    #[error("skeleton of clip {clip}: {source}")]
    Skeleton {
        /// the clip
        clip: String,
        /// what is wrong
        source: kinematics::Error,
    },
    /// Two parts of a database whose numbers mean different poses.
    #[error("the parts of a motion database have different coordinates, expected those of one build")]
    OtherCoordinates,
    /// A skeleton whose left and right are not mirror images.
    #[error("joint {joint} cannot be mirrored: {reason}")]
    Mirror {
        /// the joint
        joint: String,
        /// what is wrong
        reason: String,
    },
    /// A speed that motion cannot be played at.
    #[error("speed is {}, expected 1/{max} to {max} times the recorded one", shown(*found))]
    Speed {
        /// speed asked for
        found: f64,
        /// largest
        max: f64,
    },
    /// The database would not fit in memory.
    #[error("found {poses} poses, expected at most {limit}")]
    TooLarge {
        /// poses found
        poses: usize,
        /// largest number taken
        limit: usize,
    },
    /// The bytes are not an index file.
    #[error("not a motion database: {found} at byte {offset}, expected {expected}")]
    File {
        /// what was found
        found: String,
        /// where
        offset: usize,
        /// what should have been there
        expected: String,
    },
    /// The file was written by another version.
    #[error(
        "motion database has format version {found}, expected {expected}: build it again from its motion files"
    )]
    Version {
        /// version in the file
        found: u32,
        /// version of this program
        expected: u32,
    },
    /// The bytes were changed after they were written.
    #[error("motion database is damaged: its {part} has checksum {found}, expected {expected}")]
    Checksum {
        /// which part of it
        part: String,
        /// checksum of the part
        found: String,
        /// checksum in the file
        expected: String,
    },
    /// The index file could not be written.
    #[error("motion database cannot be written: {reason}")]
    Write {
        /// what the writer said
        reason: String,
    },
    /// A window of a length that the database cannot have.
    #[error("window is {}, expected 1 to {max}", counted(found, "frame"))]
    Window {
        /// length asked for
        found: usize,
        /// longest
        max: usize,
    },
    /// A coordinate that no person can have.
    #[error(
        "clip {clip}: coordinate {dof} of frame {frame} (60 a second) is {}, expected at most 10000 metres \
         or radians",
        shown(*found)
    )]
    Value {
        /// name of the clip
        clip: String,
        /// frame after resampling, from 0
        frame: usize,
        /// smooth coordinate, from 0
        dof: usize,
        /// its value
        found: f64,
    },
}
