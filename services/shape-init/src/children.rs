//! The jobs that follow a person whose shape was found.

use jobs::{
    Object,
    multi_view::{DrawOverlay, MergeTracks, TrackChunk, TrackingSession},
};
use queue::ChildJob;
use tracking::plan_chunks;

/// Weight of the job that enqueues these, and the share of it that it shows while it runs: a run's progress never goes back, so
/// room is kept for jobs that are not there yet.
pub(crate) const FIT_WEIGHT: f64 = 12.0;
pub(crate) const FIT_SHOWN: f64 = 0.15;
/// Frames that are merged, and frames that are drawn for one camera, in the time of one that is tracked.
const MERGE_SPEED: f64 = 50.0;
const DRAW_SPEED: f64 = 8.0;

/// A job for each chunk, the one that waits for all of them, and one for the video of each camera. How the session is cut is up
/// to its length and parameters alone.
pub(crate) fn children(session: &TrackingSession, object: &Object) -> Result<Vec<ChildJob>, queue::Error> {
    let parameters = &session.request.parameters;
    let num_frames = session.end_frame - session.first_frame;
    let chunks = plan_chunks(num_frames, parameters.chunk_frames, parameters.overlap_frames);
    let num_videos = if parameters.overlay { session.cameras.len() } else { 0 };
    let tracked: usize = chunks.iter().map(|chunk| chunk.end - chunk.first).sum();
    let frames = tracked as f64 + num_frames as f64 * (1.0 / MERGE_SPEED + num_videos as f64 / DRAW_SPEED);
    let weight_of_frame = weight_of_all(session.cameras.len()) / frames.max(1.0);
    let (num_chunks, mut jobs) = (chunks.len(), Vec::new());
    for (index, chunk) in chunks.into_iter().enumerate() {
        let job = TrackChunk {
            session: object.clone(),
            chunk: index,
            num_chunks,
            start: session.first_frame + chunk.first,
            end: session.first_frame + chunk.end,
        };
        jobs.push(ChildJob::new(&job)?.weight((chunk.end - chunk.first) as f64 * weight_of_frame));
    }
    let weight = num_frames as f64 * weight_of_frame;
    let merge = MergeTracks { session: object.clone() };
    jobs.push(ChildJob::new(&merge)?.weight(weight / MERGE_SPEED).depends_on(0..num_chunks));
    for camera in 0..num_videos {
        let overlay = DrawOverlay { session: object.clone(), camera };
        jobs.push(ChildJob::new(&overlay)?.weight(weight / DRAW_SPEED).depends_on([num_chunks]));
    }
    Ok(jobs)
}

/// Weight of all these jobs: so much that the run's progress, when they come in and their parent is done, stays where it was.
fn weight_of_all(num_cameras: usize) -> f64 {
    // the plan and the jobs of the cameras weigh 1 each
    let others = 1.0 + num_cameras as f64;
    let done = others + FIT_WEIGHT;
    done * done / (others + FIT_SHOWN * FIT_WEIGHT) - done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_goes_on_where_it_was_when_the_jobs_come_in() {
        for cameras in [2, 4, 16] {
            let before = 1.0 + cameras as f64 + FIT_WEIGHT;
            let shown = (1.0 + cameras as f64 + FIT_SHOWN * FIT_WEIGHT) / before;
            let after = before / (before + weight_of_all(cameras));
            assert!((shown - after).abs() < 1e-12 && (0.2..0.7).contains(&shown), "{shown} then {after}");
        }
    }
}
