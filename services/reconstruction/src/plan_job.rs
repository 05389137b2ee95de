//! The job that reads a session's files and plans the rest of the run.

use crate::{
    MERGE_CHUNKS, PLAN_SPARSE, RECONSTRUCT_CHUNK, Shared,
    error::InputError,
    inputs::{self, Evidence, NamedBytes},
    payload::{InputFile, JobReport, MergeChunks, Object, PlanSparse, ReconstructChunk},
    performer::{self, FittedReport},
};
use model::Skeleton;
use motion_db::MotionDatabase;
use queue::{ChildJob, Handler, JobContext, JobError, Outcome};
use service::{compute, objects};
use sparse::{Reconstructor, plan_chunks};
use std::{sync::Arc, time::Instant};
use store::Store;

/// Attempts of a chunk: more than usual, as one may be lost with each worker that is taken away.
const CHUNK_ATTEMPTS: i32 = 5;
/// Weight of jobs in the run's progress: frames for a weight of 1.
const FRAMES_PER_WEIGHT: f64 = 60.0;
/// Frames that the merge gets through in the time of one reconstructed frame.
const MERGE_SPEED: f64 = 20.0;

pub(crate) struct PlanHandler {
    shared: Arc<Shared>,
}

impl PlanHandler {
    pub fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }
}

impl Handler for PlanHandler {
    fn kind(&self) -> &'static str {
        PLAN_SPARSE
    }

    async fn run(&self, job: JobContext) -> Result<Outcome, JobError> {
        let started = Instant::now();
        let Shared { resources, priors, .. } = &*self.shared;
        let (store, memory) = (&resources.store, &resources.memory);
        objects::clean_up_earlier_attempts(store, &job).await;
        let request: PlanSparse = job.payload()?;
        request.parameters.check().map_err(InputError::from)?;
        job.progress(0.1, "reading the session's files");
        let files = fetch(store, &request.files, memory.max_object_bytes).await?;
        let prior = priors.get(&request.motion_database, request.parameters.window).await?;
        job.check()?;

        let (limit, asked) = (memory.max_session_frames, request.clone());
        let (evidence, fitted, bytes) = compute::run(move || -> Result<_, InputError> {
            let markers = asked.markers()?;
            let selection =
                inputs::Selection { points: &asked.points, markers: &markers, reading: asked.reading() };
            let mut evidence = inputs::read(&files, &selection, prior.database.skeleton())?;
            if is_synthetic(prior.database.skeleton()) {
                evidence.warnings.push("the motion database is synthetic: drawn, not recorded".to_owned());
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
        job.check()?;
        // Its chunks, which are nearly all of the work, are not counted before it is done.
        job.progress(0.02, "planning");
        let artefact = objects::write(store, &job, "session.bin", "application/octet-stream", bytes).await?;
        let session = Object { store_key: artefact.store_key.clone(), blake3: artefact.blake3.clone() };
        let report = resources.job_report(&job, started, evidence.session.num_frames());
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
        let file = NamedBytes { name: file.name.clone(), role: file.role.clone(), bytes };
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
        let payload = ReconstructChunk {
            session: session.clone(),
            motion_database: request.motion_database.clone(),
            parameters: request.parameters.clone(),
            chunk: chunk.index,
            num_chunks,
            start: chunk.frames.start,
            end: chunk.frames.end,
        };
        let payload = serde_json::to_value(payload).map_err(JobError::retry)?;
        let weight = chunk.frames.len() as f64 / FRAMES_PER_WEIGHT;
        jobs.push(ChildJob::new(RECONSTRUCT_CHUNK, payload).weight(weight).max_attempts(CHUNK_ATTEMPTS));
    }
    let points = evidence.session.points.iter().map(|p| p.name.clone()).collect();
    let merge = MergeChunks { request, session, points, warnings: evidence.warnings, fitted, plan };
    let merge = serde_json::to_value(merge).map_err(JobError::retry)?;
    let weight = num_frames as f64 / FRAMES_PER_WEIGHT / MERGE_SPEED;
    jobs.push(ChildJob::new(MERGE_CHUNKS, merge).weight(weight).depends_on(0..num_chunks));
    Ok(jobs)
}
