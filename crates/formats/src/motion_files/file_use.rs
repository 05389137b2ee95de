use super::Path;
use crate::session::{MotionFormat, SkeletonFormat};

/// What a file of a collection of motions is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileUse {
    /// a motion
    Motion(MotionFormat),
    /// the skeleton of motions
    Skeleton(SkeletonFormat),
    /// tells of motions: `index.csv`
    Index,
    /// nothing
    None,
}

impl FileUse {
    /// By the file's name, with its folders or without, and without the ending of a compression (see
    /// [`crate::archive::without_compression`]); what systems hide in archives is of no use.
    pub fn from_name(name: &str) -> Self {
        Self::from_path(&Path::from_name(name))
    }

    /// The same for a name that is taken apart.
    pub(super) fn from_path(path: &Path<'_>) -> Self {
        if path.is_hidden() {
            return Self::None;
        }
        // A BVH has a skeleton too, but is there for its motion.
        let motion = || MotionFormat::from_extension(path.extension).map(Self::Motion);
        let skeleton = || SkeletonFormat::from_extension(path.extension).map(Self::Skeleton);
        let is_index = path.stem.eq_ignore_ascii_case("index") && path.extension.eq_ignore_ascii_case("csv");
        motion().or_else(skeleton).or(is_index.then_some(Self::Index)).unwrap_or(Self::None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_apart_by_name() {
        for (name, expected) in [
            ("a.zip/16/16_15.AMC", FileUse::Motion(MotionFormat::Amc)),
            ("x.bvh", FileUse::Motion(MotionFormat::Bvh)),
            ("16.asf", FileUse::Skeleton(SkeletonFormat::Asf)),
            ("a/INDEX.csv", FileUse::Index),
            ("a/other.csv", FileUse::None),
            ("__MACOSX/16_15.amc", FileUse::None),
            ("a/._16_15.amc", FileUse::None),
            ("a/.git/x.amc", FileUse::None),
            ("16_15.amc.zst", FileUse::None),
            (".amc", FileUse::None),
            ("amc", FileUse::None),
            ("", FileUse::None),
        ] {
            assert_eq!(FileUse::from_name(name), expected, "{name}");
        }
    }
}
