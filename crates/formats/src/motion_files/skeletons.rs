use std::{cell::OnceCell, sync::Arc};

use model::Motion;

use super::{FileUse, Pairing, Path};
use crate::{
    Error, Read, Result, amc,
    archive::Entry,
    asf,
    session::{self, SkeletonFormat},
};

/// The skeletons of an archive.
pub(super) struct Skeletons<'e> {
    list: Vec<LazySkeleton<'e>>,
    pairing: Pairing<'e>,
}

impl<'e> Skeletons<'e> {
    /// Of skeletons of one name the first in the order of `files` is taken.
    pub(super) fn new(files: &[(Path<'e>, &'e Entry)]) -> Self {
        let lazy = |(path, entry): &(Path<'e>, &'e Entry)| match FileUse::from_path(path) {
            FileUse::Skeleton(format) => Some(LazySkeleton { format, entry, file: OnceCell::new() }),
            _ => None,
        };
        let list: Vec<_> = files.iter().filter_map(lazy).collect();
        let pairing = Pairing::new(list.iter().map(|skeleton| skeleton.entry.name.as_str()));
        Self { list, pairing }
    }

    pub(super) fn read_amc(&self, motion: &Entry, frame_rate: f64) -> Result<Read<Motion>> {
        let index = self.pairing.skeleton_of(&motion.name);
        let skeleton = index.and_then(|index| self.list.get(index)).ok_or_else(|| {
            let found = format!("no ASF file for it among {}", self.list.len());
            Error::whole_file(found, format!("one such as {}.asf", Path::from_name(&motion.name).subject()))
        })?;
        let file = skeleton.get()?;
        amc::read(&motion.bytes, &file, frame_rate)
    }
}

/// A skeleton that is read when it is needed first.
struct LazySkeleton<'e> {
    format: SkeletonFormat,
    entry: &'e Entry,
    file: OnceCell<Result<Arc<asf::File>>>,
}

impl LazySkeleton<'_> {
    fn get(&self) -> Result<Arc<asf::File>> {
        let options = session::Options::default();
        let read = || self.format.read(&self.entry.bytes, &options).map(|r| Arc::new(r.value));
        self.file.get_or_init(|| read().map_err(|e| e.in_file(&self.entry.name))).clone()
    }
}
