//! The job that puts the chunks together and writes the results.

use std::sync::Arc;

use camera_jobs::tracking_session;
use formats::media_type::BINARY;
use jobs::{
    JobReport,
    multi_view::{MergeTracks, TRACKED, TrackingSession},
    named,
};
use queue::{Handler, JobContext, JobError, Outcome};
use service::{compute, objects};
use tracking::{Chunk, Stage, hold_unseen, merge};

use crate::{
    InputError, Shared,
    finished::{Finished, Meeting},
    report,
    track_job::{chunk_name, report_name},
};

/// Largest artefact of a chunk, bytes: its longest has some thousand frames of a kilobyte.
const MAX_CHUNK_BYTES: u64 = 256 << 20;

pub(crate) struct MergeHandler {
    pub shared: Arc<Shared>,
}

impl Handler for MergeHandler {
    type Job = MergeTracks;

    async fn run(&self, context: JobContext, payload: MergeTracks) -> Result<Outcome, JobError> {
        let resources = &self.shared.resources;
        let store = &resources.store;
        context.progress(0.0, "putting the parts together");
        let session = Arc::new(tracking_session(resources, &payload.session).await?);
        let (finished, chunks) = self.merge(&context, &session).await?;
        let finished = Arc::new(finished);
        let packed = finished.clone();
        let tracked = compute::run(move || packed.tracked.to_bytes()).await.map_err(InputError::from)?;
        let tracked = objects::write(store, &context, TRACKED, BINARY, tracked).await?;
        let written = results::write(store, &context, results::formats(&finished), 0.2..0.95).await?;
        let merge = resources.job_report(&context, finished.tracked.frames.len());
        let run = report::run_json(resources.origin(&context), &session, &finished, &chunks, &merge)?;
        let run = results::write_one(store, &context, run).await?;
        Ok(Outcome::default().artefact(tracked).artefacts(written).artefact(run))
    }
}

impl MergeHandler {
    /// The whole session, and who tracked its parts.
    async fn merge(
        &self,
        context: &JobContext,
        session: &Arc<TrackingSession>,
    ) -> Result<(Finished, Vec<JobReport>), JobError> {
        let Shared { resources, models } = &*self.shared;
        let artefacts = resources.artefacts_before(context).await?;
        let (mut chunks, mut reports) = (Vec::new(), Vec::new());
        for index in 0.. {
            let name = chunk_name(index);
            let Some(artefact) = artefacts.iter().find(|artefact| artefact.name == name) else { break };
            context.check()?;
            let bytes = resources.read_artefact(artefact, MAX_CHUNK_BYTES).await?;
            chunks.push(Chunk::from_bytes(&bytes).map_err(JobError::retry)?);
            let report = named(&artefacts, &report_name(index))?;
            reports.push(resources.read_json(report, MAX_CHUNK_BYTES).await?);
        }
        let model = models.get(&session.request.body_model).await?;
        let session = session.clone();
        let finished = compute::run(move || -> Result<Finished, InputError> {
            let shape = model.shape(&session.alpha);
            let mut merged = merge(&model, &shape, &chunks)?;
            let meetings = merged.seams.iter().zip(chunks.windows(2)).map(|(seam, pair)| Meeting {
                seam: *seam,
                is_blind: has_unseen_in_common(&pair[0], &pair[1]),
            });
            let meetings = meetings.collect();
            drop(chunks);
            hold_unseen(&model, &shape, &mut merged.frames);
            let cameras = session.clips.iter().map(|clips| clips.camera.name.clone()).collect();
            let frame_rate = session.frame_rate;
            let tracked = Chunk { frames: merged.frames };
            Finished::new(model, shape, tracked, meetings, cameras, frame_rate)
        });
        Ok((finished.await?, reports))
    }
}

/// Whether nobody was found by one of two chunks in a frame that both have: they can't disagree there.
fn has_unseen_in_common(earlier: &Chunk, later: &Chunk) -> bool {
    let Some(begin) = later.frames.first().map(|tracked| tracked.frame) else { return true };
    let end = earlier.frames.last().map_or(0, |tracked| tracked.frame);
    let unseen = |chunk: &Chunk| {
        let common = chunk.frames.iter().filter(|tracked| (begin..=end).contains(&tracked.frame));
        common.into_iter().any(|tracked| tracked.stage == Stage::Unseen)
    };
    unseen(earlier) || unseen(later)
}
