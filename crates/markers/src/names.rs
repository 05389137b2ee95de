//! Names of a file's markers, found by the names of a map.

use std::collections::{BTreeMap, BTreeSet};

use crate::{Error, Result};

/// The names of a file without a prefix.
#[derive(Debug)]
pub(crate) struct FileNames<'a> {
    exact: BTreeMap<&'a str, usize>,
    /// by the name without case and separators
    plain: BTreeMap<String, Vec<usize>>,
    all: &'a [String],
}

/// What makes no difference between names: case, dots, dashes, underscores and blanks.
fn plain(name: &str) -> String {
    name.chars().filter(|c| !matches!(c, '.' | '-' | '_' | ' ')).flat_map(char::to_lowercase).collect()
}

impl<'a> FileNames<'a> {
    /// The names that begin with `prefix`.
    pub(crate) fn new(all: &'a [String], prefix: &str) -> Self {
        let mut exact = BTreeMap::new();
        let mut by_plain = BTreeMap::<String, Vec<usize>>::new();
        for (index, name) in all.iter().enumerate() {
            let Some(name) = name.strip_prefix(prefix) else { continue };
            exact.insert(name, index);
            by_plain.entry(plain(name)).or_default().push(index);
        }
        Self { exact, plain: by_plain, all }
    }

    /// How many names have the prefix.
    pub(crate) fn len(&self) -> usize {
        self.exact.len()
    }

    /// Index of the marker that a map calls `name`: the same name, else the only one that differs from it in nothing
    /// but case and separators.
    pub(crate) fn find(&self, name: &str) -> Result<Option<usize>> {
        if let Some(index) = self.exact.get(name) {
            return Ok(Some(*index));
        }
        match self.plain.get(&plain(name)).map(Vec::as_slice) {
            None => Ok(None),
            Some([index]) => Ok(Some(*index)),
            Some(several) => {
                let found: Vec<_> = several.iter().map(|i| self.all[*i].as_str()).collect();
                Err(Error::Unclear { name: name.to_owned(), found: found.join(", ") })
            }
        }
    }
}

/// What the names may begin with before the marker's own name: nothing, `Subject:`, or what all of them share up to an
/// underscore.
pub(crate) fn prefixes(all: &[String]) -> Vec<String> {
    let mut found: BTreeSet<&str> = BTreeSet::from([""]);
    found.extend(all.iter().filter_map(|name| name.rfind(':').map(|at| &name[..=at])));
    if let [first, rest @ ..] = all
        && !rest.is_empty()
    {
        let shared = rest.iter().fold(first.as_str(), |shared, name| {
            let same = shared.char_indices().zip(name.chars()).find(|((_, a), b)| a != b);
            let end = same.map_or(shared.len().min(name.len()), |((at, _), _)| at);
            &shared[..end]
        });
        found.extend(shared.rfind('_').map(|at| &shared[..=at]));
    }
    found.into_iter().map(str::to_owned).collect()
}

/// The name in a file that is meant by `name`: the same, else the only one that differs from it in nothing but a prefix, case
/// and separators.
///
/// # Errors
/// If several names of the file are meant.
pub fn find_name<'a>(name: &str, all: &'a [String]) -> Result<Option<&'a str>> {
    if let Some(same) = all.iter().find(|own| *own == name) {
        return Ok(Some(same));
    }
    let mut found = BTreeSet::new();
    for prefix in prefixes(all) {
        found.extend(FileNames::new(all, &prefix).find(name)?);
    }
    let names: Vec<&str> = found.into_iter().map(|index| all[index].as_str()).collect();
    match names[..] {
        [] => Ok(None),
        [own] => Ok(Some(own)),
        _ => Err(Error::Unclear { name: name.to_owned(), found: names.join(", ") }),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|n| (*n).to_owned()).collect()
    }

    #[test]
    fn prefixes_are_subjects_or_what_all_names_share() {
        assert_eq!(prefixes(&names(&["Anna:LASI", "Anna:RASI", "Ben:LASI"])), ["", "Anna:", "Ben:"]);
        assert_eq!(prefixes(&names(&["Q_HeadL", "Q_HeadR", "Q_LArm"])), ["", "Q_"]);
        assert_eq!(prefixes(&names(&["LASI", "RASI"])), [""]);
        assert_eq!(prefixes(&names(&["é_a", "è_a"])), [""]);
        assert_eq!(prefixes(&names(&["a_b"])), [""]);
        assert_eq!(prefixes(&[]), [""]);
    }

    #[test]
    fn a_name_is_found_without_its_prefix() {
        let all = names(&["Anna:LWRA", "Anna:RWRA", "LWRA_2"]);
        assert_eq!(find_name("Anna:LWRA", &all), Ok(Some("Anna:LWRA")));
        assert_eq!(find_name("lwra", &all), Ok(Some("Anna:LWRA")));
        assert_eq!(find_name("head", &all), Ok(None));
        let two = names(&["Anna:LWRA", "Ben:LWRA", "LWRA"]);
        assert_eq!(find_name("LWRA", &two), Ok(Some("LWRA")));
        let message = find_name("lwra", &two[..2]).unwrap_err().to_string();
        assert!(message.contains("Anna:LWRA, Ben:LWRA"), "{message}");
    }

    #[test]
    fn case_and_separators_make_no_difference_unless_they_must() {
        let all = names(&["S:R.ASIS", "S:l asis", "S:LTH1", "S:lth1", "other"]);
        let file = FileNames::new(&all, "S:");
        assert_eq!(file.len(), 4);
        assert_eq!(file.find("r_asis"), Ok(Some(0)));
        assert_eq!(file.find("L.ASIS"), Ok(Some(1)));
        assert_eq!(file.find("LTH1"), Ok(Some(2)));
        assert_eq!(file.find("other"), Ok(None));
        let message = file.find("Lth1").unwrap_err().to_string();
        assert!(message.contains("S:LTH1, S:lth1"), "{message}");
    }
}
