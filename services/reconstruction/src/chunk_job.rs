//! The job that reconstructs one chunk.

use crate::{RECONSTRUCT_CHUNK, Shared, error::InputError, payload::ReconstructChunk};
use queue::{Handler, JobContext, JobError, Outcome};
use service::{compute, objects};
use sparse::Session;
use std::{ops::ControlFlow, sync::Arc, time::Instant};

/// Artefact with the chunk's poses.
pub(crate) const CHUNK: &str = "chunk.bin";
/// Artefact that says who made them.
pub(crate) const REPORT: &str = "chunk.json";

pub(crate) struct ChunkHandler {
    shared: Arc<Shared>,
}

impl ChunkHandler {
    pub fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }
}

impl Handler for ChunkHandler {
    fn kind(&self) -> &'static str {
        RECONSTRUCT_CHUNK
    }

    async fn run(&self, job: JobContext) -> Result<Outcome, JobError> {
        let started = Instant::now();
        let Shared { resources, priors, .. } = &*self.shared;
        let store = &resources.store;
        objects::clean_up_earlier_attempts(store, &job).await;
        let payload: ReconstructChunk = job.payload()?;
        let session = objects::Input {
            name: "the session's artefact",
            store_key: &payload.session.store_key,
            blake3: &payload.session.blake3,
        };
        let session = objects::read(store, session, resources.memory.max_object_bytes).await?;
        let prior = priors.get(&payload.motion_database, payload.parameters.window).await?;
        let (frames, of) = (payload.end.saturating_sub(payload.start), job.clone());
        let reconstruction = compute::run(move || -> Result<_, InputError> {
            let session = Session::from_bytes(&session)?;
            let mut reconstructor = prior.reconstructor(&session, &payload.parameters)?;
            reconstructor.learn_zero_pose()?;
            let mut progress = |done: usize| {
                if of.is_cancelled() {
                    return ControlFlow::Break(());
                }
                let part = format!("part {} of {}", payload.chunk + 1, payload.num_chunks);
                of.progress(done as f64 / frames as f64, format!("{part}: frame {done} of {frames}"));
                ControlFlow::Continue(())
            };
            Ok(reconstructor.reconstruct(payload.start..payload.end, &mut progress)?)
        })
        .await?;
        job.check()?;
        let report = resources.job_report(&job, started, frames);
        let report = serde_json::to_vec(&report).map_err(JobError::retry)?;
        Ok(Outcome::default()
            .artefact(
                objects::write(store, &job, CHUNK, "application/octet-stream", reconstruction.to_bytes())
                    .await?,
            )
            .artefact(objects::write(store, &job, REPORT, "application/json", report).await?))
    }
}
