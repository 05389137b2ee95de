//! Archives of pictures: which members are whose, and their order.

use std::{cmp::Ordering, collections::BTreeSet};

use bytes::Bytes;
use formats::archive::{self, Entry, Limits};

use jobs::multi_view::Members;
use service::FileError;

/// Whether a member is a picture; what systems hide in archives isn't.
pub(crate) fn is_picture(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    let is_hidden = lower.split('/').any(|part| part.starts_with('.') || part == "__macosx");
    !is_hidden && [".png", ".jpg", ".jpeg"].iter().any(|ending| lower.ends_with(ending))
}

/// Pictures unpack to hardly more than they are packed.
fn limits(max_bytes: u64) -> Limits {
    Limits { total_bytes: max_bytes, ..Limits::default() }
}

/// Names of all pictures of an archive, in natural order.
///
/// # Errors
/// If the archive is damaged.
pub(crate) fn pictures(name: &str, bytes: &Bytes, max_bytes: u64) -> Result<Vec<String>, FileError> {
    let mut names = Vec::new();
    archive::entries_where(name, bytes, &limits(max_bytes), |member| {
        if is_picture(member) {
            names.push(member.to_owned());
        }
        false
    })
    .map_err(FileError::in_file(name))?;
    names.sort_by(|a, b| natural(a, b));
    Ok(names)
}

/// The pictures of some members, in natural order: number 2 before number 10.
///
/// # Errors
/// If the archive is damaged, or there are none.
pub(crate) fn read(
    name: &str,
    bytes: &Bytes,
    members: &Members,
    max_bytes: u64,
) -> Result<Vec<Entry>, FileError> {
    let is_wanted = |member: &str| is_picture(member) && has(members, member);
    let mut entries = archive::entries_where(name, bytes, &limits(max_bytes), is_wanted)
        .map_err(FileError::in_file(name))?;
    if entries.is_empty() {
        return Err(FileError::unexpected(name, "no pictures", "PNG or JPEG files, one a frame"));
    }
    entries.sort_by(|a, b| natural(&a.name, &b.name));
    Ok(entries)
}

/// Whether a member is one of them.
fn has(members: &Members, member: &str) -> bool {
    let (folder, file) = member.rsplit_once('/').unwrap_or(("", member));
    match members {
        Members::Folder(own) => folder == own,
        Members::Prefix { folder: own, prefix } => folder == own && beginning(file) == prefix,
        Members::One(name) => member == name,
    }
}

/// Divides pictures into cameras: a folder each; or, where all lie in one folder, a beginning of their names each.
pub(crate) fn groups(names: &[String]) -> Vec<Members> {
    let split = |name: &String| {
        let (folder, file) = name.rsplit_once('/').unwrap_or(("", name));
        (folder.to_owned(), beginning(file).to_owned())
    };
    let folders: BTreeSet<String> = names.iter().map(|name| split(name).0).collect();
    if folders.len() == 1 {
        let prefixes: BTreeSet<(String, String)> = names.iter().map(split).collect();
        if prefixes.len() > 1 && prefixes.iter().all(|(_, prefix)| !prefix.is_empty()) {
            return prefixes.into_iter().map(|(folder, prefix)| Members::Prefix { folder, prefix }).collect();
        }
    }
    folders.into_iter().map(Members::Folder).collect()
}

/// What a picture's name begins with, before the number of its frame: `cam1_` of `cam1_0007.png`.
fn beginning(file: &str) -> &str {
    let stem = file.split_once('.').map_or(file, |(stem, _)| stem);
    stem.trim_end_matches(|c: char| c.is_ascii_digit())
}

/// Order of names in which numbers count as numbers.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let (Some(x), Some(y)) = (a.chars().next(), b.chars().next()) else { return a.len().cmp(&b.len()) };
        let order = if x.is_ascii_digit() && y.is_ascii_digit() {
            let (number_a, rest_a) = leading_number(a);
            let (number_b, rest_b) = leading_number(b);
            (a, b) = (rest_a, rest_b);
            number_a.len().cmp(&number_b.len()).then(number_a.cmp(number_b))
        } else {
            (a, b) = (&a[x.len_utf8()..], &b[y.len_utf8()..]);
            x.cmp(&y)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

/// Digits without zeros in front, and what follows them.
fn leading_number(text: &str) -> (&str, &str) {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    (text[..end].trim_start_matches('0'), &text[end..])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    #[test]
    fn folders_are_cameras_or_else_beginnings_of_names() {
        let folder = |folder: &str| Members::Folder(folder.into());
        assert_eq!(
            groups(&names(&["s/cam0/0000.png", "s/cam1/0000.png"])),
            [folder("s/cam0"), folder("s/cam1")]
        );
        assert_eq!(groups(&names(&["0000.png", "0001.png"])), [folder("")]);
        let found = groups(&names(&["cam1_0000.png", "cam1_0001.png", "cam2_0000.png"]));
        assert_eq!(found.len(), 2);
        assert!(has(&found[1], "cam2_0000.png") && !has(&found[1], "cam1_0000.png"));
    }

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut found = names(&["f10.png", "f2.png", "f02b.png", "f1.png"]);
        found.sort_by(|a, b| natural(a, b));
        assert_eq!(found, ["f1.png", "f2.png", "f02b.png", "f10.png"]);
    }

    #[test]
    fn what_systems_hide_in_archives_is_no_picture() {
        assert!(is_picture("a/0.PNG") && is_picture("b.jpeg"));
        assert!(!is_picture("__MACOSX/0.png") && !is_picture("a/._0.png") && !is_picture("a.txt"));
    }
}
