//! The job that divides the files of a motion database into parts, and decides the coordinates that all parts have.

use crate::inputs::{self, Reader};
use formats::{
    archive::Entry,
    media_type::{BINARY, TAR},
    motion_files::FileUse,
};
use jobs::{
    Object,
    motion_database::{BuildMotionDatabase, ImportMotion, MotionDatabaseFile, PlanMotionDatabase},
};
use library::{motion_database, motion_database::Index};
use motion_db::MotionDatabase;
use queue::{Artefact, ChildJob, Handler, JobContext, JobError, Outcome};
use service::{Resources, compute, objects};
use std::sync::Arc;

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

pub(crate) struct PlanHandler {
    pub resources: Resources,
}

impl Handler for PlanHandler {
    type Job = PlanMotionDatabase;

    async fn run(&self, context: JobContext, request: PlanMotionDatabase) -> Result<Outcome, JobError> {
        let store = &self.resources.store;
        let divided = self.divide(&context, &request).await?;
        let mut outcome = Outcome::default();
        let mut imports = Vec::new();
        if !divided.parts.is_empty() {
            context.progress(PLANNED, "choosing coordinates");
            let basis = match &request.base {
                Some(base) => self.base(base).await?,
                None => self.sampled(&context, &divided, request.bvh_metres_per_unit).await?,
            };
            let basis = compute::run(move || one_clip(&basis)).await?;
            let skeletons = divided.skeletons.clone();
            let skeletons = compute::run(move || inputs::pack(&skeletons)).await?;
            let basis = objects::write(store, &context, "basis.mdb", BINARY, basis).await?;
            let skeletons = objects::write(store, &context, "skeletons.tar", TAR, skeletons).await?;
            for part in &divided.parts {
                imports.push(ChildJob::new(&ImportMotion {
                    basis: Object::from(&basis),
                    skeletons: Object::from(&skeletons),
                    motions: Object::from(part),
                    augment: request.augment.clone(),
                    bvh_metres_per_unit: request.bvh_metres_per_unit,
                })?);
            }
            outcome = outcome.artefact(basis).artefact(skeletons);
        }
        let plan = self.resources.job_report(&context, 0);
        let build = BuildMotionDatabase { request, plan };
        let num_imports = imports.len();
        imports.push(ChildJob::new(&build)?.depends_on(0..num_imports));
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
    async fn divide(&self, context: &JobContext, request: &PlanMotionDatabase) -> Result<Divided, JobError> {
        let memory = &self.resources.memory;
        let mut left = memory.max_input_bytes;
        let mut divided = Divided::default();
        let mut num_entries = 0;
        for (done, file) in request.files.iter().enumerate() {
            context.check()?;
            context.progress(
                PLANNED * done as f64 / request.files.len() as f64,
                format!("reading {}", file.name),
            );
            let bytes = self.resources.read_file(file, memory.max_object_bytes).await?;
            let (name, most) = (file.name.clone(), left.min(memory.max_build_bytes));
            let mut entries = compute::run(move || inputs::unpack(&name, &bytes, most)).await?;
            left = left.saturating_sub(entries.iter().map(|e| e.bytes.len() as u64).sum());
            num_entries += entries.len();
            entries.sort_by(|a, b| a.name.cmp(&b.name));
            for entry in entries {
                self.place(context, &mut divided, entry).await?;
            }
        }
        self.close_part(context, &mut divided).await?;
        if divided.motions.is_empty() && request.base.is_none() {
            let found = match num_entries {
                0 => "there is no file in what was uploaded".to_owned(),
                1 => "found one file, which is no motion".to_owned(),
                several => format!("found {several} files, no motion among them"),
            };
            let message = format!("{found}; expected at least one AMC file with its ASF file, or a BVH file");
            return Err(JobError::give_up(message, ""));
        }
        Ok(divided)
    }

    async fn place(&self, context: &JobContext, divided: &mut Divided, entry: Entry) -> Result<(), JobError> {
        match FileUse::from_name(&entry.name) {
            FileUse::None => {}
            FileUse::Skeleton(_) | FileUse::Index => {
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
            FileUse::Motion(_) => {
                let bytes = entry.bytes.len();
                let (part, index) = (divided.parts.len(), divided.open.len());
                divided.motions.push(Place { part, index, bytes });
                divided.open.push(entry);
                divided.open_bytes += bytes;
                if divided.open.len() == PART_FILES || divided.open_bytes >= PART_BYTES {
                    self.close_part(context, divided).await?;
                }
            }
        }
        Ok(())
    }

    async fn close_part(&self, context: &JobContext, divided: &mut Divided) -> Result<(), JobError> {
        let entries = std::mem::take(&mut divided.open);
        divided.open_bytes = 0;
        if entries.is_empty() {
            return Ok(());
        }
        let bytes = compute::run(move || inputs::pack(&entries)).await?;
        let name = format!("motions-{:05}.tar", divided.parts.len());
        divided.parts.push(objects::write(&self.resources.store, context, &name, TAR, bytes).await?);
        Ok(())
    }

    /// A database of clips from all over the files, for its coordinates.
    async fn sampled(
        &self,
        context: &JobContext,
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
        for places in chosen.chunk_by(|a, b| a.part == b.part) {
            context.check()?;
            let part = &divided.parts[places[0].part];
            let bytes = self.resources.read_artefact(part, u64::MAX).await?;
            let indices: Vec<usize> = places.iter().map(|place| place.index).collect();
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
        let (store, most) = (&self.resources.store, self.resources.memory.max_build_bytes);
        let read = async {
            // All shards have the same coordinates.
            let shard = match motion_database::read(store, &base.store_key, &base.blake3, most).await? {
                Index::Whole(file) => Some(file),
                Index::Sharded(list) => list.shards.into_iter().next(),
            };
            let shard = shard.ok_or_else(|| motion_database::Error::List("is empty".to_owned()))?;
            shard.open(store, most).await
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
