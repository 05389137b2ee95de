//! Names that people give to things.

use crate::error::{Error, Result};

/// Longest name of a session or file, characters.
const MAX_NAME_CHARS: usize = 200;

/// Checks the name of a session: any text of one line.
pub(crate) fn check_session_name(name: &str) -> Result<()> {
    let length = name.chars().count();
    if length == 0 || length > MAX_NAME_CHARS || name.chars().any(char::is_control) {
        return Err(Error::Unprocessable(format!(
            "name has {length} characters, expected 1 to {MAX_NAME_CHARS} without control characters"
        )));
    }
    Ok(())
}

/// Checks the name of a file: one path component, nothing hidden.
pub(crate) fn check_file_name(name: &str) -> Result<()> {
    let length = name.chars().count();
    let plain = !name.starts_with('.') && !name.chars().any(|c| c.is_control() || matches!(c, '/' | '\\'));
    if length == 0 || length > MAX_NAME_CHARS || !plain {
        return Err(Error::Unprocessable(format!(
            "file name {:?} is not one: expected 1 to {MAX_NAME_CHARS} characters without slashes that do not start \
             with a dot",
            name.chars().take(80).collect::<String>()
        )));
    }
    Ok(())
}

/// Checks the name of a motion database or body model: letters, digits, `.`, `_` and `-`, so that it can be part of a path.
pub(crate) fn check_versioned_name(what: &str, name: &str) -> Result<()> {
    let good = (1..=64).contains(&name.len())
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || b"._-".contains(&b))
        && name.as_bytes()[0].is_ascii_alphanumeric()
        // an id must never be taken for a name
        && uuid::Uuid::parse_str(name).is_err();
    if !good {
        return Err(Error::Unprocessable(format!(
            "{what} name {:?} is not one: expected 1 to 64 letters, digits, '.', '_' or '-', beginning with \
             a letter or digit",
            name.chars().take(80).collect::<String>()
        )));
    }
    Ok(())
}

/// What a file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FileRole {
    /// ASF, or a BVH whose hierarchy is used
    Skeleton,
    /// trajectories of control points: CSV, TRC or C3D
    ControlPoints,
    /// the motion that really was, for measuring the error: AMC or BVH
    GroundTruth,
    /// motion to build a database from: archives, ASF and AMC, BVH
    Motion,
    /// scans to learn a body model from: archives, OBJ, PLY, NPY, their rig and tables
    Scans,
    /// calibrated cameras: TOML, YAML, JSON, XML, Qualisys
    Calibration,
    /// what a camera recorded
    Video,
    /// the same as an archive of pictures
    Images,
    /// an archive of silhouettes
    Masks,
    /// a picture of the empty scene, or an archive of such
    Plate,
}

impl FileRole {
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Skeleton => "skeleton",
            Self::ControlPoints => "control-points",
            Self::GroundTruth => "ground-truth",
            Self::Motion => "motion",
            Self::Scans => "scans",
            Self::Calibration => "calibration",
            Self::Video => "video",
            Self::Images => "images",
            Self::Masks => "masks",
            Self::Plate => "plate",
        }
    }

    /// The role that a file of a session has by its name.
    pub fn of_session_file(name: &str) -> Option<Self> {
        match kind(name)? {
            "asf" => Some(Self::Skeleton),
            "csv" | "trc" | "c3d" => Some(Self::ControlPoints),
            "amc" | "bvh" => Some(Self::GroundTruth),
            "toml" | "json" | "yml" | "yaml" | "xml" | "qca.txt" => Some(Self::Calibration),
            "mp4" | "mov" | "m4v" | "avi" | "mkv" | "webm" => Some(Self::Video),
            "png" | "jpg" | "jpeg" => Some(Self::Plate),
            "zip" | "tar" | "tgz" | "tzst" => {
                let lower = name.to_ascii_lowercase();
                let tells = |words: &[&str]| words.iter().any(|word| lower.contains(word));
                if tells(&["plate", "background"]) {
                    Some(Self::Plate)
                } else if tells(&["image", "frame", "photo", "rgb"]) {
                    Some(Self::Images)
                } else {
                    Some(Self::Masks)
                }
            }
            _ => None,
        }
    }

    /// Whether a file of that name can have this role in a session.
    pub fn fits_session_file(self, name: &str) -> bool {
        matches!(
            (self, kind(name)),
            (Self::Skeleton, Some("asf" | "bvh"))
                | (Self::ControlPoints, Some("csv" | "trc" | "c3d"))
                | (Self::GroundTruth, Some("amc" | "bvh"))
                | (Self::Calibration, Some("toml" | "json" | "yml" | "yaml" | "xml" | "qca.txt"))
                | (Self::Video, Some("mp4" | "mov" | "m4v" | "avi" | "mkv" | "webm"))
                | (Self::Images | Self::Masks | Self::Plate, Some("zip" | "tar" | "tgz" | "tzst"))
                | (Self::Plate, Some("png" | "jpg" | "jpeg"))
        )
    }

    /// Whether motion databases are built from files of that name.
    pub fn is_motion_file(name: &str) -> bool {
        matches!(kind(name), Some("asf" | "amc" | "bvh" | "zip" | "tar" | "tgz" | "tzst"))
    }

    /// Whether body models are learned from files of that name.
    pub fn is_scan_file(name: &str) -> bool {
        matches!(kind(name), Some("obj" | "ply" | "npy" | "json" | "csv" | "zip" | "tar" | "tgz" | "tzst"))
    }
}

