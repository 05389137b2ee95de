//! The job that puts the parts of a motion database together and writes its index files.

use crate::{
    contents::{shares, shortened},
    plan_job::no_database,
    shards,
    sources::Sources,
};
use jobs::{
    motion_database::{BuildMotionDatabase, Clip, Contents, PlanMotionDatabase},
    run_json::{Origin, RunReport, Timings},
};
use library::{
    AllCores,
    motion_database::{INDEX, SHARDS, Shard, ShardList, ShardedClip},
    versions::{Built, motion_databases::BuiltDatabase},
};
use model::counted;
use motion_db::MotionDatabase;
use queue::{Handler, JobContext, JobError, JobId, Outcome};
use results::ResultFile;
use serde::Serialize;
use serde_json::json;
use service::{MakesVersion, Resources, compute};
use std::io::{BufWriter, Seek};
use store::{Key, Stored, UploadLimits, key};
use tokio_util::io::ReaderStream;

/// What writing the windows of a pose takes beside the pose, bytes.
const WRITING_BYTES: usize = 500;
/// How much of an index file is in memory on its way to the store, bytes.
const READ_BYTES: usize = 1 << 20;
/// Result that says what went into the database.
const SUMMARY: &str = "summary.json";

pub(crate) struct BuildHandler {
    pub resources: Resources,
}

impl MakesVersion for BuildHandler {
    fn version_prefix(job: &BuildMotionDatabase, id: JobId) -> Key {
        key::motion_database_job_prefix(job.request.motion_database.id, id.0)
    }
}

impl Handler for BuildHandler {
    type Job = BuildMotionDatabase;

    async fn run(&self, context: JobContext, job: BuildMotionDatabase) -> Result<Outcome, JobError> {
        let BuildMotionDatabase { request, plan } = job;
        let (store, id) = (&self.resources.store, request.motion_database.id);
        context.progress(0.0, "listing clips");
        let sources = Sources::find(&context, &self.resources, &request).await?;
        let written = self.write(&context, &request, &sources).await?;
        context.check()?;
        let Sources { clips, warnings, imports, .. } = sources;
        let clips: Vec<Clip> = clips.into_iter().map(|listed| listed.clip).collect();
        let contents = Contents {
            frame_rate_hz: motion_db::FRAME_RATE,
            num_joints: written.num_joints,
            num_dofs: written.num_dofs,
            actions: shares(&clips, |clip| &clip.action),
            subjects: shares(&clips, |clip| &clip.subject),
            augment: request.augment.clone(),
            warnings: shortened(warnings),
        };
        let num_poses = clips.iter().map(|clip| clip.num_poses).sum();
        let Written { stored, bytes, num_shards, skeleton, .. } = written;
        let built = Built { id, stored, bytes, contents };
        let database = BuiltDatabase { built, num_poses, num_shards, skeleton, clips };
        let build = self.resources.job_report(&context, num_poses);
        let timings = Timings::default().one("plan", &plan).all("imports", &imports).one("build", &build);
        let files = vec![
            ResultFile::json(SUMMARY, &Summary::from(&database))?,
            run_json(self.resources.origin(&context), &request, &database, timings)?,
        ];
        let files = results::write(store, &context, files, 0.98..1.0).await?;
        Ok(Outcome::default().artefacts(files).on_complete(move |connection| {
            let database = database.clone();
            Box::pin(async move { database.set_ready(connection).await })
        }))
    }
}

/// `run.json`.
fn run_json(
    origin: Origin,
    request: &PlanMotionDatabase,
    database: &BuiltDatabase,
    timings: Timings<'_>,
) -> Result<ResultFile, JobError> {
    let BuiltDatabase { built, num_poses, num_shards, clips, .. } = database;
    let warnings = &built.contents.warnings;
    let report = RunReport { origin, warnings, timings, frames: None, points: None };
    let built = json!({
        "num_poses": num_poses,
        "num_clips": clips.len(),
        "num_shards": num_shards,
        "bytes": built.bytes,
        "blake3": built.stored.blake3,
    });
    results::run_json(&report, request, json!({ "built": built }))
}

