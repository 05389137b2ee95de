/// Why files do not make a body model, or a body no file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file can't be read.
    #[error("{file}: {source}")]
    File {
        /// its name
        file: String,
        /// where and what
        source: formats::Error,
    },
    /// A rig, or what belongs to it, is not one.
    #[error("{file}: {source}")]
    Rig {
        /// name of the file
        file: String,
        /// what is wrong with it
        source: body::Error,
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
    Set {
        /// what there is
        found: String,
        /// what there should be
        expected: String,
    },
    /// Scans, template or model that don't fit each other.
    #[error(transparent)]
    Body(#[from] body::Error),
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

    pub(crate) fn in_rig(file: &str) -> impl Fn(body::Error) -> Self {
        move |source| Self::Rig { file: file.to_owned(), source }
    }
}
