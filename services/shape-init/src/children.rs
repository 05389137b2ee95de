//! The jobs that follow a person whose shape was found.

use camera_jobs::{
    DRAW_OVERLAY, DrawOverlay, MERGE_TRACKS, MergeTracks, TRACK_CHUNK, TrackChunk, TrackingSession,
};
use payloads::Object;
use queue::{ChildJob, JobError};
use tracking::plan_chunks;

/// Attempts of a chunk: more than usual, as one may be lost with each worker that is taken away.
const CHUNK_ATTEMPTS: i32 = 5;
/// Weight of jobs in the run's progress: tracked frames for a weight of 1.
const FRAMES_PER_WEIGHT: f64 = 30.0;
/// Frames that are merged, and frames that are drawn for one camera, in the time of one that is tracked.
const MERGE_SPEED: f64 = 50.0;
const DRAW_SPEED: f64 = 8.0;

/// A job for each chunk, the one that waits for all of them, and one for the video of each camera. How the session is cut is up
/// to its length and parameters alone.
pub(crate) fn of(session: &TrackingSession, object: &Object) -> Result<Vec<ChildJob>, JobError> {
    let parameters = &session.request.parameters;
    let num_frames = session.end_frame - session.first_frame;
    let chunks = plan_chunks(num_frames, parameters.chunk_frames, parameters.overlap_frames);
    let (num_chunks, mut jobs) = (chunks.len(), Vec::new());
    for (index, chunk) in chunks.into_iter().enumerate() {
        let payload = TrackChunk {
            session: object.clone(),
            chunk: index,
            num_chunks,
            start: session.first_frame + chunk.first,
            end: session.first_frame + chunk.end,
        };
        let payload = serde_json::to_value(payload).map_err(JobError::retry)?;
        let weight = (chunk.end - chunk.first) as f64 / FRAMES_PER_WEIGHT;
        jobs.push(ChildJob::new(TRACK_CHUNK, payload).weight(weight).max_attempts(CHUNK_ATTEMPTS));
    }
    let weight = num_frames as f64 / FRAMES_PER_WEIGHT;
    let merge = serde_json::to_value(MergeTracks { session: object.clone() }).map_err(JobError::retry)?;
    jobs.push(ChildJob::new(MERGE_TRACKS, merge).weight(weight / MERGE_SPEED).depends_on(0..num_chunks));
    for camera in 0..if parameters.overlay { session.cameras.len() } else { 0 } {
        let payload = DrawOverlay { session: object.clone(), camera };
        let payload = serde_json::to_value(payload).map_err(JobError::retry)?;
        let job = ChildJob::new(DRAW_OVERLAY, payload).weight(weight / DRAW_SPEED);
        jobs.push(job.depends_on([num_chunks]));
    }
    Ok(jobs)
}
