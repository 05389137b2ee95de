//! Where the store is.

use crate::Error;
use std::{
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
};

/// Where objects are kept: `/data/objects`, `file:///data/objects` or `s3://bucket/prefix`.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Location {
    /// A folder; several processes and machines may share it.
    Folder(PathBuf),
    /// An S3 bucket. Understood, but no build has the backend yet: [`crate::Store::open`] refuses it.
    S3 {
        /// The bucket's name.
        bucket: String,
        /// Prefix of all keys, without slashes at its ends; may be empty.
        prefix: String,
    },
}

impl Location {
    /// A folder as location.
    pub fn folder(path: impl AsRef<Path>) -> Self {
        Self::Folder(path.as_ref().to_owned())
    }
}

impl FromStr for Location {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let bad = || Error::BadLocation { found: text.to_owned() };
        if let Some(rest) = text.strip_prefix("s3://") {
            let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
            if bucket.is_empty() {
                return Err(bad());
            }
            return Ok(Self::S3 { bucket: bucket.to_owned(), prefix: prefix.trim_matches('/').to_owned() });
        }
        let path = text.strip_prefix("file://").unwrap_or(text);
        if path.is_empty() || path.contains("://") {
            return Err(bad());
        }
        Ok(Self::Folder(PathBuf::from(path)))
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder(path) => write!(f, "file://{}", path.display()),
            Self::S3 { bucket, prefix } => write!(f, "s3://{bucket}/{prefix}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_urls_are_told_apart() {
        assert_eq!("objects".parse::<Location>().unwrap(), Location::folder("objects"));
        assert_eq!("file:///data/o".parse::<Location>().unwrap(), Location::folder("/data/o"));
        let s3 = Location::S3 { bucket: "b".into(), prefix: "p/q".into() };
        assert_eq!("s3://b/p/q/".parse::<Location>().unwrap(), s3);
        assert!("http://x".parse::<Location>().is_err());
        assert!("s3://".parse::<Location>().is_err());
        assert!("".parse::<Location>().is_err());
    }
}
