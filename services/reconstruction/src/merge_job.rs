//! The job that puts the chunks together and writes the results.

use crate::{
    Shared, chunk_job,
    error::InputError,
    evaluate, export,
    feet::{self, Finished},
    plan_job, run_report,
};
use formats::FileRole;
use jobs::{JobReport, sparse::MergeChunks};
use queue::{Handler, JobContext, JobError, Outcome};
use results::ResultFile;
use service::{compute, objects};
use sparse::{Reconstruction, Session};
use std::sync::Arc;

pub(crate) struct MergeHandler {
    pub shared: Arc<Shared>,
}

impl Handler for MergeHandler {
    type Job = MergeChunks;

    async fn run(&self, context: JobContext, payload: MergeChunks) -> Result<Outcome, JobError> {
        let resources = &self.shared.resources;
        let store = &resources.store;
        context.progress(0.0, "putting the parts together");
        let (finished, chunks) = self.merge(&context, &payload).await?;
        let written = results::write(store, &context, export::files(&finished), 0.3..0.9).await?;
        context.progress(0.9, "comparing with the ground truth");
        let mut last: Vec<ResultFile> = self.evaluate(&payload, &finished).await?.into_iter().collect();
        let merge = resources.job_report(&context, finished.merged.quality.len());
        last.push(run_report::file(resources.origin(&context), &payload, &finished, &chunks, &merge)?);
        let last = results::write(store, &context, last, 0.95..1.0).await?;
        Ok(Outcome::default().artefacts(written).artefacts(last))
    }
}

impl MergeHandler {
    /// The whole motion, and who made its parts.
    async fn merge(
        &self,
        context: &JobContext,
        payload: &MergeChunks,
    ) -> Result<(Arc<Finished>, Vec<JobReport>), JobError> {
        let Shared { resources, priors, .. } = &*self.shared;
        let (store, limit) = (&resources.store, resources.memory.max_object_bytes);
        let artefacts = resources.artefacts_before(context).await?;
        let (mut parts, mut reports) = (Vec::new(), Vec::new());
        for artefact in &artefacts {
            match artefact.name.as_str() {
                chunk_job::CHUNK => parts.push(resources.read_artefact(artefact, limit).await?),
                chunk_job::REPORT => reports.push(resources.read_json(artefact, limit).await?),
                _ => {}
            }
            context.check()?;
        }
        let session = objects::Input {
            name: "the session's artefact",
            store_key: &payload.session.store_key,
            blake3: &payload.session.blake3,
        };
        let session = objects::read(store, session, limit).await?;
        let database = priors.database(&payload.request.motion_database).await?;
        let parameters = payload.request.parameters.clone();
        let finished = compute::run(move || -> Result<Finished, InputError> {
            let session = Session::from_bytes(&session)?;
            let parts: Result<Vec<_>, _> =
                parts.iter().map(|part| Reconstruction::from_bytes(part)).collect();
            let merged = sparse::merge(&database, &session, &parameters, &parts?)?;
            Ok(if parameters.foot_contacts {
                feet::hold(&database, &session, merged)
            } else {
                Finished { merged, feet: None }
            })
        });
        Ok((Arc::new(finished.await?), reports))
    }

    /// The errors against the ground truth, if there is one.
    async fn evaluate(
        &self,
        payload: &MergeChunks,
        finished: &Arc<Finished>,
    ) -> Result<Option<ResultFile>, JobError> {
        let Shared { resources, priors, .. } = &*self.shared;
        let store = &resources.store;
        let files = &payload.request.inputs.files;
        if !files.iter().any(|f| f.role == FileRole::GroundTruth) {
            return Ok(None);
        }
        let wanted: Vec<_> = files.iter().filter(|f| f.role != FileRole::ControlPoints).cloned().collect();
        let fetched = plan_job::fetch(store, &wanted, resources.memory.max_object_bytes).await?;
        let database = priors.database(&payload.request.motion_database).await?;
        let finished = finished.clone();
        let reading = payload.request.reading_options();
        let errors =
            compute::run(move || evaluate::errors(&fetched, &database, &finished.merged.motion, reading))
                .await?;
        let Some(errors) = errors else { return Ok(None) };
        Ok(Some(ResultFile::json(evaluate::EVALUATION, &errors)?))
    }
}
