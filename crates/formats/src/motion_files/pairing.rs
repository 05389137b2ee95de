use std::{cell::OnceCell, collections::HashMap};

use model::Motion;

use super::{LazySkeleton, Path};
use crate::{Error, Read, Result, amc, archive::Entry};

/// The skeletons of an archive, by name.
pub(super) struct Skeletons<'e> {
    list: Vec<LazySkeleton<'e>>,
    by_path: HashMap<(&'e str, String), usize>,
    by_stem: HashMap<String, usize>,
    /// of each folder the first skeleton, and whether it is the only one
    by_folder: HashMap<&'e str, (usize, bool)>,
}

impl<'e> Skeletons<'e> {
    /// Of skeletons of one name the first in the order of `files` is taken.
    pub(super) fn new(files: &[(Path<'e>, &'e Entry)]) -> Self {
        let mut skeletons = Self {
            list: Vec::new(),
            by_path: HashMap::new(),
            by_stem: HashMap::new(),
            by_folder: HashMap::new(),
        };
        for (path, entry) in files.iter().filter(|(path, _)| path.has_extension("asf")) {
            let index = skeletons.list.len();
            skeletons.list.push(LazySkeleton { entry, file: OnceCell::new() });
            let stem = path.stem.to_lowercase();
            skeletons.by_path.entry((path.folder, stem.clone())).or_insert(index);
            skeletons.by_stem.entry(stem).or_insert(index);
            skeletons
                .by_folder
                .entry(path.folder)
                .and_modify(|(_, is_only)| *is_only = false)
                .or_insert((index, true));
        }
        skeletons
    }

    pub(super) fn read_amc(&self, path: &Path<'e>, bytes: &[u8], frame_rate: f64) -> Result<Read<Motion>> {
        let skeleton = self.skeleton_for(path).ok_or_else(|| {
            let found = format!("no ASF file for it among {}", self.list.len());
            Error::whole_file(found, format!("one such as {}.asf", path.subject()))
        })?;
        let file = skeleton.get()?;
        amc::read(bytes, &file, frame_rate)
    }

    fn skeleton_for(&self, path: &Path<'e>) -> Option<&LazySkeleton<'e>> {
        let stem = path.stem.to_lowercase();
        let starts = || beginnings(&stem);
        let in_folder =
            || starts().find_map(|start| self.by_path.get(&(path.folder, start.to_owned())).copied());
        let elsewhere = || starts().find_map(|start| self.by_stem.get(start).copied());
        let only_in_folder =
            || self.by_folder.get(path.folder).filter(|(_, is_only)| *is_only).map(|(i, _)| *i);
        let only = || (self.list.len() == 1).then_some(0);
        let index = in_folder().or_else(elsewhere).or_else(only_in_folder).or_else(only)?;
        self.list.get(index)
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
