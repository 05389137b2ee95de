use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::archive::without_compression;
use crate::extension::{endings, extension};
use crate::session::{MotionFormat, PointsFormat, SkeletonFormat};

/// What an uploaded file is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", try_from = "String")]
pub enum FileRole {
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
    /// a picture of the empty scene, or an archive of such pictures
    Plate,
}

const CALIBRATION: [&str; 6] = ["toml", "json", "yml", "yaml", "xml", "qca.txt"];
const VIDEO: [&str; 6] = ["mp4", "mov", "m4v", "avi", "mkv", "webm"];
const PICTURE: [&str; 3] = ["png", "jpg", "jpeg"];
const ARCHIVE: [&str; 4] = ["zip", "tar", "tgz", "tzst"];
/// The same as people write them.
const ARCHIVES: [&str; 4] = ["zip", "tar", "tar.gz", "tar.zst"];
const SCAN: [&str; 5] = ["obj", "ply", "npy", "json", "csv"];
/// Tables that go with files of something else, by name, and what is made from them.
const LISTS: [(&str, &str); 3] =
    [("index.csv", "motion databases"), ("scans.csv", "body models"), ("subjects.csv", "body models")];

impl FileRole {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Skeleton,
        Self::ControlPoints,
        Self::GroundTruth,
        Self::Motion,
        Self::Scans,
        Self::Calibration,
        Self::Video,
        Self::Images,
        Self::Masks,
        Self::Plate,
    ];

    /// Its word in requests, answers and payloads.
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
    pub fn from_session_file(name: &str) -> Option<Self> {
        // A BVH has a skeleton too, but most are there for their motion.
        let by_extension =
            [Self::ControlPoints, Self::GroundTruth, Self::Skeleton, Self::Calibration, Self::Video];
        if let Some(role) = by_extension.into_iter().find(|role| role.fits_session_file(name)) {
            return Some(role);
        }
        match extension(name).as_str() {
            picture if PICTURE.contains(&picture) => Some(Self::Plate),
            archive if ARCHIVE.contains(&archive) => Some(Self::from_folder(name)),
            _ => None,
        }
    }

    /// The role of the pictures in a folder, or an archive, of that name.
    pub fn from_folder(name: &str) -> Self {
        let lower = name.to_ascii_lowercase();
        let tells = |words: &[&str]| words.iter().any(|word| lower.contains(word));
        if tells(&["plate", "background"]) {
            Self::Plate
        } else if tells(&["image", "frame", "photo", "rgb"]) {
            Self::Images
        } else {
            Self::Masks
        }
    }

    /// Whether a file of that name can have this role in a session.
    pub fn fits_session_file(self, name: &str) -> bool {
        let extension = extension(name);
        let is_one_of = |extensions: &[&str]| extensions.contains(&extension.as_str());
        match self {
            Self::Skeleton => SkeletonFormat::from_name(name).is_some(),
            Self::ControlPoints => PointsFormat::from_name(name).is_some(),
            Self::GroundTruth => MotionFormat::from_name(name).is_some(),
            Self::Calibration => is_one_of(&CALIBRATION),
            Self::Video => is_one_of(&VIDEO),
            Self::Images | Self::Masks => is_one_of(&ARCHIVE),
            Self::Plate => is_one_of(&ARCHIVE) || is_one_of(&PICTURE),
            Self::Motion | Self::Scans => false,
        }
    }

    /// The endings of files that can have this role in a session, as a sentence has them: `.csv, .trc or .c3d`.
    pub fn endings(self) -> String {
        let extensions: Vec<&str> = match self {
            Self::Skeleton => SkeletonFormat::extensions().into(),
            Self::ControlPoints => PointsFormat::extensions().into(),
            Self::GroundTruth => MotionFormat::extensions().into(),
            Self::Calibration => CALIBRATION.into(),
            Self::Video => VIDEO.into(),
            Self::Images | Self::Masks => ARCHIVES.into(),
            Self::Plate => [&PICTURE[..], &ARCHIVES].concat(),
            Self::Motion => [&motion_extensions()[..], &ARCHIVES].concat(),
            Self::Scans => [&SCAN[..], &ARCHIVES].concat(),
        };
        endings(&extensions)
    }

    /// What a file of a session is for: as stated, or by its name.
    ///
    /// # Errors
    /// If the role is not one of sessions, or no role or not this one has files of that name.
    pub fn in_session(name: &str, stated: Option<Self>) -> Result<Self, NotInSession> {
        if let Some((role, made)) = stated.and_then(|role| Some((role, role.elsewhere()?))) {
            return Err(NotInSession::Elsewhere { role, made });
        }
        let Some(role) = stated else {
            let plain = without_compression(name);
            if let Some((_, made)) = LISTS.into_iter().find(|(list, _)| plain.eq_ignore_ascii_case(list)) {
                return Err(NotInSession::List { name: name.to_owned(), made });
            }
            let guessed = Self::from_session_file(name);
            return guessed.ok_or_else(|| NotInSession::Type { name: name.to_owned() });
        };
        // a role that is stated would not help where none has files of that ending
        match Self::from_session_file(name) {
            None => Err(NotInSession::Type { name: name.to_owned() }),
            Some(_) if role.fits_session_file(name) => Ok(role),
            Some(_) => Err(NotInSession::Role { name: name.to_owned(), role }),
        }
    }

    /// So many files of this role, in words: `no file of control points`, `3 skeleton files`.
    pub fn counted(self, count: usize) -> String {
        let (before, after) = match self {
            Self::Skeleton => ("skeleton ", ""),
            Self::ControlPoints => ("", " of control points"),
            Self::GroundTruth => ("", " of ground truth"),
            Self::Motion => ("motion ", ""),
            Self::Scans => ("scan ", ""),
            Self::Calibration => ("calibration ", ""),
            Self::Video => ("video ", ""),
            Self::Images => ("", " of images"),
            Self::Masks => ("", " of masks"),
            Self::Plate => ("plate ", ""),
        };
        match count {
            0 => format!("no {before}file{after}"),
            1 => format!("1 {before}file{after}"),
            _ => format!("{count} {before}files{after}"),
        }
    }

    /// What is said of a session with several files of this role, where one is needed:
    /// `the session has 2 skeleton files (a.asf, b.asf); keep one`.
    pub fn keep_one(self, names: &[&str]) -> String {
        format!("the session has {} ({}); keep one", self.counted(names.len()), names.join(", "))
    }

    /// What a file of this role is, in words: `a skeleton`.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Skeleton => "a skeleton",
            Self::ControlPoints => "a file of control points",
            Self::GroundTruth => "the ground truth",
            Self::Motion => "a file of motion",
            Self::Scans => "a file of scans",
            Self::Calibration => "a calibration",
            Self::Video => "a video",
            Self::Images => "an archive of images",
            Self::Masks => "an archive of masks",
            Self::Plate => "a plate",
        }
    }

    /// The roles that files of sessions have.
    pub fn session_roles() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|role| role.elsewhere().is_none())
    }

    /// What is made from files of this role, where they are not a session's.
    pub fn elsewhere(self) -> Option<&'static str> {
        match self {
            Self::Motion => Some("motion databases"),
            Self::Scans => Some("body models"),
            _ => None,
        }
    }

    /// The endings of all files that a session can have, by role: `skeleton .asf or .bvh; …`.
    pub fn session_endings() -> String {
        Self::session_roles().map(|role| format!("{role} {}", role.endings())).collect::<Vec<_>>().join("; ")
    }

    /// The endings of pictures, as a sentence has them.
    pub fn picture_endings() -> String {
        endings(&PICTURE)
    }

    /// Whether a file of that name is a picture, not compressed once more.
    pub fn is_picture_file(name: &str) -> bool {
        without_compression(name) == name && PICTURE.contains(&extension(name).as_str())
    }

    /// Whether motion databases are built from files of that name.
    pub fn is_motion_file(name: &str) -> bool {
        let is_motion = MotionFormat::from_name(name).is_some() || SkeletonFormat::from_name(name).is_some();
        is_motion || ARCHIVE.contains(&extension(name).as_str())
    }

    /// Whether body models are learned from files of that name.
    pub fn is_scan_file(name: &str) -> bool {
        let extension = extension(name);
        SCAN.contains(&extension.as_str()) || ARCHIVE.contains(&extension.as_str())
    }
}

