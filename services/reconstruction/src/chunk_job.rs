//! The job that reconstructs one chunk.

use crate::{Shared, error::InputError};
use formats::media_type::BINARY;
use jobs::sparse::ReconstructChunk;
use queue::{Handler, JobContext, JobError, Outcome};
use service::{compute, objects};
use sparse::Session;
use std::{ops::ControlFlow, sync::Arc};

/// Artefact with the chunk's poses.
pub(crate) const CHUNK: &str = "chunk.bin";
/// Artefact that says who made them.
pub(crate) const REPORT: &str = "chunk.json";

pub(crate) struct ChunkHandler {
    pub shared: Arc<Shared>,
}

impl Handler for ChunkHandler {
    type Job = ReconstructChunk;

    async fn run(&self, context: JobContext, payload: ReconstructChunk) -> Result<Outcome, JobError> {
        let Shared { resources, priors, .. } = &*self.shared;
        let store = &resources.store;
        let session = objects::Input {
            name: "the session's artefact",
            store_key: &payload.session.store_key,
            blake3: &payload.session.blake3,
        };
        let session = objects::read(store, session, resources.memory.max_object_bytes).await?;
        let prior = priors.get(&payload.motion_database, payload.parameters.window).await?;
        let (frames, watched) = (payload.end.saturating_sub(payload.start), context.clone());
        let reconstruction = compute::run(move || -> Result<_, InputError> {
            let session = Session::from_bytes(&session)?;
            let mut reconstructor = prior.reconstructor(&session, &payload.parameters)?;
            reconstructor.learn_zero_pose()?;
            let mut progress = |done: usize| {
                if watched.is_cancelled() {
                    return ControlFlow::Break(());
                }
                let part = format!("part {} of {}", payload.chunk + 1, payload.num_chunks);
                watched.progress(done as f64 / frames as f64, format!("{part}: frame {done} of {frames}"));
                ControlFlow::Continue(())
            };
            Ok(reconstructor.reconstruct(payload.start..payload.end, &mut progress)?)
        })
        .await?;
        context.check()?;
        let report = resources.job_report(&context, frames);
        let chunk = objects::write(store, &context, CHUNK, BINARY, reconstruction.to_bytes()).await?;
        let report = objects::write_json(store, &context, REPORT, &report).await?;
        Ok(Outcome::default().artefact(chunk).artefact(report))
    }
}
