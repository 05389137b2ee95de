//! The job that builds a motion database.

use crate::{
    BUILD_MOTION_DATABASE, inputs,
    payload::{BuildMotionDatabase, InputFile},
};
use bytes::Bytes;
use motion_db::MotionDatabase;
use queue::{Handler, JobContext, JobError, Outcome};
use serde::Serialize;
use service::{compute, config::MemoryConfig, objects};
use sqlx::PgConnection;
use store::{Store, Stored, key};
use uuid::Uuid;

/// Result that says what went into the database.
const SUMMARY: &str = "summary.json";

pub(crate) struct BuildHandler {
    store: Store,
    memory: MemoryConfig,
}

impl BuildHandler {
    pub fn new(store: Store, memory: MemoryConfig) -> Self {
        Self { store, memory }
    }
}

impl Handler for BuildHandler {
    fn kind(&self) -> &'static str {
        BUILD_MOTION_DATABASE
    }

    async fn run(&self, job: JobContext) -> Result<Outcome, JobError> {
        objects::clean_up_earlier_attempts(&self.store, &job).await;
        let payload: BuildMotionDatabase = job.payload()?;
        let id = payload.motion_database.id;
        let files = self.fetch(&job, &payload.files).await?;
        job.progress(0.2, "reading motion files");
        let (limits, of) = (inputs::Limits { unpacked_bytes: self.memory.max_input_bytes }, job.clone());
        let built = compute::run(move || build(files, limits, &of)).await?;
        job.check()?;
        job.progress(0.9, "storing the index");
        let key = key::motion_database(id, job.lease_number().0);
        let stored = self.store.put(&key, built.bytes).await.map_err(JobError::retry)?;
        let summary = serde_json::to_vec_pretty(&built.summary).map_err(JobError::retry)?;
        let summary = objects::write_result(&self.store, &job, SUMMARY, "application/json", summary).await?;
        let Summary { num_poses, skeleton, clips, .. } = built.summary;
        let ready = Ready { id, stored, num_poses, num_clips: clips.len(), skeleton };
        Ok(Outcome::default().artefact(summary).on_complete(move |connection| {
            let ready = ready.clone();
            Box::pin(async move { set_ready(connection, &ready).await })
        }))
    }
}

impl BuildHandler {
    async fn fetch(&self, job: &JobContext, files: &[InputFile]) -> Result<Vec<(String, Bytes)>, JobError> {
        let total: u64 = files.iter().map(|f| f.bytes).sum();
        let limit = self.memory.max_input_bytes;
        if total > limit {
            let message = format!("files have {total} bytes together, expected at most {limit}");
            return Err(JobError::give_up(message, "raise MAREY_MAX_INPUT_BYTES"));
        }
        let mut found = Vec::with_capacity(files.len());
        for (done, file) in files.iter().enumerate() {
            job.check()?;
            job.progress(0.2 * done as f64 / files.len() as f64, format!("fetching {}", file.name));
            let input = objects::Input { name: &file.name, store_key: &file.store_key, blake3: &file.blake3 };
            found.push((
                file.name.clone(),
                objects::read(&self.store, input, self.memory.max_object_bytes).await?,
            ));
        }
        Ok(found)
    }
}

/// An index and what there is to say about it.
struct Built {
    bytes: Bytes,
    summary: Summary,
}

/// `summary.json`.
#[derive(Debug, Serialize)]
struct Summary {
    num_poses: usize,
    frame_rate_hz: f64,
    skeleton: String,
    num_joints: usize,
    num_dofs: usize,
    clips: Vec<ClipSummary>,
    warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
struct ClipSummary {
    name: String,
    subject: String,
    action: String,
    num_poses: usize,
}

fn build(files: Vec<(String, Bytes)>, limits: inputs::Limits, job: &JobContext) -> Result<Built, JobError> {
    let read = inputs::clips(files, limits, &|| job.is_cancelled())?;
    job.check()?;
    job.progress(0.6, format!("indexing {} clips", read.clips.len()));
    let database = MotionDatabase::build(&read.clips)
        .map_err(|e| JobError::give_up(format!("no motion database can be built: {e}"), format!("{e:?}")))?;
    job.check()?;
    let clip = |c: &motion_db::ClipInfo| ClipSummary {
        name: c.name.clone(),
        subject: c.subject.clone(),
        action: c.action.clone(),
        num_poses: c.num_poses,
    };
    let summary = Summary {
        num_poses: database.num_poses(),
        frame_rate_hz: motion_db::FRAME_RATE,
        skeleton: database.skeleton().name().to_owned(),
        num_joints: database.skeleton().num_joints(),
        num_dofs: database.num_dofs(),
        clips: database.clips().iter().map(clip).collect(),
        warnings: read.warnings,
    };
    Ok(Built { bytes: database.to_bytes().into(), summary })
}

/// What makes a row of `motion_databases` ready.
#[derive(Debug, Clone)]
struct Ready {
    id: Uuid,
    stored: Stored,
    num_poses: usize,
    num_clips: usize,
    skeleton: String,
}

async fn set_ready(connection: &mut PgConnection, ready: &Ready) -> Result<(), JobError> {
    let number = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
    let sql = "UPDATE motion_databases
               SET store_key = $2, bytes = $3, blake3 = $4, num_poses = $5, num_clips = $6, skeleton = $7,
                   ready_at = clock_timestamp()
               WHERE id = $1 AND store_key IS NULL";
    let updated = sqlx::query(sql)
        .bind(ready.id)
        .bind(ready.stored.key.as_str())
        .bind(i64::try_from(ready.stored.bytes).unwrap_or(i64::MAX))
        .bind(&ready.stored.blake3)
        .bind(number(ready.num_poses))
        .bind(number(ready.num_clips))
        .bind(&ready.skeleton)
        .execute(connection)
        .await?
        .rows_affected();
    if updated == 1 {
        return Ok(());
    }
    let detail = format!("no row of motion_databases with id {} waits for an index", ready.id);
    Err(JobError::give_up("the motion database was deleted or built by another run meanwhile", detail))
}
