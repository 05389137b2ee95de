//! The job that divides the files of a motion database into parts, and decides the coordinates that all parts have.

use crate::{
    BUILD_MOTION_DATABASE, IMPORT_MOTION,
    inputs::{self, Reader, Use},
    payload::{BuildMotionDatabase, ImportMotion},
};
use formats::archive::Entry;
use jobs::{MotionDatabaseFile, Object, PLAN_MOTION_DATABASE, PlanMotionDatabase};
use library::{motion_database, motion_database::Index};
use motion_db::MotionDatabase;
use queue::{Artefact, ChildJob, Handler, JobContext, JobError, Outcome};
use service::{compute, config::MemoryConfig, objects};
use std::sync::Arc;
use store::Store;

/// Progress when all files were looked into: imports and build, most of the work, are not counted before that.
const PLANNED: f64 = 0.1;

/// Most motion files of a part.
const PART_FILES: usize = 32;
/// A part that has so many bytes gets no further file.
const PART_BYTES: usize = 32 << 20;
/// Skeletons and indices together, bytes: every import job reads them.
const MAX_SUPPORT_BYTES: usize = 64 << 20;
/// Clips that the coordinates are taken from, at most.
const SAMPLE_CLIPS: usize = 24;
/// Attempts of an import: more than usual, as one may be lost with each worker that is taken away.
const IMPORT_ATTEMPTS: i32 = 5;
const TAR: &str = "application/x-tar";

pub(crate) struct PlanHandler {
    store: Store,
    memory: MemoryConfig,
}

impl PlanHandler {
    pub fn new(store: Store, memory: MemoryConfig) -> Self {
        Self { store, memory }
    }
}

impl Handler for PlanHandler {
    fn kind(&self) -> &'static str {
        PLAN_MOTION_DATABASE
    }

    async fn run(&self, job: JobContext) -> Result<Outcome, JobError> {
        objects::clean_up_earlier_attempts(&self.store, &job).await;
        let request: PlanMotionDatabase = job.payload()?;
        let divided = self.divide(&job, &request).await?;
        let mut outcome = Outcome::default();
        let mut imports = Vec::new();
        if !divided.parts.is_empty() {
            job.progress(PLANNED, "choosing coordinates");
            let basis = match &request.base {
                Some(base) => self.base(base).await?,
                None => self.sampled(&job, &divided, request.bvh_metres_per_unit).await?,
            };
            let basis = compute::run(move || one_clip(&basis)).await?;
            let skeletons = divided.skeletons.clone();
            let skeletons = compute::run(move || inputs::pack(&skeletons)).await?;
            let basis =
                objects::write(&self.store, &job, "basis.mdb", "application/octet-stream", basis).await?;
            let skeletons = objects::write(&self.store, &job, "skeletons.tar", TAR, skeletons).await?;
            for part in &divided.parts {
                let payload = ImportMotion {
                    basis: object(&basis),
                    skeletons: object(&skeletons),
                    motions: object(part),
                    augment: request.augment.clone(),
                    bvh_metres_per_unit: request.bvh_metres_per_unit,
                };
                let payload = serde_json::to_value(payload).map_err(JobError::retry)?;
                imports.push(ChildJob::new(IMPORT_MOTION, payload).max_attempts(IMPORT_ATTEMPTS));
            }
            outcome = outcome.artefact(basis).artefact(skeletons);
        }
        let build = BuildMotionDatabase {
            motion_database: request.motion_database,
            base: request.base,
            without: request.without,
            augment: request.augment,
            shards: request.shards,
        };
        let build = serde_json::to_value(build).map_err(JobError::retry)?;
        let num_imports = imports.len();
        imports.push(ChildJob::new(BUILD_MOTION_DATABASE, build).depends_on(0..num_imports));
        Ok(divided.parts.into_iter().fold(outcome, Outcome::artefact).children(imports))
    }
}

/// The files of a database, sorted and divided.
#[derive(Default)]
struct Divided {
    skeletons: Vec<Entry>,
    support_bytes: usize,
    /// in order, each with its part, its place in that, and its size
    motions: Vec<Place>,
    parts: Vec<Artefact>,
    /// the part that is filled
    open: Vec<Entry>,
    open_bytes: usize,
}

struct Place {
    part: usize,
    index: usize,
    bytes: usize,
}

impl PlanHandler {
    /// Unpacks one file after the other; what is held at a time is one of them and a part.
    async fn divide(&self, job: &JobContext, request: &PlanMotionDatabase) -> Result<Divided, JobError> {
        let mut left = self.memory.max_input_bytes;
        let mut divided = Divided::default();
        let mut num_entries = 0;
        for (done, file) in request.files.iter().enumerate() {
            job.check()?;
            job.progress(
                PLANNED * done as f64 / request.files.len() as f64,
                format!("reading {}", file.name),
            );
            let input = objects::Input { name: &file.name, store_key: &file.store_key, blake3: &file.blake3 };
            let bytes = objects::read(&self.store, input, self.memory.max_object_bytes).await?;
            let (name, most) = (file.name.clone(), left.min(self.memory.max_build_bytes));
            let mut entries = compute::run(move || inputs::unpack(&name, &bytes, most)).await?;
            left = left.saturating_sub(entries.iter().map(|e| e.bytes.len() as u64).sum());
            num_entries += entries.len();
            entries.sort_by(|a, b| a.name.cmp(&b.name));
            for entry in entries {
                self.place(job, &mut divided, entry).await?;
            }
        }
        self.close_part(job, &mut divided).await?;
        if divided.motions.is_empty() && request.base.is_none() {
            let message = format!(
                "found {num_entries} files, no motion among them; expected at least one AMC file with its ASF file, or a \
                 BVH file"
            );
            return Err(JobError::give_up(message, ""));
        }
        Ok(divided)
    }

