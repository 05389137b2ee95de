//! Names that people give to things, and ids that the gateway gives them.

use formats::media_type::{BINARY, CSV, JSON, MP4, PNG, TAR, TEXT};
use uuid::Uuid;

use crate::error::{Error, Result};

/// Longest name of a session or file, longest tag and longest label of a key, characters.
const MAX_NAME_CHARS: usize = 200;

/// Checks the name of a session, a tag, or the label of a key: any text of one line.
pub(crate) fn check_line(field: &str, text: &str) -> Result<()> {
    let refuse = |what: String| Err(Error::Unprocessable(format!("{field} {what}")));
    let length = text.chars().count();
    if length == 0 || length > MAX_NAME_CHARS {
        return refuse(format!("has {length} characters, expected 1 to {MAX_NAME_CHARS}"));
    }
    if let Some(c) = text.chars().find(|c| c.is_control()) {
        return refuse(format!("has the control character {c:?}, expected a line of text"));
    }
    if text.trim().is_empty() {
        return refuse("is blank, expected a line of text".into());
    }
    Ok(())
}

/// Checks the name of a file: one path component, nothing hidden.
///
/// # Errors
/// [`Error::Unprocessable`] says what is wrong with it.
pub fn check_file_name(name: &str) -> Result<()> {
    let length = name.chars().count();
    if let Some(c) = name.chars().find(|c| c.is_control()) {
        return Err(Error::Unprocessable(format!(
            "the file name has the control character {c:?}, expected a line of text"
        )));
    }
    let plain = !name.starts_with('.') && !name.contains(['/', '\\']) && !name.trim().is_empty();
    if length == 0 || length > MAX_NAME_CHARS || !plain {
        return Err(Error::Unprocessable(format!(
            "{:?} is not a valid file name: expected 1 to {MAX_NAME_CHARS} characters without slashes that do not start \
             with a dot",
            name.chars().take(80).collect::<String>()
        )));
    }
    Ok(())
}

/// Checks the name of a motion database, body model or project: letters, digits, `.`, `_` and `-`, so that it can be part
/// of a path.
///
/// # Errors
/// [`Error::Unprocessable`] says what is wrong with it; `what` is what has the name.
pub fn check_versioned_name(what: &str, name: &str) -> Result<()> {
    let good = (1..=64).contains(&name.len())
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || b"._-".contains(&b))
        && name.as_bytes()[0].is_ascii_alphanumeric();
    if !good {
        return Err(Error::Unprocessable(format!(
            "{:?} is not a valid {what} name: expected 1 to 64 letters, digits, '.', '_' or '-', beginning with \
             a letter or digit",
            name.chars().take(80).collect::<String>()
        )));
    }
    if as_id(name).is_some() {
        return Err(Error::Unprocessable(format!("{name:?} is not a valid {what} name: it is an id")));
    }
    Ok(())
}

/// The media type by which a file is given back.
pub(crate) fn media_type(name: &str) -> &'static str {
    let lower = name.to_ascii_lowercase();
    match lower.rsplit('.').next() {
        Some("csv") => CSV,
        Some("asf" | "amc" | "bvh" | "trc") => TEXT,
        Some("json") => JSON,
        Some("png") => PNG,
        Some("jpg" | "jpeg") => "image/jpeg",
        Some("mp4" | "m4v") => MP4,
        Some("zip") => "application/zip",
        Some("gz" | "tgz") => "application/gzip",
        Some("zst" | "tzst") => "application/zstd",
        Some("tar") => TAR,
        _ => BINARY,
    }
}

/// An id as it is given out: other ways to write one are not taken, so that a thing has one address.
pub(crate) fn as_id(text: &str) -> Option<Uuid> {
    Uuid::try_parse(text).ok().filter(|id| id.as_hyphenated().to_string().eq_ignore_ascii_case(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_escape_or_hide_are_refused() {
        for bad in ["", ".", "..", ".hidden", "a/b", "a\\b", "a\nb", "  ", &"x".repeat(201)] {
            assert!(check_file_name(bad).is_err(), "{bad:?}");
        }
        check_file_name("Läufer 1.csv").unwrap();
    }

    #[test]
    fn an_id_is_not_a_database_name() {
        assert!(check_versioned_name("motion database", "018f3f4e-0000-7000-8000-000000000000").is_err());
        assert!(check_versioned_name("motion database", "walks@1").is_err());
        check_versioned_name("motion database", "walks-2.1").unwrap();
    }
}
