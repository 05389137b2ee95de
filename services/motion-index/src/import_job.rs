//! The job that reads the motion files of one part and brings them into the coordinates of the database.

use crate::{
    inputs::{self, Reader},
    plan_job::no_database,
};
use bytes::Bytes;
use formats::media_type::BINARY;
use jobs::{
    Object,
    motion_database::{ImportMotion, PartClip, PartReport},
};
use motion_db::{Augment, MotionDatabase};
use queue::{Handler, JobContext, JobError, Outcome};
use service::{Resources, compute, objects};

/// The artefact that holds the part: a database; there is none if all clips were too short.
pub(crate) const PART: &str = "part.mdb";
/// The artefact that says what is in it.
pub(crate) const REPORT: &str = "part.json";

pub(crate) struct ImportHandler {
    pub resources: Resources,
}

impl ImportHandler {
    async fn read(&self, name: &str, object: &Object) -> Result<Bytes, JobError> {
        let input = objects::Input { name, store_key: &object.store_key, blake3: &object.blake3 };
        objects::read(&self.resources.store, input, u64::MAX).await
    }
}

impl Handler for ImportHandler {
    type Job = ImportMotion;

    async fn run(&self, context: JobContext, payload: ImportMotion) -> Result<Outcome, JobError> {
        let basis = self.read("the basis", &payload.basis).await?;
        let skeletons = self.read("the skeletons", &payload.skeletons).await?;
        let motions = self.read("the motions", &payload.motions).await?;
        let watched = context.clone();
        let Imported { part, clips, warnings } =
            compute::run(move || import(&basis, &skeletons, &motions, &payload, &watched)).await?;
        context.check()?;
        let num_poses = clips.iter().map(|clip| clip.num_poses).sum();
        let report = PartReport { clips, warnings, job: self.resources.job_report(&context, num_poses) };
        let store = &self.resources.store;
        let report = objects::write_json(store, &context, REPORT, &report).await?;
        let mut outcome = Outcome::default().artefact(report);
        if let Some(part) = part {
            let part = objects::write(store, &context, PART, BINARY, part).await?;
            outcome = outcome.artefact(part);
        }
        Ok(outcome)
    }
}

/// What came of the motion files of one part.
struct Imported {
    /// none if all clips were too short
    part: Option<Vec<u8>>,
    clips: Vec<PartClip>,
    warnings: Vec<String>,
}

fn import(
    basis: &[u8],
    skeletons: &[u8],
    motions: &[u8],
    payload: &ImportMotion,
    context: &JobContext,
) -> Result<Imported, JobError> {
    let basis = MotionDatabase::from_bytes(basis).map_err(JobError::retry)?;
    let motions = inputs::unpack_packed(motions)?;
    let mut reader = Reader::new(inputs::unpack_packed(skeletons)?, payload.bvh_metres_per_unit);
    let augment = Augment { mirror: payload.augment.mirror, speeds: payload.augment.speeds.clone() };
    let mut part = basis.emptied();
    let (mut clips, mut warnings) = (Vec::new(), Vec::new());
    let num_files = motions.len();
    for (file, motion) in motions.into_iter().enumerate() {
        context.check()?;
        context.progress(file as f64 / num_files as f64, format!("reading {}", motion.name));
        let (clip, doubts) = reader.clip(motion)?;
        warnings.extend(doubts);
        let Some(clip) = clip else { continue };
        for clip in augment.clips(&clip).map_err(|e| no_database(&e))? {
            let num_poses = part.append(&clip).map_err(|e| no_database(&e))?;
            if num_poses > 0 {
                let (name, subject, action) = (clip.name, clip.subject, clip.action);
                clips.push(PartClip { file, name, subject, action, num_poses });
            }
        }
    }
    Ok(Imported { part: (!clips.is_empty()).then(|| part.to_bytes()), clips, warnings })
}
