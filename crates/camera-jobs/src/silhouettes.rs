use std::ops::Range;

use model::{Camera, Silhouette};
use multi_view::{CameraRecord, SilhouetteClip};
use payloads::{CameraReport, Object, report_name};
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

/// A clip of silhouettes in the store.
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
}

impl CameraClips {
    /// The clips that a camera's job reported, among what it left.
    ///
    /// # Errors
    /// To be tried again if one is missing.
    pub fn new(report: &CameraReport, artefacts: &[Artefact]) -> Result<Self, JobError> {
        let stored = |place: &payloads::ClipPlace| {
            let artefact = named(artefacts, &place.name)
                .ok_or_else(|| JobError::retry(format!("{} is missing", place.name)))?;
            let object = Object { store_key: artefact.store_key.clone(), blake3: artefact.blake3.clone() };
            Ok(StoredClip { first_frame: place.first_frame, num_frames: place.num_frames, object })
        };
        let clips: Result<_, JobError> = report.clips.iter().map(stored).collect();
        Ok(Self { camera: report.camera.clone(), clips: clips? })
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

/// The silhouettes of all cameras in a run of frames: in memory as they are packed, about a kilobyte each.
#[derive(Debug, Clone)]
pub struct Silhouettes {
    cameras: Vec<(Camera, Vec<SilhouetteClip>)>,
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
            let mut clips = Vec::new();
            let is_wanted = |clip: &&StoredClip| {
                clip.first_frame < frames.end && clip.first_frame + clip.num_frames > frames.start
            };
            for clip in of.clips.iter().filter(is_wanted) {
                let Object { store_key, blake3 } = &clip.object;
                let input = Input { name: "a clip of silhouettes", store_key, blake3 };
                let bytes = objects::read(&resources.store, input, MAX_BYTES).await?;
                let clip = compute::run(move || SilhouetteClip::from_bytes(&bytes)).await;
                clips.push(clip.map_err(JobError::retry)?);
            }
            read.push((camera, clips));
        }
        Ok(Self { cameras: read })
    }

    /// What all cameras saw in a frame.
    ///
    /// # Errors
    /// If a camera has no silhouette of it, or a damaged one.
    pub fn views(&self, frame: usize) -> multi_view::Result<Vec<View>> {
        let of_camera = |(camera, clips): &(Camera, Vec<SilhouetteClip>)| {
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
}