/// The index files of a database, or the one.
#[derive(Debug, Clone)]
struct Written {
    /// the index file, or the list of them
    stored: Stored,
    /// of all index files, bytes
    bytes: u64,
    num_shards: usize,
    skeleton: String,
    num_joints: usize,
    num_dofs: usize,
}

impl BuildHandler {
    /// Writes one shard after the other; what is held at a time is one of them and a source.
    async fn write(
        &self,
        context: &JobContext,
        request: &PlanMotionDatabase,
        sources: &Sources,
    ) -> Result<Written, JobError> {
        if sources.clips.is_empty() {
            let message =
                "no motion database can be built: no clip of at least 8 frames at 60 frames a second is left";
            return Err(JobError::give_up(message, ""));
        }
        let sizes: Vec<usize> = sources.clips.iter().map(|listed| listed.clip.num_poses).collect();
        let shard_of = shards::assign(&sizes, request.shards);
        let num_shards = shard_of.iter().max().map_or(1, |last| last + 1);
        let mut stored = Vec::with_capacity(num_shards);
        let mut last = None;
        for shard in 0..num_shards {
            let mut database = self.gather(context, request, sources, &shard_of, (shard, num_shards)).await?;
            if num_shards == 1 {
                // Shards keep what was recorded: zero poses are learned of all performers at once, when they are put together.
                database = compute::run(move || {
                    database.learn_zero_poses();
                    Ok::<_, JobError>(database)
                })
                .await?;
            }
            let (skeleton, num_dofs) = (database.skeleton().clone(), database.num_dofs());
            context.progress((shard as f64 + 0.9) / num_shards as f64, "writing the index");
            let name = if num_shards == 1 { INDEX.to_owned() } else { format!("{shard:03}.mdb") };
            stored.push(self.put_index(context, request, &name, database).await?);
            last = Some((skeleton, num_dofs));
        }
        let Some((skeleton, num_dofs)) = last else { return Err(JobError::retry("no shard was written")) };
        let bytes = stored.iter().map(|s| s.bytes).sum();
        let stored = match <[Stored; 1]>::try_from(stored) {
            Ok([only]) => only,
            Err(several) => {
                let list =
                    serde_json::to_vec(&list(sources, &shard_of, &several)).map_err(JobError::retry)?;
                self.put(context, request, SHARDS, list).await?
            }
        };
        let (skeleton, num_joints) = (skeleton.name().to_owned(), skeleton.num_joints());
        Ok(Written { stored, bytes, num_shards, skeleton, num_joints, num_dofs })
    }

    /// The clips of shard `shard` of so many, from all sources.
    async fn gather(
        &self,
        context: &JobContext,
        request: &PlanMotionDatabase,
        sources: &Sources,
        shard_of: &[usize],
        (shard, num_shards): (usize, usize),
    ) -> Result<MotionDatabase, JobError> {
        let wanted: Vec<_> =
            sources.clips.iter().zip(shard_of).filter(|(_, s)| **s == shard).map(|(c, _)| c).collect();
        let num_poses: usize = wanted.iter().map(|listed| listed.clip.num_poses).sum();
        let mut gathered: Option<MotionDatabase> = None;
        for listed in wanted.chunk_by(|a, b| a.source == b.source) {
            context.check()?;
            let source = listed[0].source;
            let done = (shard as f64 + 0.8 * source as f64 / sources.files.len() as f64) / num_shards as f64;
            context.progress(done, format!("putting {} together", counted(sources.clips.len(), "clip")));
            let part = sources.open(source, &self.resources, request).await?;
            let mut database = match gathered.take() {
                Some(database) => database,
                None => {
                    self.check_memory(num_poses, part.num_dofs(), request)?;
                    part.emptied()
                }
            };
            let clips: Vec<(usize, String)> =
                listed.iter().map(|listed| (listed.index, listed.clip.name.clone())).collect();
            let appended = compute::run(move || {
                for (index, name) in clips {
                    database.append_from(&part, index, &name)?;
                }
                Ok(database)
            });
            gathered = Some(appended.await.map_err(|e: motion_db::Error| no_database(&e))?);
        }
        gathered.ok_or_else(|| JobError::retry("a shard without clips"))
    }

