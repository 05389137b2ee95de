use std::ops::Range;

use jobs::{
    Object,
    multi_view::{CameraClips, CameraReport, StoredClip, report_name},
};
use model::{Camera, PointMatch, Silhouette};
use multi_view::{MatchClip, SilhouetteClip};
use queue::{Artefact, JobError};
use service::{
    Resources, compute,
    objects::{self, Input},
};

/// Largest artefact of silhouettes or of a report, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// What one camera saw of the person.
pub type View = (Camera, Silhouette);

/// What was found of every camera, in their order.
///
/// # Errors
/// As [`objects::read_json`].
pub async fn reports(resources: &Resources, artefacts: &[Artefact]) -> Result<Vec<CameraReport>, JobError> {
    let mut reports = Vec::new();
    for index in 0.. {
        let name = report_name(index);
        let Some(artefact) = artefacts.iter().find(|artefact| artefact.name == name) else { break };
        reports.push(resources.read_json(artefact, MAX_BYTES).await?);
    }
    Ok(reports)
}

/// The silhouettes of all cameras in a run of frames, and the points that were found again: in memory as they are packed, a few
/// kilobytes each.
#[derive(Debug, Clone)]
pub struct Silhouettes {
    cameras: Vec<CameraFrames>,
}

#[derive(Debug, Clone)]
struct CameraFrames {
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
        for stored in cameras {
            let camera = stored.camera.camera().map_err(JobError::retry)?;
            let clips = clips(resources, &stored.clips, &frames, SilhouetteClip::from_bytes).await?;
            let matches = self::clips(resources, &stored.matches, &frames, MatchClip::from_bytes).await?;
            read.push(CameraFrames { camera, clips, matches });
        }
        Ok(Self { cameras: read })
    }

    /// What all cameras saw in a frame.
    ///
    /// # Errors
    /// If a camera has no silhouette of it, or a damaged one.
    pub fn views(&self, frame: usize) -> multi_view::Result<Vec<View>> {
        let view = |CameraFrames { camera, clips, .. }: &CameraFrames| {
            let clip = clips.iter().find(|clip| clip.frames().contains(&frame));
            let missing = || {
                let start = clips.first().map_or(0, |clip| clip.frames().start);
                let end = clips.last().map_or(0, |clip| clip.frames().end);
                multi_view::Error::Frame { found: frame, start, end }
            };
            Ok((camera.clone(), clip.ok_or_else(missing)?.get(frame)?))
        };
        self.cameras.iter().map(view).collect()
    }

    /// The points of every camera that were found again in a frame; none where they were not looked for.
    ///
    /// # Errors
    /// If they are damaged.
    pub fn matches(&self, frame: usize) -> multi_view::Result<Vec<Vec<PointMatch>>> {
        let matches = |camera: &CameraFrames| {
            let clip = camera.matches.iter().find(|clip| clip.frames().contains(&frame));
            clip.map_or(Ok(Vec::new()), |clip| clip.get(frame))
        };
        self.cameras.iter().map(matches).collect()
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
