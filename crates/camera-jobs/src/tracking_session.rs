use jobs::{CameraReport, JobReport, Object, PlanMultiView};
use queue::JobError;
use serde::{Deserialize, Serialize};
use service::{
    Resources,
    objects::{self, Input},
};

use crate::CameraClips;

/// Tracks one chunk of a session: [`TrackChunk`], taken by the refinement service.
pub const TRACK_CHUNK: &str = "track-chunk";
/// Puts the chunks together and writes the results: [`MergeTracks`], taken by the refinement service.
pub const MERGE_TRACKS: &str = "merge-tracks";
/// Draws the body over what a camera saw: [`DrawOverlay`], taken by the shape-init service.
pub const DRAW_OVERLAY: &str = "draw-overlay";

/// Name of the artefact that [`MERGE_TRACKS`] leaves for [`DRAW_OVERLAY`]: a `tracking::Chunk` of the whole session.
pub const TRACKED: &str = "tracked.bin";

/// Largest report of a session, bytes: a clip of ten minutes takes a few hundred.
const MAX_BYTES: u64 = 64 << 20;

/// What is known of a session when the person's shape was found: all that the jobs that follow them are given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrackingSession {
    /// what the run was asked for
    pub request: PlanMultiView,
    /// what the plan took
    pub plan: JobReport,
    /// what it took to find the shape
    pub initialise: JobReport,
    /// what was found of every camera
    pub cameras: Vec<CameraReport>,
    /// and its silhouettes, in the same order
    pub clips: Vec<CameraClips>,
    /// the shape: coefficients, standard deviations
    pub alpha: Vec<f64>,
    /// first frame
    pub first_frame: usize,
    /// one past the last frame that all cameras have
    pub end_frame: usize,
    /// frames a second
    pub frame_rate: f64,
    /// so far
    pub warnings: Vec<String>,
}

impl TrackingSession {
    /// Reads the artefact.
    ///
    /// # Errors
    /// As [`objects::read`].
    pub async fn read(resources: &Resources, object: &Object) -> Result<Self, JobError> {
        let Object { store_key, blake3 } = object;
        let input = Input { name: "the session's artefact", store_key, blake3 };
        let bytes = objects::read(&resources.store, input, MAX_BYTES).await?;
        serde_json::from_slice(&bytes).map_err(JobError::retry)
    }
}

/// Payload of [`TRACK_CHUNK`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrackChunk {
    /// a [`TrackingSession`]
    pub session: Object,
    /// which chunk, from 0
    pub chunk: usize,
    /// how many there are
    pub num_chunks: usize,
    /// first frame
    pub start: usize,
    /// one past the last frame
    pub end: usize,
}

/// Payload of [`MERGE_TRACKS`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MergeTracks {
    /// a [`TrackingSession`]
    pub session: Object,
}

/// Payload of [`DRAW_OVERLAY`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DrawOverlay {
    /// a [`TrackingSession`]
    pub session: Object,
    /// index of the camera
    pub camera: usize,
}
