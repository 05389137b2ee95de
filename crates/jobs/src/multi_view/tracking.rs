//! Finding the shape of a person, and following them with it.

use queue::Job;
use serde::{Deserialize, Serialize};

use super::{CameraClips, CameraReport, PlanMultiView};
use crate::{JobReport, Object};

/// Name of the artefact that [`MergeTracks`] leaves for [`DrawOverlay`]: a `tracking::Chunk` of the whole session.
pub const TRACKED: &str = "tracked.bin";

/// Finds pose and shape in the first frames, and enqueues the jobs that follow the person. Made by the plan, taken by the
/// shape-init service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitShape {
    /// what the plan was given
    pub request: PlanMultiView,
    /// problems in the files
    pub warnings: Vec<String>,
    /// what the plan itself took
    pub plan: JobReport,
}

impl Job for FitShape {
    const KIND: &'static str = "fit-shape";
}

/// What is known of a session when the person's shape was found: all that the jobs that follow them are given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrackingSession {
    /// what the run was asked for
    pub request: PlanMultiView,
    /// what the plan took
    pub plan: JobReport,
    /// what it took to find the shape
    // as sessions have it whose chunks older workers track
    #[serde(rename = "initialise")]
    pub fit_shape: JobReport,
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

/// Follows the person through one chunk of a session. Taken by the refinement service.
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

impl Job for TrackChunk {
    const KIND: &'static str = "track-chunk";
    // More than usual, as one may be lost with each worker that is taken away.
    const MAX_ATTEMPTS: i32 = 5;
}

/// Puts the chunks together and writes the results. Taken by the refinement service.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MergeTracks {
    /// a [`TrackingSession`]
    pub session: Object,
}

impl Job for MergeTracks {
    const KIND: &'static str = "merge-tracks";
}

/// Draws the body over what a camera saw. Taken by the shape-init service.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DrawOverlay {
    /// a [`TrackingSession`]
    pub session: Object,
    /// index of the camera
    pub camera: usize,
}

impl Job for DrawOverlay {
    const KIND: &'static str = "draw-overlay";
}
