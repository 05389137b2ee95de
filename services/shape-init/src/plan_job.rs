//! The job that reads a session's calibration, finds out whose file is whose, and plans the rest of the run.

use std::sync::Arc;

use bytes::Bytes;
use formats::{FileRole, calibration, image_files};
use jobs::{
    InputFile, JobReport,
    inverse_kinematics::{CamerasPlanned, SolveInverseKinematics},
    multi_view::{FitShape, MakeSilhouettes, PlanMultiView, Source, SourceKind},
};
use model::Camera;
use multi_view::CameraRecord;
use queue::{ChildJob, Handler, JobContext, JobError, Outcome};
use service::{FileError, compute};

use crate::{
    InputError, Shared,
    children::FIT_WEIGHT,
    members,
    sources::{self, CameraSources},
};

/// Largest calibration file, bytes.
const MAX_CALIBRATION_BYTES: u64 = 64 << 20;
/// Share of the last job in the run's progress, where nothing follows it; that of a camera is 1.
const LAST_WEIGHT: f64 = 2.0;

pub(crate) struct PlanHandler {
    pub shared: Arc<Shared>,
}

impl Handler for PlanHandler {
    type Job = PlanMultiView;

    async fn run(&self, context: JobContext, request: PlanMultiView) -> Result<Outcome, JobError> {
        request.parameters.check().map_err(InputError::from)?;
        context.progress(0.1, "reading the calibration");
        // What is wrong with the model is said now, not when all silhouettes are made.
        self.shared.models.get(&request.body_model).await?;
        let (sources, picture_size) = self.sources(&context, &request).await?;
        let file = calibration_file(&request.inputs.files)?;
        let bytes = self.shared.resources.read_file(file, MAX_CALIBRATION_BYTES).await?;
        let (mut warnings, cameras) = read_calibration(&request, file, &bytes, picture_size)?;
        let names: Vec<String> = cameras.iter().map(|camera| camera.name.clone()).collect();
        let matched = sources::match_cameras(
            sources,
            &names,
            &request.choice.cameras,
            &request.choice.camera_files,
            &mut warnings,
        )?;
        // measured points say where the person is; without them it takes two views
        sources::check_count(&matched, if request.inverse_kinematics.is_some() { 1 } else { 2 })?;
        let plan = self.shared.resources.job_report(&context, 0);
        Ok(Outcome::default().children(children(request, &cameras, matched, warnings, plan)?))
    }
}

impl PlanHandler {
    /// All sources of pictures, and the size of the first picture in an archive, for calibrations that don't say it.
    async fn sources(
        &self,
        context: &JobContext,
        request: &PlanMultiView,
    ) -> Result<(Vec<Source>, Option<[u32; 2]>), JobError> {
        let resources = &self.shared.resources;
        let most = resources.memory.max_build_bytes;
        let (mut found, mut size) = (Vec::new(), None);
        for file in &request.inputs.files {
            context.check()?;
            if !sources::is_archive(file) {
                found.extend(sources::from_file(file));
                continue;
            }
            context.progress(0.2, format!("looking into {}", file.name));
            let bytes = resources.read_file(file, resources.memory.max_object_bytes).await?;
            let (archive, needs_size) = (file.clone(), size.is_none());
            let (sources, first) = compute::run(move || -> Result<_, InputError> {
                let sources = sources::from_archive(&archive, &bytes, most)?;
                let first = if needs_size { first_size(&sources, &bytes, most)? } else { None };
                Ok((sources, first))
            })
            .await?;
            found.extend(sources);
            size = size.or(first);
        }
        Ok((found, size))
    }
}

/// Size of the first picture of the first source, if it is one.
fn first_size(sources: &[Source], bytes: &Bytes, max_bytes: u64) -> Result<Option<[u32; 2]>, InputError> {
    let Some(source) = sources.iter().find(|source| source.kind != SourceKind::Plate) else {
        return Ok(None);
    };
    let Some(wanted) = &source.members else { return Ok(None) };
    let entries = members::read(&source.file.name, bytes, wanted, max_bytes)?;
    Ok(entries
        .first()
        .and_then(|first| image_files::size(&first.bytes, &image_files::Limits::default()).ok()))
}

/// The only calibration of a session.
fn calibration_file(files: &[InputFile]) -> Result<&InputFile, InputError> {
    let found: Vec<&InputFile> = files.iter().filter(|file| file.role == FileRole::Calibration).collect();
    let role = FileRole::Calibration;
    match found[..] {
        [only] => Ok(only),
        [] => Err(FileError::Missing { role }.into()),
        _ => {
            let names = found.iter().map(|file| file.name.clone()).collect();
            Err(FileError::Several { role, names }.into())
        }
    }
}

/// Cameras of the calibration, and what was assumed of them.
fn read_calibration(
    request: &PlanMultiView,
    file: &InputFile,
    bytes: &Bytes,
    image_size: Option<[u32; 2]>,
) -> Result<(Vec<String>, Vec<Camera>), InputError> {
    let up = request.inputs.up.map(Into::into);
    let options = calibration::Options { up, metres_per_unit: request.choice.metres_per_unit, image_size };
    let read = calibration::read(&file.name, bytes, &options).map_err(FileError::in_file(&file.name))?;
    let warnings = read.warnings.into_iter().map(|w| format!("{}: {}", file.name, w.message)).collect();
    Ok((warnings, read.value))
}

/// One job a camera, and the one that waits for all of them.
fn children(
    request: PlanMultiView,
    cameras: &[Camera],
    matched: Vec<CameraSources>,
    warnings: Vec<String>,
    plan: JobReport,
) -> Result<Vec<ChildJob>, queue::Error> {
    let num_cameras = matched.len();
    let goes_on = request.parameters.track && request.inverse_kinematics.is_none();
    let last_weight = if goes_on { FIT_WEIGHT } else { LAST_WEIGHT };
    let mut parameters = request.parameters.clone();
    // points of clothes are for those who follow a person
    parameters.texture &= goes_on;
    let mut jobs = Vec::with_capacity(num_cameras + 1);
    for (index, sources) in matched.into_iter().enumerate() {
        jobs.push(ChildJob::new(&MakeSilhouettes {
            index,
            camera: CameraRecord::from(&cameras[sources.camera]),
            source: sources.pictures,
            plate: sources.plate,
            parameters: parameters.clone(),
        })?);
    }
    let last = match request.inverse_kinematics.clone() {
        Some(how) => ChildJob::new(&SolveInverseKinematics {
            inputs: request.inputs,
            body_model: request.body_model,
            how,
            cameras: Some(CamerasPlanned {
                first_frame: request.parameters.first_frame,
                choice: request.choice,
                parameters: Some(request.parameters),
                warnings,
                plan,
            }),
        }),
        None => ChildJob::new(&FitShape { request, warnings, plan }),
    };
    jobs.push(last?.weight(last_weight).depends_on(0..num_cameras));
    Ok(jobs)
}
