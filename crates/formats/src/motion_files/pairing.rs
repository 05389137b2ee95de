use std::collections::HashMap;

use super::Path;

/// Which of some skeletons a motion without its own is on, by the names of the files.
///
/// It is the one whose name is the longest beginning of the motion's up to a `_` (`16.asf` for `16_15.amc`), first in
/// the same folder, then elsewhere; else the only one of the motion's folder, else the only one.
#[derive(Debug, Clone)]
pub struct Pairing<'n> {
    num_skeletons: usize,
    by_path: HashMap<(&'n str, String), usize>,
    by_stem: HashMap<String, usize>,
    /// of each folder the first skeleton, and whether it is the only one
    by_folder: HashMap<&'n str, (usize, bool)>,
}

impl<'n> Pairing<'n> {
    /// `skeletons`: their names with their folders, separated by `/`, without the ending of a compression. Of two of
    /// one name the first is taken.
    pub fn new(skeletons: impl IntoIterator<Item = &'n str>) -> Self {
        let mut pairing = Self {
            num_skeletons: 0,
            by_path: HashMap::new(),
            by_stem: HashMap::new(),
            by_folder: HashMap::new(),
        };
        for (index, name) in skeletons.into_iter().enumerate() {
            let path = Path::from_name(name);
            let stem = path.stem.to_lowercase();
            pairing.num_skeletons += 1;
            pairing.by_path.entry((path.folder, stem.clone())).or_insert(index);
            pairing.by_stem.entry(stem).or_insert(index);
            pairing
                .by_folder
                .entry(path.folder)
                .and_modify(|(_, is_only)| *is_only = false)
                .or_insert((index, true));
        }
        pairing
    }

    /// The index of the skeleton of the motion in a file of that name.
    pub fn skeleton_of(&self, motion: &str) -> Option<usize> {
        let path = Path::from_name(motion);
        let stem = path.stem.to_lowercase();
        let starts = || beginnings(&stem);
        let in_folder =
            || starts().find_map(|start| self.by_path.get(&(path.folder, start.to_owned())).copied());
        let elsewhere = || starts().find_map(|start| self.by_stem.get(start).copied());
        let only_in_folder =
            || self.by_folder.get(path.folder).filter(|(_, is_only)| *is_only).map(|(i, _)| *i);
        let only = || (self.num_skeletons == 1).then_some(0);
        in_folder().or_else(elsewhere).or_else(only_in_folder).or_else(only)
    }
}

/// The name, and its beginnings up to a character that is neither letter nor digit, longest first.
fn beginnings(stem: &str) -> impl Iterator<Item = &str> {
    // names are short, and so many beginnings are enough
    const MOST: usize = 32;
    let ends = stem.char_indices().rev().filter(|(_, c)| !c.is_alphanumeric()).map(|(at, _)| at);
    std::iter::once(stem.len())
        .chain(ends)
        .map(|end| &stem[..end])
        .filter(|start| !start.is_empty())
        .take(MOST)
}