/// The kind of file that a name stands for: its extension in lower case, without `.zst` or `.gz` behind it.
fn kind(name: &str) -> Option<&'static str> {
    const KINDS: [&str; 28] = [
        "asf", "amc", "bvh", "csv", "trc", "c3d", "zip", "tar", "tgz", "tzst", "toml", "json", "yml", "yaml",
        "xml", "qca.txt", "mp4", "mov", "m4v", "avi", "mkv", "webm", "png", "jpg", "jpeg", "obj", "ply",
        "npy",
    ];
    let lower = name.to_ascii_lowercase();
    let inner = lower.strip_suffix(".zst").or(lower.strip_suffix(".gz")).unwrap_or(&lower);
    KINDS
        .into_iter()
        .find(|kind| inner.strip_suffix(kind).is_some_and(|stem| stem.len() > 1 && stem.ends_with('.')))
}

/// The media type by which a file is given back.
pub(crate) fn media_type(name: &str) -> &'static str {
    let lower = name.to_ascii_lowercase();
    match lower.rsplit('.').next() {
        Some("csv") => "text/csv; charset=utf-8",
        Some("asf" | "amc" | "bvh" | "trc") => "text/plain; charset=utf-8",
        Some("json") => "application/json",
        Some("png") => "image/png",
        Some("jpg" | "jpeg") => "image/jpeg",
        Some("mp4" | "m4v") => "video/mp4",
        Some("zip") => "application/zip",
        Some("gz" | "tgz") => "application/gzip",
        Some("zst" | "tzst") => "application/zstd",
        Some("tar") => "application/x-tar",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_follow_from_names() {
        assert_eq!(FileRole::of_session_file("16.ASF"), Some(FileRole::Skeleton));
        assert_eq!(FileRole::of_session_file("points.csv"), Some(FileRole::ControlPoints));
        assert_eq!(FileRole::of_session_file("16_15.amc.zst"), Some(FileRole::GroundTruth));
        assert_eq!(FileRole::of_session_file("notes.txt"), None);
        assert_eq!(FileRole::of_session_file("Calib.qca.txt"), Some(FileRole::Calibration));
        assert_eq!(FileRole::of_session_file("cam01.MP4"), Some(FileRole::Video));
        assert_eq!(FileRole::of_session_file("cam01.plate.png"), Some(FileRole::Plate));
        assert_eq!(FileRole::of_session_file("plates.zip"), Some(FileRole::Plate));
        assert_eq!(FileRole::of_session_file("images.zip"), Some(FileRole::Images));
        assert_eq!(FileRole::of_session_file("silhouettes.tar.gz"), Some(FileRole::Masks));
        assert!(!FileRole::Video.fits_session_file("cam01.zip"));
        assert!(FileRole::is_scan_file("s001.obj") && !FileRole::is_scan_file("s001.bvh"));
        assert_eq!(FileRole::of_session_file(".csv"), None);
        assert!(FileRole::Skeleton.fits_session_file("a.bvh"));
        assert!(!FileRole::Skeleton.fits_session_file("a.csv"));
        assert!(FileRole::is_motion_file("all.tar.zst"));
        assert!(FileRole::is_motion_file("all.tgz"));
        assert!(!FileRole::is_motion_file("scan.obj"));
        assert!(!FileRole::is_motion_file("points.csv"));
    }

    #[test]
    fn names_that_escape_or_hide_are_refused() {
        for bad in ["", ".", "..", ".hidden", "a/b", "a\\b", "a\nb", &"x".repeat(201)] {
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
