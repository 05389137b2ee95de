//! The job that reads a session's files and plans the rest of the run.

use crate::{
    Shared,
    control::Markers,
    error::InputError,
    inputs::{self, Evidence, NamedBytes},
    performer,
};
use formats::media_type::BINARY;
use jobs::{
    InputFile, JobReport, Object,
    sparse::{FittedReport, MergeChunks, PlanSparse, ReconstructChunk},
};
use model::Skeleton;
use motion_db::MotionDatabase;
use queue::{ChildJob, Handler, JobContext, JobError, Outcome};
use service::{compute, objects};
use sparse::{Reconstructor, plan_chunks};
use std::sync::Arc;
use store::Store;

/// Weight of jobs in the run's progress: frames for a weight of 1.
const FRAMES_PER_WEIGHT: f64 = 60.0;
/// Frames that the merge gets through in the time of one reconstructed frame.
const MERGE_SPEED: f64 = 20.0;

pub(crate) struct PlanHandler {
    pub shared: Arc<Shared>,
}

impl Handler for PlanHandler {
    type Job = PlanSparse;

    async fn run(&self, context: JobContext, request: PlanSparse) -> Result<Outcome, JobError> {
        let Shared { resources, priors, .. } = &*self.shared;
        let (store, memory) = (&resources.store, &resources.memory);
        request.parameters.check().map_err(InputError::from)?;
        context.progress(0.1, "reading the session's files");
        let files = fetch(store, &request.inputs.files, memory.max_object_bytes).await?;
        let prior = priors.get(&request.motion_database, request.parameters.window).await?;
        context.check()?;

        let (limit, asked) = (memory.max_session_frames, request.clone());
        let (evidence, fitted, bytes) = compute::run(move || -> Result<_, InputError> {
            let markers = Markers::new(&asked.choice)?;
            let selection = inputs::Selection {
                points: &asked.choice.points,
                markers: &markers,
                reading: asked.reading_options(),
            };
            let mut evidence = inputs::read(&files, &selection, prior.database.skeleton())?;
            if is_synthetic(prior.database.skeleton()) {
                evidence.warnings.push("the motion database is synthetic, not recorded".to_owned());
            }
            let frames = evidence.session.num_frames();
            if frames > limit {
                return Err(InputError::TooLong { frames, limit });
            }
            let fitted = give_skeleton(&prior.database, &mut evidence, asked.parameters.fit_skeleton)?;
            // What does not fit the database is said now, not by every chunk.
            Reconstructor::new(&prior.database, &prior.index, &evidence.session, &asked.parameters)?;
            let bytes = evidence.session.to_bytes();
            Ok((evidence, fitted, bytes))
        })
        .await?;
        context.check()?;
        // Its chunks, which are nearly all of the work, are not counted before it is done.
        context.progress(0.02, "planning");
        let artefact = objects::write(store, &context, "session.bin", BINARY, bytes).await?;
        let session = Object::from(&artefact);
        let report = resources.job_report(&context, evidence.session.num_frames());
        Ok(Outcome::default()
            .artefact(artefact)
            .children(children(request, session, evidence, fitted, report)?))
    }
}

/// Sees to a session that came without a skeleton: it is given one that fits, or keeps the database's.
fn give_skeleton(
    database: &MotionDatabase,
    evidence: &mut Evidence,
    is_fitted: bool,
) -> Result<Option<FittedReport>, InputError> {
    if evidence.has_skeleton {
        return Ok(None);
    }
    if !is_fitted {
        evidence.warnings.push("no skeleton file: the motion database's own skeleton is used".to_owned());
        return Ok(None);
    }
    let (session, fitted) = performer::fit(database, evidence.session.clone(), &mut evidence.warnings)?;
    evidence.session = session;
    Ok(fitted)
}

/// Whether a skeleton comes from the sample motion, which names its skeletons so.
fn is_synthetic(skeleton: &Skeleton) -> bool {
    skeleton.name().to_ascii_lowercase().starts_with("synthetic")
}

/// Reads files, unpacked where they are compressed.
pub(crate) async fn fetch(
    store: &Store,
    files: &[InputFile],
    max_bytes: u64,
) -> Result<Vec<NamedBytes>, JobError> {
    let mut found = Vec::new();
    for file in files {
        let input = objects::Input { name: &file.name, store_key: &file.store_key, blake3: &file.blake3 };
        let bytes = objects::read(store, input, max_bytes).await?;
        let file = NamedBytes { name: file.name.clone(), role: file.role, bytes };
        found.push(compute::run(move || file.unpacked(max_bytes)).await?);
    }
    Ok(found)
}

/// The chunk jobs, and the merge that waits for all of them.
fn children(
    request: PlanSparse,
    session: Object,
    evidence: Evidence,
    fitted: Option<FittedReport>,
    plan: JobReport,
) -> Result<Vec<ChildJob>, JobError> {
    let num_frames = evidence.session.num_frames();
    let chunks = plan_chunks(num_frames, &request.parameters);
    let num_chunks = chunks.len();
    let mut jobs = Vec::with_capacity(num_chunks + 1);
    for chunk in chunks {
        let job = ReconstructChunk {
            session: session.clone(),
            motion_database: request.motion_database.clone(),
            parameters: request.parameters.clone(),
            chunk: chunk.index,
            num_chunks,
            start: chunk.frames.start,
            end: chunk.frames.end,
        };
        jobs.push(ChildJob::new(&job)?.weight(chunk.frames.len() as f64 / FRAMES_PER_WEIGHT));
    }
    let points = evidence.session.points.iter().map(|p| p.name.clone()).collect();
    let merge = MergeChunks { request, session, points, warnings: evidence.warnings, fitted, plan };
    let weight = num_frames as f64 / FRAMES_PER_WEIGHT / MERGE_SPEED;
    jobs.push(ChildJob::new(&merge)?.weight(weight).depends_on(0..num_chunks));
    Ok(jobs)
}
