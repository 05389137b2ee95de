/// Why a body model could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A rig that can't be.
    #[error("rig: {what}")]
    Rig {
        /// what was found and what was expected
        what: String,
    },
    /// Joints that can't be computed from the vertices.
    #[error("joint regressor: {what}")]
    Regressor {
        /// what was found and what was expected
        what: String,
    },
    /// A skin that doesn't fit mesh and rig.
    #[error("skin: {what}")]
    Skin {
        /// what was found and what was expected
        what: String,
    },
    /// Parts that don't make a model.
    #[error("body model: {what}")]
    Model {
        /// what was found and what was expected
        what: String,
    },
    /// A template that nothing can be learned with.
    #[error("template: {what}")]
    Template {
        /// what was found and what was expected
        what: String,
    },
    /// A scan that is not what it should be.
    #[error("scan {name}: {what}")]
    Scan {
        /// name of the scan: its file
        name: String,
        /// what was found and what was expected
        what: String,
    },
    /// A population needs at least two bodies.
    #[error("{found} scans to learn from, expected at least 2")]
    TooFewScans {
        /// scans found
        found: usize,
    },
    /// Measurements that no body of the model has.
    #[error("{what}")]
    Wanted {
        /// what was asked for and what is possible
        what: String,
    },
    /// A file of another version of the format.
    #[error("body model file has version {found}, expected {expected}")]
    Version {
        /// version found
        found: u32,
        /// version that is read
        expected: u32,
    },
    /// A file that is damaged, cut off, or not a body model.
    #[error("not a body model file: {what}")]
    BadFile {
        /// what was found and what was expected
        what: String,
    },
    /// A body's skeleton or motion that can't be.
    #[error(transparent)]
    Motion(#[from] model::Error),
}