    async fn place(&self, job: &JobContext, divided: &mut Divided, entry: Entry) -> Result<(), JobError> {
        match Use::of(&entry.name) {
            Use::None => {}
            Use::Support => {
                divided.support_bytes += entry.bytes.len();
                if divided.support_bytes > MAX_SUPPORT_BYTES {
                    let message = format!(
                        "{}: skeletons and indices have more than {MAX_SUPPORT_BYTES} bytes together; \
                         build several databases",
                        entry.name
                    );
                    return Err(JobError::give_up(message, ""));
                }
                divided.skeletons.push(entry);
            }
            Use::Motion => {
                let bytes = entry.bytes.len();
                let (part, index) = (divided.parts.len(), divided.open.len());
                divided.motions.push(Place { part, index, bytes });
                divided.open.push(entry);
                divided.open_bytes += bytes;
                if divided.open.len() == PART_FILES || divided.open_bytes >= PART_BYTES {
                    self.close_part(job, divided).await?;
                }
            }
        }
        Ok(())
    }

    async fn close_part(&self, job: &JobContext, divided: &mut Divided) -> Result<(), JobError> {
        let entries = std::mem::take(&mut divided.open);
        divided.open_bytes = 0;
        if entries.is_empty() {
            return Ok(());
        }
        let bytes = compute::run(move || inputs::pack(&entries)).await?;
        let name = format!("motions-{:05}.tar", divided.parts.len());
        divided.parts.push(objects::write(&self.store, job, &name, TAR, bytes).await?);
        Ok(())
    }

    /// A database of clips from all over the files, for its coordinates.
    async fn sampled(
        &self,
        job: &JobContext,
        divided: &Divided,
        bvh_metres_per_unit: f64,
    ) -> Result<Arc<MotionDatabase>, JobError> {
        // Of every stretch of files the largest: it surely is long enough.
        let stretch = divided.motions.len().div_ceil(SAMPLE_CLIPS).max(1);
        let chosen: Vec<&Place> = divided
            .motions
            .chunks(stretch)
            .filter_map(|places| places.iter().rev().max_by_key(|place| place.bytes))
            .collect();
        let mut reader = Reader::new(divided.skeletons.clone(), bvh_metres_per_unit);
        let mut clips = Vec::new();
        for of_part in chosen.chunk_by(|a, b| a.part == b.part) {
            job.check()?;
            let part = &divided.parts[of_part[0].part];
            let bytes = read_artefact(&self.store, part).await?;
            let indices: Vec<usize> = of_part.iter().map(|place| place.index).collect();
            (reader, clips) = compute::run(move || {
                let mut entries = inputs::unpack_packed(&bytes)?;
                for index in indices {
                    let entry = &mut entries[index];
                    let entry = Entry { name: entry.name.clone(), bytes: std::mem::take(&mut entry.bytes) };
                    clips.extend(reader.clip(entry)?.0);
                }
                Ok::<_, JobError>((reader, clips))
            })
            .await?;
        }
        let built = compute::run(move || MotionDatabase::build(&clips)).await;
        Ok(built.map_err(|e| no_database(&e))?.into())
    }

    async fn base(&self, base: &MotionDatabaseFile) -> Result<Arc<MotionDatabase>, JobError> {
        let most = self.memory.max_build_bytes;
        let read = async {
            // All shards have the same coordinates.
            let shard = match motion_database::read(&self.store, &base.store_key, &base.blake3, most).await? {
                Index::Whole(file) => Some(file),
                Index::Sharded(list) => list.shards.into_iter().next(),
            };
            let shard = shard.ok_or_else(|| motion_database::Error::List("is empty".to_owned()))?;
            shard.open(&self.store, most).await
        };
        Ok(read.await.map_err(|error| error.into_job_error(&full_name(base)))?.database)
    }
}

/// What is needed to have the same coordinates: the database with one clip.
fn one_clip(database: &MotionDatabase) -> Result<Vec<u8>, JobError> {
    let mut basis = database.emptied();
    let name = database.clips().first().map(|clip| clip.name.clone()).unwrap_or_default();
    basis.append_from(database, 0, &name).map_err(|e| no_database(&e))?;
    Ok(basis.to_bytes())
}

/// Bad input, as far as the database is concerned.
pub(crate) fn no_database(error: &motion_db::Error) -> JobError {
    JobError::give_up(format!("no motion database can be built: {error}"), format!("{error:?}"))
}

/// A motion database as people name it.
pub(crate) fn full_name(database: &MotionDatabaseFile) -> String {
    format!("{}@{}", database.name, database.version)
}

/// What an earlier job, or this one, wrote.
pub(crate) async fn read_artefact(store: &Store, artefact: &Artefact) -> Result<bytes::Bytes, JobError> {
    let input =
        objects::Input { name: &artefact.name, store_key: &artefact.store_key, blake3: &artefact.blake3 };
    objects::read(store, input, u64::MAX).await
}

fn object(artefact: &Artefact) -> Object {
    Object { store_key: artefact.store_key.clone(), blake3: artefact.blake3.clone() }
}
