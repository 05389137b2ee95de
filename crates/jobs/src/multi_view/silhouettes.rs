//! The silhouettes of one camera: the job that makes them, and what it leaves for those after it.

use background::CameraQuality;
use model::shown_rate;
use multi_view::{CameraRecord, Parameters};
use queue::{Artefact, Job, JobError};
use serde::{Deserialize, Serialize};

use crate::{InputFile, JobReport, Object, named};

/// Makes the silhouettes of one camera. Made by the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MakeSilhouettes {
    /// index of the camera among those of the run
    pub index: usize,
    /// as it was calibrated
    pub camera: CameraRecord,
    /// its pictures
    pub source: Source,
    /// the empty scene
    pub plate: Option<Source>,
    /// all resolved
    pub parameters: Parameters,
}

impl Job for MakeSilhouettes {
    const KIND: &'static str = "make-silhouettes";
    // More than usual, as one may be lost with each worker that is taken away.
    const MAX_ATTEMPTS: i32 = 5;
}

/// Where the pictures of a camera are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// what messages call it: the file, or `ARCHIVE/FOLDER`
    pub name: String,
    /// how it is read
    pub kind: SourceKind,
    /// the upload
    pub file: InputFile,
    /// which members of it, if it is an archive
    pub members: Option<Members>,
}

/// How pictures are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceKind {
    /// frames of a video
    Video,
    /// a PNG or JPEG a frame
    Images,
    /// a silhouette a frame
    Masks,
    /// one picture of the empty scene
    Plate,
}

/// Members of an archive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Members {
    /// the pictures of a folder, empty at the top
    Folder(String),
    /// those of a folder whose names begin so, before the number
    Prefix {
        /// empty at the top
        folder: String,
        /// up to the number
        prefix: String,
    },
    /// one, by its whole name
    One(String),
}

/// What one job of silhouettes leaves beside the clips.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraReport {
    /// index of the camera among those of the run
    pub index: usize,
    /// as it fits the pictures that were read
    pub camera: CameraRecord,
    /// where its pictures are
    pub source: Source,
    /// the empty scene, if there was a picture of it
    pub plate: Option<String>,
    /// frame after the last
    pub end_frame: usize,
    /// frames a second, if the file tells
    pub frame_rate: Option<f64>,
    /// how far to trust the silhouettes; none for masks
    pub quality: Option<CameraQuality>,
    /// what was assumed, and what to do better
    pub warnings: Vec<String>,
    /// the clips in their order
    pub clips: Vec<ClipPlace>,
    /// clips of points that were found again from frame to frame, of the same frames; none where there are no pictures
    #[serde(default)]
    pub matches: Vec<ClipPlace>,
    /// what it took
    pub job: JobReport,
}

/// What `run.json` says of a camera.
#[derive(Debug, Clone, Serialize)]
pub struct CameraSummary<'a> {
    name: &'a str,
    source: &'a str,
    plate: Option<&'a str>,
    size: [u32; 2],
    end_frame: usize,
    frame_rate_hz: Option<f64>,
    quality: Option<&'a CameraQuality>,
    warnings: &'a [String],
}

impl CameraReport {
    /// For people.
    pub fn summary(&self) -> CameraSummary<'_> {
        CameraSummary {
            name: &self.camera.name,
            source: &self.source.name,
            plate: self.plate.as_deref(),
            size: self.camera.size,
            end_frame: self.end_frame,
            frame_rate_hz: self.frame_rate,
            quality: self.quality.as_ref(),
            warnings: &self.warnings,
        }
    }
}

/// One clip of silhouettes, or of points.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClipPlace {
    /// name of the artefact
    pub name: String,
    /// first frame in it
    pub first_frame: usize,
    /// frames in it
    pub num_frames: usize,
}

/// A clip of silhouettes, or of points that were found again, in the store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredClip {
    /// first frame in it
    pub first_frame: usize,
    /// frames in it
    pub num_frames: usize,
    /// where it is
    pub object: Object,
}

/// A camera and its clips, in the order of their frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraClips {
    /// as it fits the silhouettes
    pub camera: CameraRecord,
    /// without gaps
    pub clips: Vec<StoredClip>,
    /// points that were found again, of the same frames; none where there are no pictures
    #[serde(default)]
    pub matches: Vec<StoredClip>,
}

impl CameraClips {
    /// The clips that a camera's job reported, among what it left.
    ///
    /// # Errors
    /// To be tried again if one is missing.
    pub fn new(report: &CameraReport, artefacts: &[Artefact]) -> Result<Self, JobError> {
        let stored = |place: &ClipPlace| {
            let object = Object::from(named(artefacts, &place.name)?);
            Ok(StoredClip { first_frame: place.first_frame, num_frames: place.num_frames, object })
        };
        let all =
            |places: &[ClipPlace]| places.iter().map(stored).collect::<Result<Vec<StoredClip>, JobError>>();
        let (clips, matches) = (all(&report.clips)?, all(&report.matches)?);
        Ok(Self { camera: report.camera.clone(), clips, matches })
    }
}

/// Name of the artefact with the report of a camera.
pub fn report_name(index: usize) -> String {
    format!("camera-{index:03}.json")
}

/// Name of the artefact with a clip of a camera.
pub fn clip_name(index: usize, first_frame: usize) -> String {
    format!("clip-{index:03}-{first_frame:08}.sil")
}

/// Name of the artefact with the points of a camera that were found again, of the frames of a clip.
pub fn matches_name(index: usize, first_frame: usize) -> String {
    format!("matches-{index:03}-{first_frame:08}.mat")
}

/// Name of the artefact with the picture of a frame of a camera.
pub fn picture_name(index: usize, frame: usize) -> String {
    format!("picture-{index:03}-{frame:08}.png")
}

/// Frames a second at which all cameras recorded, if a file tells; with a warning where they differ.
pub fn frame_rate(cameras: &[CameraReport], warnings: &mut Vec<String>) -> Option<f64> {
    let mut known = cameras.iter().filter_map(|camera| Some((&camera.camera.name, camera.frame_rate?)));
    let (first, rate) = known.next()?;
    if let Some((other, found)) = known.find(|(_, found)| (found - rate).abs() > 0.01 * rate) {
        let taken = shown_rate(rate);
        warnings.push(format!(
            "camera {other} has {} frames a second, camera {first} {taken}: all are taken to have {taken}; convert \
             them to one rate",
            shown_rate(found)
        ));
    }
    Some(rate)
}
