//! The job that learns a body model from uploaded scans.

use std::sync::Arc;

use body::{LearnOptions, Learned, ScanOptions, ScanSet};
use formats::archive::{self, Entry, Limits};
use jobs::{
    InputFile,
    body_model::BuildBodyModel,
    run_json::{RunReport, Timings},
};
use library::versions::{Built, body_models::BuiltBodyModel};
use model::counted;
use queue::{Handler, JobContext, JobError, JobId, Outcome};
use results::ResultFile;
use serde::Serialize;
use serde_json::{Value, json};
use service::{FileError, MakesVersion, compute};
use store::{Key, key};

use crate::{InputError, Shared};

/// Name of the model in the object store.
const MODEL: &str = "model.marey-body";
/// Result that says what the model was learned from.
const SUMMARY: &str = "summary.json";

pub(crate) struct BuildHandler {
    pub shared: Arc<Shared>,
}

/// What a model was learned from, and how well. Shown with it.
#[derive(Debug, Clone, Serialize)]
struct Contents {
    description: String,
    num_scans: usize,
    num_with_sex: usize,
    num_with_age: usize,
    num_joints: usize,
    num_dofs: usize,
    num_faces: usize,
    /// by the first 1, 2, … components
    variance_kept: Vec<f64>,
    files: Vec<Value>,
    warnings: Vec<String>,
}

impl MakesVersion for BuildHandler {
    fn version_prefix(job: &BuildBodyModel, id: JobId) -> Key {
        key::body_model_job_prefix(job.body_model.id, id.0)
    }
}

impl Handler for BuildHandler {
    type Job = BuildBodyModel;

    async fn run(&self, context: JobContext, request: BuildBodyModel) -> Result<Outcome, JobError> {
        let (store, id) = (&self.shared.resources.store, request.body_model.id);
        let entries = self.unpack(&context, &request.files).await?;
        context.progress(0.3, "reading the scans");
        let options = ScanOptions { metres_per_unit: request.metres_per_unit };
        let set = compute::run(move || ScanSet::read(entries, &options)).await.map_err(InputError::from)?;
        context.check()?;
        context.progress(0.4, format!("learning from {}", counted(set.num_scans(), "scan")));
        let learning = LearnOptions {
            components: request.components,
            description: format!(
                "{}@{}, learned from {}",
                request.body_model.name,
                request.body_model.version,
                counted(set.num_scans(), "scan")
            ),
            ..LearnOptions::default()
        };
        let (set, learned) = compute::run(move || {
            let learned = set.learn(&learning)?;
            Ok::<_, body::Error>((set, learned))
        })
        .await
        .map_err(InputError::from)?;
        context.check()?;
        context.progress(0.95, "storing the model");
        let contents = contents(&set, &learned, &request.files);
        let bytes = learned.model.to_bytes();
        let key =
            key::body_model(id, context.id().0, context.lease_number().0, MODEL).map_err(JobError::retry)?;
        let stored = store.put(&key, bytes.into()).await.map_err(JobError::retry)?;
        let report = self.shared.resources.job_report(&context, 0);
        let run = RunReport {
            origin: self.shared.resources.origin(&context),
            warnings: &contents.warnings,
            timings: Timings::default().one("build", &report),
            frames: None,
            points: None,
        };
        let own = json!({
            "num_vertices": learned.model.num_vertices(),
            "num_components": learned.model.num_components(),
            "bytes": stored.bytes,
            "blake3": stored.blake3,
        });
        let run = results::run_json(&run, &request, json!({ "built": own }))?;
        let files = vec![ResultFile::json(SUMMARY, &contents)?, run];
        let written = results::write(store, &context, files, 0.97..1.0).await?;
        let model = BuiltBodyModel {
            built: Built { id, bytes: stored.bytes, stored, contents },
            num_vertices: learned.model.num_vertices(),
            num_components: learned.model.num_components(),
        };
        Ok(Outcome::default().artefacts(written).on_complete(move |connection| {
            let model = model.clone();
            Box::pin(async move { model.set_ready(connection).await })
        }))
    }
}

impl BuildHandler {
    /// All files that models are learned from, out of all uploads.
    async fn unpack(&self, context: &JobContext, files: &[InputFile]) -> Result<Vec<Entry>, JobError> {
        let resources = &self.shared.resources;
        let memory = &resources.memory;
        let mut left = memory.max_build_bytes;
        let mut entries = Vec::new();
        for (done, file) in files.iter().enumerate() {
            context.check()?;
            context.progress(0.3 * done as f64 / files.len() as f64, format!("unpacking {}", file.name));
            let bytes = resources.read_file(file, memory.max_object_bytes).await?;
            let (name, total_bytes) = (file.name.clone(), left);
            let unpacked = compute::run(move || -> Result<Vec<Entry>, InputError> {
                let limits = Limits { total_bytes, ..Limits::default() };
                let is_single = body::is_part_of_scan_set(&name);
                let mut entries = archive::entries_where(&name, &bytes, &limits, body::is_part_of_scan_set)
                    .map_err(FileError::in_file(&name))?;
                if !is_single {
                    entries.iter_mut().for_each(|entry| entry.name.insert_str(0, &format!("{name}/")));
                }
                Ok(entries)
            })
            .await?;
            left = left.saturating_sub(unpacked.iter().map(|entry| entry.bytes.len() as u64).sum());
            entries.extend(unpacked);
        }
        Ok(entries)
    }
}

fn contents(set: &ScanSet, learned: &Learned, files: &[InputFile]) -> Contents {
    let model = &learned.model;
    let [num_with_sex, num_with_age] = set.num_told();
    let mut warnings = set.warnings.clone();
    if warnings.len() > 20 {
        let more = warnings.len() - 20;
        warnings.truncate(20);
        warnings.push(format!("and {}", counted(more, "similar warning")));
    }
    Contents {
        description: model.description().to_owned(),
        num_scans: set.num_scans(),
        num_with_sex,
        num_with_age,
        num_joints: model.rig().num_joints(),
        num_dofs: model.rig().num_dofs(),
        num_faces: model.faces().len(),
        variance_kept: learned.variance_kept.clone(),
        files: files
            .iter()
            .map(|f| json!({ "name": f.name, "bytes": f.bytes, "blake3": f.blake3 }))
            .collect(),
        warnings,
    }
}
