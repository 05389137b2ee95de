use model::counted;

/// Why a body model could not be made of what was given, or a body not written.
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
    #[error("found {} to learn from, expected at least 2", counted(found, "scan"))]
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
    /// A file of scans can't be read.
    #[error("{file}: {source}")]
    File {
        /// its name
        file: String,
        /// where and what
        source: formats::Error,
    },
    /// A rig, or what belongs to it, is not one.
    #[error("{file}: {source}")]
    RigFile {
        /// name of the file
        file: String,
        /// what is wrong with it
        source: Box<Error>,
    },
    /// A file holds something else than it should.
    #[error("{file}: found {found}, expected {expected}")]
    Content {
        /// its name
        file: String,
        /// what is in it
        found: String,
        /// what should be
        expected: String,
    },
    /// There is nothing to learn from, or too much of it.
    #[error("found {found}, expected {expected}")]
    ScanSet {
        /// what there is
        found: String,
        /// what there should be
        expected: String,
    },
    /// A body that GLB can't hold.
    #[error("no GLB can be made: {0}")]
    Glb(formats::Error),
}

impl Error {
    pub(crate) fn content(file: &str, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Content { file: file.to_owned(), found: found.into(), expected: expected.into() }
    }

    pub(crate) fn in_file(file: &str) -> impl Fn(formats::Error) -> Self {
        move |source| Self::File { file: file.to_owned(), source }
    }

    pub(crate) fn in_rig(file: &str) -> impl Fn(Self) -> Self {
        move |source| Self::RigFile { file: file.to_owned(), source: Box::new(source) }
    }
}
