//! Where the clips of a database come from: the index files of the version before, and the parts that were imported.

use crate::{
    contents::{Names, names},
    import_job::{PART, REPORT},
    plan_job::full_name,
};
use jobs::{
    JobReport,
    motion_database::{Clip, PartReport, PlanMotionDatabase},
};
use library::{motion_database, motion_database::Shard};
use motion_db::{MotionDatabase, trial_name};
use queue::{Artefact, JobContext, JobError};
use service::{Resources, compute};
use std::{collections::BTreeSet, sync::Arc};

/// A file that holds clips in the coordinates of the database.
pub(crate) enum Source {
    /// An index file of the version before.
    Base(Shard),
    /// What an import job left.
    Part(Artefact),
}

/// A clip, where it is, and what it is called in the database.
pub(crate) struct Listed {
    pub source: usize,
    /// its place there
    pub index: usize,
    pub clip: Clip,
}

/// All that goes into a database, in order.
#[derive(Default)]
pub(crate) struct Sources {
    pub files: Vec<Source>,
    pub clips: Vec<Listed>,
    pub warnings: Vec<String>,
    /// what the imports took
    pub imports: Vec<JobReport>,
    names: Names,
}

impl Sources {
    /// Finds and lists the clips of a build: those of its base that are kept, then those that its jobs imported.
    ///
    /// # Errors
    /// If the base can't be read; tries again where an artefact can't.
    pub async fn find(
        context: &JobContext,
        resources: &Resources,
        request: &PlanMotionDatabase,
    ) -> Result<Self, JobError> {
        let mut sources = Self::default();
        sources.add_base(resources, request).await?;
        let mut connection = resources.pool.acquire().await?;
        let artefacts = queue::dependency_artefacts(&mut connection, context.id()).await?;
        drop(connection);
        for left in artefacts.chunk_by(|a, b| a.job_id == b.job_id) {
            context.check()?;
            let named = |name: &str| left.iter().map(|a| &a.artefact).find(|a| a.name == name);
            let Some(report) = named(REPORT) else { continue };
            let report: PartReport = resources.read_json(report, u64::MAX).await?;
            sources.add_part(report, named(PART));
        }
        Ok(sources)
    }

    async fn add_base(
        &mut self,
        resources: &Resources,
        request: &PlanMotionDatabase,
    ) -> Result<(), JobError> {
        use motion_database::Index;
        let (store, max_bytes) = (&resources.store, resources.memory.max_build_bytes);
        let Some(base) = &request.base else { return Ok(()) };
        let failed = |error: motion_database::Error| error.into_job_error(&full_name(base));
        let shards = match motion_database::read(store, &base.store_key, &base.blake3, max_bytes).await {
            Err(error) => return Err(failed(error)),
            Ok(Index::Whole(file)) => vec![file],
            Ok(Index::Sharded(list)) => list.shards,
        };
        let without: BTreeSet<&str> = request.without.iter().map(String::as_str).collect();
        for shard in shards {
            let database = shard.open(store, max_bytes).await.map_err(failed)?.database;
            for (index, clip) in database.clips().iter().enumerate() {
                if without.contains(clip.name.as_str()) || without.contains(trial_name(&clip.name)) {
                    continue;
                }
                if trial_name(&clip.name) == clip.name {
                    self.names.unique(&clip.name);
                }
                let (name, subject, action) = (clip.name.clone(), clip.subject.clone(), clip.action.clone());
                let clip = Clip { name, subject, action, num_poses: clip.num_poses };
                self.clips.push(Listed { source: self.files.len(), index, clip });
            }
            self.files.push(Source::Base(shard));
        }
        Ok(())
    }

    fn add_part(&mut self, report: PartReport, part: Option<&Artefact>) {
        self.warnings.extend(report.warnings);
        self.imports.push(report.job);
        let Some(part) = part else { return };
        let names = names(&report.clips, &mut self.names);
        for (index, (clip, name)) in report.clips.into_iter().zip(names).enumerate() {
            if name != clip.name && trial_name(&clip.name) == clip.name {
                let own = &clip.name;
                self.warnings.push(format!("two motions are named {own}; the second was renamed {name}"));
            }
            let clip = Clip { name, subject: clip.subject, action: clip.action, num_poses: clip.num_poses };
            self.clips.push(Listed { source: self.files.len(), index, clip });
        }
        self.files.push(Source::Part(part.clone()));
    }

    /// Opens one of the files.
    ///
    /// # Errors
    /// If it can't be read.
    pub async fn open(
        &self,
        source: usize,
        resources: &Resources,
        request: &PlanMotionDatabase,
    ) -> Result<Arc<MotionDatabase>, JobError> {
        match (&self.files[source], &request.base) {
            (Source::Base(shard), Some(base)) => {
                let opened = shard.open(&resources.store, resources.memory.max_build_bytes).await;
                Ok(opened.map_err(|error| error.into_job_error(&full_name(base)))?.database)
            }
            (Source::Base(_), None) => Err(JobError::retry("an index file of no base")),
            (Source::Part(artefact), _) => {
                let bytes = resources.read_artefact(artefact, u64::MAX).await?;
                let part = compute::run(move || MotionDatabase::from_bytes(&bytes)).await;
                Ok(part.map_err(JobError::retry)?.into())
            }
        }
    }
}
