//! Names of objects. Everything written anywhere is named by one of the functions here.
//!
//! ```text
//! files/{project}/{session}/{file}                 an upload
//! runs/{run}/{job}/{lease}/{name}                  an artefact or result of a job
//! motion-databases/{database}/inputs/{file}        an upload for a motion database
//! motion-databases/{database}/{job}/{lease}/{name} an index file, list of them or model that a job made
//! body-models/{model}/inputs/{file}                an upload for a body model
//! body-models/{model}/{job}/{lease}/{name}         a body model that a job made
//! ```
//!
//! What jobs write contains the lease number of the claim that wrote it, so a worker that lost its lease
//! can never overwrite what its successor wrote.

use crate::Error;
use std::{fmt, str::FromStr};
use uuid::Uuid;

/// The name of an object: parts of letters, digits and `-_.+`, separated by `/`.
///
/// A key made from untrusted text ([`FromStr`]) can't leave the store's folder or name a hidden file.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key(String);

/// Longest key, bytes. S3 allows 1024; file systems allow 255 for a part.
const MAX_KEY_BYTES: usize = 512;
const MAX_PART_BYTES: usize = 200;

impl Key {
    /// The key as text, as it is recorded in PostgreSQL.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    pub(crate) fn path(&self) -> object_store::path::Path {
        object_store::path::Path::from(self.0.as_str())
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<Key> for String {
    fn from(key: Key) -> Self {
        key.0
    }
}

impl FromStr for Key {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let good = |part: &str| {
            !part.is_empty()
                && part.len() <= MAX_PART_BYTES
                && !part.starts_with('.')
                && part.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_.+".contains(&b))
        };
        if text.len() <= MAX_KEY_BYTES && text.split('/').all(good) {
            Ok(Self(text.to_owned()))
        } else {
            Err(Error::BadKey { found: text.chars().take(80).collect() })
        }
    }
}

/// An uploaded file of a capture session.
pub fn file(project: Uuid, session: Uuid, file: Uuid) -> Key {
    Key(format!("files/{project}/{session}/{file}"))
}

/// An uploaded file that a motion database is to be built from.
pub fn motion_database_input(database: Uuid, file: Uuid) -> Key {
    Key(format!("motion-databases/{database}/inputs/{file}"))
}

/// An index file, a list of such or a model of a motion database, which `job` writes under lease number `lease`.
///
/// # Errors
/// [`Error::BadKey`] if `name` is not a plain file name.
pub fn motion_database(database: Uuid, job: i64, lease: i64, name: &str) -> Result<Key, Error> {
    under(&format!("motion-databases/{database}/{job}/{lease}"), name)
}

/// Prefix of everything that one job wrote for a motion database.
pub fn motion_database_job_prefix(database: Uuid, job: i64) -> Key {
    Key(format!("motion-databases/{database}/{job}"))
}

/// An uploaded file that a body model is to be learned from.
pub fn body_model_input(model: Uuid, file: Uuid) -> Key {
    Key(format!("body-models/{model}/inputs/{file}"))
}

/// The file of a body model, which `job` writes under lease number `lease`.
///
/// # Errors
/// [`Error::BadKey`] if `name` is not a plain file name.
pub fn body_model(model: Uuid, job: i64, lease: i64, name: &str) -> Result<Key, Error> {
    under(&format!("body-models/{model}/{job}/{lease}"), name)
}

/// Prefix of everything that one job wrote for a body model.
pub fn body_model_job_prefix(model: Uuid, job: i64) -> Key {
    Key(format!("body-models/{model}/{job}"))
}

/// An artefact that `job` of `run` writes under lease number `lease`.
///
/// # Errors
/// [`Error::BadKey`] if `name` is not a plain file name.
pub fn artefact(run: Uuid, job: i64, lease: i64, name: &str) -> Result<Key, Error> {
    under(&format!("runs/{run}/{job}/{lease}"), name)
}

fn under(folder: &str, name: &str) -> Result<Key, Error> {
    if name.contains('/') {
        return Err(Error::BadKey { found: name.chars().take(80).collect() });
    }
    format!("{folder}/{name}").parse()
}

/// Prefix of everything a run wrote.
pub fn run_prefix(run: Uuid) -> Key {
    Key(format!("runs/{run}"))
}

/// Prefix of everything one job of a run wrote.
pub fn job_prefix(run: Uuid, job: i64) -> Key {
    Key(format!("runs/{run}/{job}"))
}

/// Prefix of everything uploaded to a session.
pub fn session_prefix(project: Uuid, session: Uuid) -> Key {
    Key(format!("files/{project}/{session}"))
}

/// Prefix of everything of a motion database.
pub fn motion_database_prefix(database: Uuid) -> Key {
    Key(format!("motion-databases/{database}"))
}

/// Prefix of everything of a body model.
pub fn body_model_prefix(model: Uuid) -> Key {
    Key(format!("body-models/{model}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_jobs_contain_the_lease() {
        let key = artefact(Uuid::nil(), 42, 7, "motion.bvh").unwrap();
        assert_eq!(key.as_str(), "runs/00000000-0000-0000-0000-000000000000/42/7/motion.bvh");
        assert_eq!(key.as_str().parse::<Key>().unwrap(), key);
    }

    #[test]
    fn keys_that_escape_or_hide_are_refused() {
        let long = "a".repeat(201);
        for bad in
            ["", "/a", "a/", "a//b", "../a", "a/../b", ".a", "a/.b", "a b", "a\\b", "a#1", "ä", "a\0b", &long]
        {
            assert!(bad.parse::<Key>().is_err(), "{bad:?} was taken");
        }
        assert!(artefact(Uuid::nil(), 1, 1, "a/b").is_err());
        assert!(artefact(Uuid::nil(), 1, 1, "..").is_err());
    }
}
