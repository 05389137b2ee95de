/// A name in an archive, taken apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path<'e> {
    pub(super) folder: &'e str,
    /// without folders and ending
    pub(super) stem: &'e str,
    pub(super) extension: &'e str,
}

impl<'e> Path<'e> {
    pub(super) fn from_name(name: &'e str) -> Self {
        let (folder, file) = name.rsplit_once('/').unwrap_or(("", name));
        let (stem, extension) = file.rsplit_once('.').unwrap_or((file, ""));
        Self { folder, stem, extension }
    }

    /// Files that some systems add to archives, `._16_15.amc` and those in `__MACOSX`.
    pub(super) fn is_hidden(&self) -> bool {
        let is_hidden = |folder: &str| folder.starts_with('.') || folder.eq_ignore_ascii_case("__macosx");
        let folder_is_hidden = self.folder.split('/').any(is_hidden);
        folder_is_hidden || self.stem.starts_with('.') || self.stem.is_empty()
    }

    /// The name up to its first `_`.
    pub(super) fn subject(&self) -> &'e str {
        self.stem.split_once('_').map_or(self.stem, |(subject, _)| subject)
    }

    /// Whether `folder` is this one's or above it.
    pub(super) fn is_below(&self, folder: &str) -> bool {
        let rest = self.folder.strip_prefix(folder);
        folder.is_empty() || rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    }
}
