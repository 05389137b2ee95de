//! The job that trains a latent variable model of poses on a motion database.

use crate::plan_job::full_name;
use jobs::{
    motion_database::TrainGplvm,
    run_json::{RunReport, Timings},
};
use library::{motion_database, versions::motion_databases};
use queue::{Handler, JobContext, JobError, JobId, Outcome};
use serde_json::json;
use service::{MakesVersion, Resources, compute};
use std::ops::ControlFlow;
use store::{Key, key};

/// Name of the model in the object store.
const MODEL: &str = "gplvm.model";

pub(crate) struct TrainHandler {
    pub resources: Resources,
}

impl MakesVersion for TrainHandler {
    fn version_prefix(job: &TrainGplvm, id: JobId) -> Key {
        key::motion_database_job_prefix(job.motion_database.id, id.0)
    }
}

impl Handler for TrainHandler {
    type Job = TrainGplvm;

    async fn run(&self, context: JobContext, request: TrainGplvm) -> Result<Outcome, JobError> {
        let Resources { store, memory, .. } = &self.resources;
        let file = &request.motion_database;
        context.progress(0.0, "reading the motion database");
        let most = memory.cache_bytes;
        let opened = motion_database::open(store, &file.store_key, &file.blake3, most).await;
        let database = opened.map_err(|error| error.into_job_error(&full_name(file)))?.database;
        let (watched, options) = (context.clone(), request.parameters);
        let model = compute::run(move || {
            let mut progress = |done: usize, planned: usize| {
                watched.progress(0.95 * done as f64 / planned.max(1) as f64, "training");
                if watched.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let model = sparse::train_gplvm(&database, &options, &|_| false, &mut progress);
            model.map(|model| model.to_bytes())
        });
        let model = model.await;
        context.check()?;
        let model =
            model.map_err(|e| JobError::give_up(format!("training failed: {e}"), format!("{e:?}")))?;
        context.progress(0.95, "storing the model");
        let key = key::motion_database(file.id, context.id().0, context.lease_number().0, MODEL)
            .map_err(JobError::retry)?;
        let stored = store.put(&key, model.into()).await.map_err(JobError::retry)?;
        let run = context.run_id().0;
        let report = self.resources.job_report(&context, 0);
        let timings = Timings::default().one("train", &report);
        let origin = self.resources.origin(&context);
        let report = RunReport { origin, warnings: &[], timings, frames: None, points: None };
        let built = json!({ "bytes": stored.bytes, "blake3": stored.blake3 });
        let report = results::run_json(&report, &request, json!({ "built": built }))?;
        let report = results::write_one(store, &context, report).await?;
        Ok(Outcome::default().artefact(report).on_complete(move |connection| {
            let (request, stored) = (request.clone(), stored.clone());
            Box::pin(async move { motion_databases::set_gplvm(connection, run, &request, &stored).await })
        }))
    }
}