/// Extensions of the files, no archives, that motion databases are built from: skeletons and motion.
fn motion_extensions() -> Vec<&'static str> {
    let motion = MotionFormat::extensions();
    let skeletons = SkeletonFormat::extensions().into_iter().filter(|extension| !motion.contains(extension));
    skeletons.chain(motion).collect()
}

impl fmt::Display for FileRole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Why a session can't have a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotInSession {
    /// No role has files of that name.
    #[error("the type of {name:?} is not known; sessions take: {}", FileRole::session_endings())]
    Type {
        /// The file's name.
        name: String,
    },
    /// A list that goes with files of something else.
    #[error(
        "{name:?} is the list that goes with files for {made}, not a file of control points; state the role if it is one"
    )]
    List {
        /// The file's name.
        name: String,
        /// What is made from the files.
        made: &'static str,
    },
    /// Other files have this role.
    #[error("{} must be {}, found {name:?}", role.in_words(), role.endings())]
    Role {
        /// The file's name.
        name: String,
        /// The role that was stated.
        role: FileRole,
    },
    /// Something else is made from files of this role.
    #[error("role {role} belongs to {made}, not to sessions")]
    Elsewhere {
        /// The role that was stated.
        role: FileRole,
        /// What is made from such files.
        made: &'static str,
    },
}

