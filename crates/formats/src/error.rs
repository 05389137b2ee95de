use std::fmt;

/// Where in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// line of a text file, from 1
    Line(usize),
    /// offset in a binary file, bytes from 0
    Byte(u64),
    /// the file as a whole
    File,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(offset) => write!(f, "byte {offset}"),
            Self::File => f.write_str("file"),
        }
    }
}

/// Why a file could not be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file says something else than the format allows.
    #[error("{place}: found {found}, expected {expected}")]
    Unexpected {
        /// where
        place: Place,
        /// what is there
        found: String,
        /// what is valid there
        expected: String,
    },
    /// What the file says does not make a skeleton, a motion or trajectories.
    #[error("{place}: {source}")]
    Model {
        /// where
        place: Place,
        /// what is wrong with it
        source: model::Error,
    },
    /// An archive or a compressed file that can't be unpacked.
    #[error("{format} is damaged: {message}")]
    Damaged {
        /// what it is
        format: &'static str,
        /// what is wrong with it
        message: String,
    },
    /// An archive has more of something than is allowed.
    #[error("archive has more than {limit} {what}")]
    Limit {
        /// of what
        what: &'static str,
        /// how many are allowed
        limit: u64,
    },
    /// A file of several could not be read.
    #[error("{file}: {source}")]
    InFile {
        /// name of the file
        file: String,
        /// what is wrong with it
        source: Box<Error>,
    },
}

impl Error {
    pub(crate) fn at_line(line: usize, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Unexpected { place: Place::Line(line), found: found.into(), expected: expected.into() }
    }

    pub(crate) fn whole_file(found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Unexpected { place: Place::File, found: found.into(), expected: expected.into() }
    }

    pub(crate) fn in_file(self, file: impl Into<String>) -> Self {
        Self::InFile { file: file.into(), source: Box::new(self) }
    }
}

/// [`Error::Unexpected`] at an offset of a binary file.
pub(crate) fn at_byte(offset: u64, found: impl Into<String>, expected: impl Into<String>) -> Error {
    Error::Unexpected { place: Place::Byte(offset), found: found.into(), expected: expected.into() }
}

impl From<model::Error> for Error {
    fn from(source: model::Error) -> Self {
        Self::Model { place: Place::File, source }
    }
}
