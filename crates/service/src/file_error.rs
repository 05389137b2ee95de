use formats::FileRole;

/// What is wrong with a file or a field, whatever service finds it. The message is for the owner of the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// A file can't be read.
    #[error("{file}: {source}")]
    File {
        /// Name of the file.
        file: String,
        /// Where and what.
        source: formats::Error,
    },
    /// Something else than there should be.
    #[error("{what}: found {found}, expected {expected}")]
    Unexpected {
        /// The file, camera or field.
        what: String,
        /// What there is.
        found: String,
        /// What should be.
        expected: String,
    },
    /// A role that must be filled, and isn't.
    #[error("the session has {} ({}); one is needed", role.counted(0), role.endings())]
    Missing {
        /// The role.
        role: FileRole,
    },
    /// A role that must be filled once, and is more often.
    #[error("{}", role.keep_one(&names.iter().map(String::as_str).collect::<Vec<_>>()))]
    Several {
        /// The role.
        role: FileRole,
        /// Names of the files.
        names: Vec<String>,
    },
}

impl FileError {
    /// Makes what a reader found wrong an error of that file.
    pub fn in_file(file: &str) -> impl Fn(formats::Error) -> Self {
        move |source| Self::File { file: file.to_owned(), source }
    }

    /// [`Unexpected`](Self::Unexpected).
    pub fn unexpected(
        what: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Unexpected { what: what.into(), found: found.into(), expected: expected.into() }
    }
}