/// A word that is no role. The message names those that files of sessions can have, as people state no others.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("found {found:?}, expected one of {}", session_words())]
pub struct UnknownFileRole {
    /// The word.
    pub found: String,
}

fn session_words() -> String {
    FileRole::session_roles().map(FileRole::as_str).collect::<Vec<_>>().join(", ")
}

impl FromStr for FileRole {
    type Err = UnknownFileRole;

    fn from_str(word: &str) -> Result<Self, UnknownFileRole> {
        let known = Self::ALL.into_iter().find(|role| role.as_str() == word);
        known.ok_or_else(|| UnknownFileRole { found: word.to_owned() })
    }
}

impl TryFrom<String> for FileRole {
    type Error = UnknownFileRole;

    fn try_from(word: String) -> Result<Self, UnknownFileRole> {
        word.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_follow_from_names() {
        assert_eq!(FileRole::from_session_file("16.ASF"), Some(FileRole::Skeleton));
        assert_eq!(FileRole::from_session_file("points.csv"), Some(FileRole::ControlPoints));
        assert_eq!(FileRole::from_session_file("16_15.amc.zst"), Some(FileRole::GroundTruth));
        assert_eq!(FileRole::from_session_file("walk.bvh"), Some(FileRole::GroundTruth));
        assert_eq!(FileRole::from_session_file("notes.txt"), None);
        assert_eq!(FileRole::from_session_file("Calib.qca.txt"), Some(FileRole::Calibration));
        assert_eq!(FileRole::from_session_file("cam01.MP4"), Some(FileRole::Video));
        assert_eq!(FileRole::from_session_file("cam01.plate.png"), Some(FileRole::Plate));
        assert_eq!(FileRole::from_session_file("plates.zip"), Some(FileRole::Plate));
        assert_eq!(FileRole::from_session_file("images.zip"), Some(FileRole::Images));
        assert_eq!(FileRole::from_session_file("silhouettes.tar.gz"), Some(FileRole::Masks));
        assert_eq!(FileRole::from_session_file("scan.obj"), None);
        assert_eq!(FileRole::from_folder("Backgrounds"), FileRole::Plate);
        assert!(FileRole::is_picture_file("cam01.JPG") && !FileRole::is_picture_file("cam01.png.gz"));
        assert!(!FileRole::Video.fits_session_file("cam01.zip"));
        assert!(FileRole::is_scan_file("s001.obj") && !FileRole::is_scan_file("s001.bvh"));
        assert_eq!(FileRole::from_session_file(".csv"), None);
        assert!(FileRole::Skeleton.fits_session_file("a.bvh"));
        assert!(!FileRole::Skeleton.fits_session_file("a.csv"));
        assert!(FileRole::is_motion_file("all.tar.zst"));
        assert!(FileRole::is_motion_file("all.tgz"));
        assert!(!FileRole::is_motion_file("scan.obj"));
        assert!(!FileRole::is_motion_file("points.csv"));
    }

    #[test]
    fn a_name_tells_no_role_only_where_no_role_fits() {
        for name in ["points.txt", "scan.obj", "notes", ".csv"] {
            assert_eq!(FileRole::from_session_file(name), None, "{name}");
            assert!(!FileRole::ALL.into_iter().any(|role| role.fits_session_file(name)), "{name}");
        }
        let said = FileRole::session_endings();
        assert!(
            said.starts_with("skeleton .") && said.contains("; control-points .csv, .trc or .c3d; "),
            "{said}"
        );
        assert!(!said.contains("motion .") && !said.contains("scans ."), "{said}");
    }

    #[test]
    fn what_a_session_does_not_take_is_said() {
        let refused = |name: &str, stated| FileRole::in_session(name, stated).unwrap_err().to_string();
        assert!(
            refused("up.log", None)
                .starts_with("the type of \"up.log\" is not known; sessions take: skeleton")
        );
        assert!(
            refused("up.log", Some(FileRole::Skeleton)).starts_with("the type of \"up.log\" is not known")
        );
        let skeleton = refused("points.csv", Some(FileRole::Skeleton));
        assert_eq!(skeleton, "a skeleton must be .asf or .bvh, found \"points.csv\"");
        let motion = refused("walk.bvh", Some(FileRole::Motion));
        assert_eq!(motion, "role motion belongs to motion databases, not to sessions");
        for list in ["index.csv", "Index.CSV.zst"] {
            assert!(refused(list, None).contains("goes with files for motion databases"));
        }
        let points = Some(FileRole::ControlPoints);
        assert_eq!(FileRole::in_session("index.csv", points), Ok(FileRole::ControlPoints));
        assert_eq!(FileRole::in_session("walk.bvh", None), Ok(FileRole::GroundTruth));
        let unknown = "banana".parse::<FileRole>().unwrap_err().to_string();
        assert!(unknown.contains("control-points") && !unknown.contains("motion"), "{unknown}");
    }

    #[test]
    fn files_are_counted_in_words() {
        let points = FileRole::ControlPoints;
        let counted = [0, 1, 3].map(|count| points.counted(count));
        assert_eq!(
            counted,
            ["no file of control points", "1 file of control points", "3 files of control points"]
        );
        assert_eq!(FileRole::Skeleton.counted(2), "2 skeleton files");
        let several = FileRole::Calibration.keep_one(&["a.toml", "b.yaml"]);
        assert_eq!(several, "the session has 2 calibration files (a.toml, b.yaml); keep one");
    }

    #[test]
    fn files_with_the_endings_of_a_role_can_have_it() {
        assert_eq!(FileRole::ControlPoints.endings(), ".csv, .trc or .c3d");
        let motion = ".asf, .amc, .bvh, .zip, .tar, .tar.gz or .tar.zst";
        assert_eq!(FileRole::Motion.endings(), motion);
        for role in FileRole::ALL {
            let endings = role.endings().replace(" or ", ", ");
            for ending in endings.split(", ") {
                let name = format!("a{ending}");
                let fits = match role {
                    FileRole::Motion => FileRole::is_motion_file(&name),
                    FileRole::Scans => FileRole::is_scan_file(&name),
                    _ => role.fits_session_file(&name),
                };
                assert!(fits, "{name} as {role}");
            }
        }
    }

    #[test]
    fn words_are_the_same_in_json_and_in_messages() {
        for role in FileRole::ALL {
            assert_eq!(serde_json::to_value(role).unwrap(), role.to_string());
            assert_eq!(serde_json::from_value::<FileRole>(role.as_str().into()).unwrap(), role);
            assert_eq!(FileRole::try_from(role.to_string()), Ok(role));
        }
    }
}
