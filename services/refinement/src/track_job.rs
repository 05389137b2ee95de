//! The job that follows a person through one chunk of a session.

use std::sync::{Arc, atomic::AtomicBool};

use body::BodyModel;
use camera_jobs::{Silhouettes, View, tracking_session};
use formats::media_type::BINARY;
use jobs::multi_view::{TrackChunk, TrackingSession};
use queue::{Handler, JobContext, JobError, Outcome};
use service::{
    compute::{self, StopOnDrop},
    objects,
};
use tracking::{Chunk, Footage, Seen, Tracker, track_footage};

use crate::{InputError, Shared, options};

pub(crate) struct TrackHandler {
    pub shared: Arc<Shared>,
}

/// Name of the artefact with the frames of a chunk.
pub(crate) fn chunk_name(index: usize) -> String {
    format!("chunk-{index:06}.bin")
}

/// Name of the artefact that says who tracked a chunk.
pub(crate) fn report_name(index: usize) -> String {
    format!("chunk-{index:06}.json")
}

impl Handler for TrackHandler {
    type Job = TrackChunk;

    async fn run(&self, context: JobContext, payload: TrackChunk) -> Result<Outcome, JobError> {
        let Shared { resources, models } = &*self.shared;
        let store = &resources.store;
        context.progress(0.0, format!("part {} of {}: reading", payload.chunk + 1, payload.num_chunks));
        let session = tracking_session(resources, &payload.session).await?;
        let frames = payload.start..payload.end;
        let silhouettes = Silhouettes::read(resources, &session.clips, frames.clone()).await?;
        let model = models.get(&session.request.body_model).await?;
        let stop = StopOnDrop::default();
        let (watched, flag, chunk) = (context.clone(), stop.flag(), payload.clone());
        let tracked = compute::run(move || track(&model, &session, &silhouettes, &chunk, &watched, &flag));
        tokio::pin!(tracked);
        let chunk = tokio::select! {
            chunk = &mut tracked => chunk,
            () = context.cancelled() => {
                // it is looked at before every step inside a frame
                stop.stop();
                tracked.await
            }
        };
        context.check()?;
        let bytes = chunk?.to_bytes().map_err(InputError::from)?;
        let report = resources.job_report(&context, frames.len());
        let chunk = objects::write(store, &context, &chunk_name(payload.chunk), BINARY, bytes).await?;
        let report = objects::write_json(store, &context, &report_name(payload.chunk), &report).await?;
        Ok(Outcome::default().artefact(chunk).artefact(report))
    }
}

/// All of the work on the frames.
fn track(
    model: &BodyModel,
    session: &TrackingSession,
    silhouettes: &Silhouettes,
    payload: &TrackChunk,
    context: &JobContext,
    stop: &AtomicBool,
) -> Result<Chunk, InputError> {
    let parameters = &session.request.parameters;
    let fit_options = options::fit(parameters);
    // until the person is found
    let rest = vec![0.0; model.rig().num_dofs()];
    let mut tracker = Tracker::new(model, &session.alpha, &rest, options::run(parameters))?;
    let num_frames = payload.end - payload.start;
    let footage = Footage {
        frames: payload.start..payload.end,
        see: |frame| {
            let (views, matches) = (silhouettes.views(frame)?, silhouettes.matches(frame)?);
            Ok::<_, InputError>(Seen { views, matches })
        },
        find: |views: &[View]| {
            let found = shape_fit::fit_pose(model, &session.alpha, views, &fit_options);
            found.ok().map(|fit| fit.pose)
        },
    };
    track_footage(&mut tracker, footage, stop, |done| {
        let part = format!("part {} of {}", payload.chunk + 1, payload.num_chunks);
        let phrase = format!("{part}: frame {done} of {num_frames}");
        context.progress(done as f64 / num_frames.max(1) as f64, phrase);
    })
}