    /// Poses, which may take twice their size while more are added, and what writing their windows takes.
    fn check_memory(
        &self,
        num_poses: usize,
        num_dofs: usize,
        request: &PlanMotionDatabase,
    ) -> Result<(), JobError> {
        let needed = (num_poses * (2 * num_dofs * size_of::<f32>() + WRITING_BYTES)) as u64;
        let limit = self.resources.memory.max_build_bytes;
        if needed <= limit {
            return Ok(());
        }
        let message = format!(
            "an index file of {num_poses} poses takes {needed} bytes of memory while it is built, expected at most \
             {limit}; build {} shards or more (now {})",
            request.shards as u64 * needed.div_ceil(limit.max(1)) + 1,
            request.shards
        );
        Err(JobError::give_up(message, "or raise MAREY_MAX_BUILD_BYTES"))
    }

    /// Writes an index file with its windows, by way of a file: it is several times as large as the database.
    async fn put_index(
        &self,
        context: &JobContext,
        request: &PlanMotionDatabase,
        name: &str,
        database: MotionDatabase,
    ) -> Result<Stored, JobError> {
        let file = compute::run(move || -> Result<std::fs::File, JobError> {
            let mut out = BufWriter::new(tempfile::tempfile().map_err(JobError::retry)?);
            let window = sparse::Parameters::default().window;
            motion_db::write_index(&database, Some(window), &AllCores, &mut out)
                .map_err(|e| no_database(&e))?;
            let mut file = out.into_inner().map_err(JobError::retry)?;
            file.rewind().map_err(JobError::retry)?;
            Ok(file)
        });
        let file = ReaderStream::with_capacity(tokio::fs::File::from_std(file.await?), READ_BYTES);
        let limits = UploadLimits { max_bytes: u64::MAX, expected_blake3: None };
        let key = self.key(context, request, name)?;
        self.resources.store.put_stream(&key, file, &limits).await.map_err(JobError::retry)
    }

    fn key(&self, context: &JobContext, request: &PlanMotionDatabase, name: &str) -> Result<Key, JobError> {
        let id = request.motion_database.id;
        key::motion_database(id, context.id().0, context.lease_number().0, name).map_err(JobError::retry)
    }

    async fn put(
        &self,
        context: &JobContext,
        request: &PlanMotionDatabase,
        name: &str,
        bytes: Vec<u8>,
    ) -> Result<Stored, JobError> {
        let key = self.key(context, request, name)?;
        self.resources.store.put(&key, bytes.into()).await.map_err(JobError::retry)
    }
}

fn list(sources: &Sources, shard_of: &[usize], stored: &[Stored]) -> ShardList {
    let clip = |(listed, shard): (&crate::sources::Listed, &usize)| {
        let Clip { name, subject, action, num_poses } = listed.clip.clone();
        ShardedClip { name, subject, action, num_poses, shard: *shard }
    };
    let shard = |s: &Stored| Shard { store_key: s.key.to_string(), bytes: s.bytes, blake3: s.blake3.clone() };
    ShardList {
        shards: stored.iter().map(shard).collect(),
        clips: sources.clips.iter().zip(shard_of).map(clip).collect(),
    }
}

/// `summary.json`.
#[derive(Serialize)]
struct Summary<'a> {
    num_poses: usize,
    skeleton: &'a str,
    num_shards: usize,
    #[serde(flatten)]
    contents: &'a Contents,
    clips: &'a [Clip],
}

impl<'a> From<&'a BuiltDatabase> for Summary<'a> {
    fn from(database: &'a BuiltDatabase) -> Self {
        Self {
            num_poses: database.num_poses,
            skeleton: &database.skeleton,
            num_shards: database.num_shards,
            contents: &database.built.contents,
            clips: &database.clips,
        }
    }
}
