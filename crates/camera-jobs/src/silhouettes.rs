use std::ops::Range;

use jobs::{CameraReport, Object, report_name};
use model::{Camera, PointMatch, Silhouette};
use multi_view::{CameraRecord, MatchClip, SilhouetteClip};
use queue::{Artefact, JobError};
use serde::{Deserialize, Serialize};
use service::{
    Resources, compute,
    objects::{self, Input},
};

/// Largest artefact of silhouettes or of a report, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// What one camera saw of the person.
pub type View = (Camera, Silhouette);

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
        let stored = |place: &jobs::ClipPlace| {
            let artefact = named(artefacts, &place.name)
                .ok_or_else(|| JobError::retry(format!("{} is missing", place.name)))?;
            let object = Object { store_key: artefact.store_key.clone(), blake3: artefact.blake3.clone() };
            Ok(StoredClip { first_frame: place.first_frame, num_frames: place.num_frames, object })
        };
        let all = |places: &[jobs::ClipPlace]| {
            places.iter().map(stored).collect::<Result<Vec<StoredClip>, JobError>>()
        };
        let (clips, matches) = (all(&report.clips)?, all(&report.matches)?);
        Ok(Self { camera: report.camera.clone(), clips, matches })
    }
}

/// The artefact of that name.
pub fn named<'a>(artefacts: &'a [Artefact], name: &str) -> Option<&'a Artefact> {
    artefacts.iter().find(|artefact| artefact.name == name)
}

/// What was found of every camera, in their order.
///
/// # Errors
/// As [`objects::read`].
pub async fn reports(resources: &Resources, artefacts: &[Artefact]) -> Result<Vec<CameraReport>, JobError> {
    let mut reports = Vec::new();
    for index in 0.. {
        let Some(artefact) = named(artefacts, &report_name(index)) else { break };
        let bytes = resources.read_artefact(artefact, MAX_BYTES).await?;
        reports.push(serde_json::from_slice(&bytes).map_err(JobError::retry)?);
    }
    Ok(reports)
}

/// The silhouettes of all cameras in a run of frames, and the points that were found again: in memory as they are packed, a few
/// kilobytes each.
#[derive(Debug, Clone)]
pub struct Silhouettes {
    cameras: Vec<OfCamera>,
}

#[derive(Debug, Clone)]
struct OfCamera {
    camera: Camera,
    clips: Vec<SilhouetteClip>,
    matches: Vec<MatchClip>,
}

impl Silhouettes {
    /// Reads the clips that have some of the frames, and no others.
    ///
    /// # Errors
    /// As [`objects::read`]; to be tried again if a clip is damaged.
    pub async fn read(
        resources: &Resources,
        cameras: &[CameraClips],
        frames: Range<usize>,
    ) -> Result<Self, JobError> {
        let mut read = Vec::with_capacity(cameras.len());
        for of in cameras {
            let camera = of.camera.camera().map_err(JobError::retry)?;
            let clips = clips(resources, &of.clips, &frames, SilhouetteClip::from_bytes).await?;
            let matches = self::clips(resources, &of.matches, &frames, MatchClip::from_bytes).await?;
            read.push(OfCamera { camera, clips, matches });
        }
        Ok(Self { cameras: read })
    }

    /// What all cameras saw in a frame.
    ///
    /// # Errors
    /// If a camera has no silhouette of it, or a damaged one.
    pub fn views(&self, frame: usize) -> multi_view::Result<Vec<View>> {
        let of_camera = |OfCamera { camera, clips, .. }: &OfCamera| {
            let clip = clips.iter().find(|clip| clip.frames().contains(&frame));
            let missing = || {
                let start = clips.first().map_or(0, |clip| clip.frames().start);
                let end = clips.last().map_or(0, |clip| clip.frames().end);
                multi_view::Error::Frame { found: frame, start, end }
            };
            Ok((camera.clone(), clip.ok_or_else(missing)?.get(frame)?))
        };
        self.cameras.iter().map(of_camera).collect()
    }

    /// The points of every camera that were found again in a frame; none where they were not looked for.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn matches(&self, frame: usize) -> multi_view::Result<Vec<Vec<PointMatch>>> {
        let of_camera = |of: &OfCamera| {
            let clip = of.matches.iter().find(|clip| clip.frames().contains(&frame));
            clip.map_or(Ok(Vec::new()), |clip| clip.get(frame))
        };
        self.cameras.iter().map(of_camera).collect()
    }
}

/// Reads the clips that have some of the frames.
async fn clips<T: Send + 'static>(
    resources: &Resources,
    stored: &[StoredClip],
    frames: &Range<usize>,
    from_bytes: fn(&[u8]) -> multi_view::Result<T>,
) -> Result<Vec<T>, JobError> {
    let is_wanted = |clip: &&StoredClip| {
        clip.first_frame < frames.end && clip.first_frame + clip.num_frames > frames.start
    };
    let mut read = Vec::new();
    for clip in stored.iter().filter(is_wanted) {
        let Object { store_key, blake3 } = &clip.object;
        let input = Input { name: "a clip of a camera", store_key, blake3 };
        let bytes = objects::read(&resources.store, input, MAX_BYTES).await?;
        let clip = compute::run(move || from_bytes(&bytes)).await;
        read.push(clip.map_err(JobError::retry)?);
    }
    Ok(read)
}
