//! The job that finds pose and shape of the person in the first frames and writes the results.

use std::{sync::Arc, time::Instant};

use body::BodyModel;
use camera_jobs::{CameraClips, Silhouettes, named, reports};
use formats::image_files;
use model::Image;
use payloads::{CameraReport, MultiViewReport, file_part, picture_name};
use queue::{Artefact, Handler, JobContext, JobError, Outcome};
use service::{compute, objects};
use shape_fit::Fit;

use crate::{
    INITIALISE_BODY, InputError, Shared,
    fit::{self, Moment},
    hull::hull,
    payload::InitialiseBody,
    results::{self, ResultFile},
    shape_report::shape_report,
};

/// Name of the result with everything that decided the others.
const RUN: &str = "run.json";
/// Largest picture, bytes.
const MAX_PICTURE_BYTES: u64 = 256 << 20;
/// Colour of the outline of the body that was found.
const OUTLINE: [u8; 3] = [0, 255, 120];
/// Below this a user had better look.
const LOW_CONFIDENCE: f64 = 0.5;
/// Frames a second where no file tells, for the one pose in a BVH.
const FRAME_RATE: f64 = 30.0;

pub(crate) struct InitialiseHandler {
    shared: Arc<Shared>,
}

impl InitialiseHandler {
    pub fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }
}

impl Handler for InitialiseHandler {
    fn kind(&self) -> &'static str {
        INITIALISE_BODY
    }

    async fn run(&self, job: JobContext) -> Result<Outcome, JobError> {
        let started = Instant::now();
        let Shared { resources, models } = &*self.shared;
        objects::clean_up_earlier_attempts(&resources.store, &job).await;
        let InitialiseBody { request, mut warnings, plan } = job.payload()?;
        job.progress(0.0, "reading the silhouettes");
        let artefacts = resources.artefacts_before(&job).await?;
        let cameras = reports(resources, &artefacts).await?;
        warnings.extend(cameras.iter().flat_map(|camera| camera.warnings.iter().cloned()));
        let moments = Arc::new(self.moments(&request.parameters, &cameras, &artefacts, &mut warnings).await?);
        let model = models.get(&request.body_model).await?;
        job.check()?;

        job.progress(0.1, "finding pose and shape");
        let (of, parameters, on) = (moments.clone(), request.parameters.clone(), model.clone());
        let fits = compute::run(move || fit::fit(&on, &of, &parameters)).await;
        job.check()?;
        let fits = Arc::new(fits.map_err(|error| explained(error, &cameras))?);
        warnings.extend(doubts(&fits));

        job.progress(0.7, "carving the visual hull");
        let (of, cell_m) = (moments.clone(), request.parameters.hull_voxel_m);
        let carved = compute::run(move || of.first().map(|first| hull(&first.views, cell_m))).await;
        job.check()?;
        let mut files = Vec::new();
        match carved {
            Some(Ok(carved)) => files.push(results::mesh("hull.ply", &carved.mesh)),
            // The body was found all the same.
            Some(Err(error)) => warnings.push(format!("no visual hull: {error}")),
            None => {}
        }
        job.progress(0.8, "writing the body");
        let frame_rate = cameras.iter().find_map(|camera| camera.frame_rate).unwrap_or(FRAME_RATE);
        files.extend(self.body(&model, &moments, &fits, frame_rate, &warnings).await?);
        let mut artefacts_of_results = Vec::new();
        for file in files {
            artefacts_of_results.push(self.write(&job, file).await?);
        }
        for (index, camera) in cameras.iter().enumerate() {
            job.check()?;
            job.progress(0.85 + 0.14 * index as f64 / cameras.len() as f64, "drawing overlays");
            if let Some(file) = self.overlay(camera, &artefacts, &moments, &fits).await? {
                artefacts_of_results.push(self.write(&job, file).await?);
            }
        }
        let report = resources.job_report(&job, started, moments.len());
        let report =
            MultiViewReport::new(job.run_id().0, &request, (&plan, &report), &cameras, &warnings, None);
        let content = serde_json::to_vec_pretty(&report).map_err(JobError::retry)?;
        let run = ResultFile { name: RUN.to_owned(), media_type: "application/json", content };
        artefacts_of_results.push(self.write(&job, run).await?);
        Ok(artefacts_of_results.into_iter().fold(Outcome::default(), Outcome::artefact))
    }
}

impl InitialiseHandler {
    /// The silhouettes of all cameras at the frames from which the shape is found.
    async fn moments(
        &self,
        parameters: &multi_view::Parameters,
        cameras: &[CameraReport],
        artefacts: &[Artefact],
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Moment>, JobError> {
        let ends: Vec<usize> = cameras.iter().map(|camera| camera.end_frame).collect();
        let (first_end, last_end) = (ends.iter().min().copied(), ends.iter().max().copied());
        if let (Some(first), Some(last)) = (first_end, last_end)
            && first < last
        {
            warnings.push(format!(
                "cameras have {first} to {last} frames: only those that all have are used, and all are taken to begin at \
                 the same moment"
            ));
        }
        let clips: Result<Vec<_>, _> =
            cameras.iter().map(|camera| CameraClips::new(camera, artefacts)).collect();
        let clips = clips?;
        let mut moments = Vec::new();
        for frame in parameters.frames_of_shape(first_end.unwrap_or(0)) {
            let silhouettes = Silhouettes::read(&self.shared.resources, &clips, frame..frame + 1).await?;
            moments.push(Moment { frame, views: silhouettes.views(frame).map_err(JobError::retry)? });
        }
        Ok(moments)
    }

    async fn body(
        &self,
        model: &Arc<BodyModel>,
        moments: &Arc<Vec<Moment>>,
        fits: &Arc<Vec<Fit>>,
        frame_rate: f64,
        warnings: &[String],
    ) -> Result<Vec<ResultFile>, JobError> {
        let (model, moments, fits, warnings) =
            (model.clone(), moments.clone(), fits.clone(), warnings.to_vec());
        let made = compute::run(move || -> Result<_, InputError> {
            let alpha = fits.first().map_or(&[][..], |fit| &fit.alpha);
            let shape = model.shape(alpha);
            let report = shape_report(&model, &shape, &moments, &fits, &warnings);
            Ok((results::body_files(&model, &shape, &fits, frame_rate)?, report))
        });
        let (mut files, report) = made.await?;
        let content = serde_json::to_vec_pretty(&report).map_err(JobError::retry)?;
        files.push(ResultFile { name: "shape.json".to_owned(), media_type: "application/json", content });
        Ok(files)
    }

    /// The outline of the body over what a camera saw in the first frame.
    async fn overlay(
        &self,
        camera: &CameraReport,
        artefacts: &[Artefact],
        moments: &Arc<Vec<Moment>>,
        fits: &Arc<Vec<Fit>>,
    ) -> Result<Option<ResultFile>, JobError> {
        let Some(frame) = moments.first().map(|moment| moment.frame) else { return Ok(None) };
        let Some(artefact) = named(artefacts, &picture_name(camera.index, frame)) else { return Ok(None) };
        let bytes = self.shared.resources.read_artefact(artefact, MAX_PICTURE_BYTES).await?;
        let own = camera.camera.camera().map_err(JobError::retry)?;
        let name = format!("overlay_{}.png", file_part(&camera.camera.name, camera.index));
        let fits = fits.clone();
        let drawn = compute::run(move || -> Result<ResultFile, JobError> {
            let read = image_files::read_image(&bytes, &image_files::Limits::default());
            let mut picture: Image = read.map_err(JobError::retry)?;
            if let Some(first) = fits.first() {
                fit::draw_over(&mut picture, &own, &first.mesh, OUTLINE);
            }
            Ok(results::picture(name, &picture))
        });
        Ok(Some(drawn.await?))
    }

    async fn write(&self, job: &JobContext, file: ResultFile) -> Result<Artefact, JobError> {
        objects::write_result(&self.shared.resources.store, job, &file.name, file.media_type, file.content)
            .await
    }
}

/// Why no body was found, with what is known of the cameras: poor silhouettes are the usual reason.
fn explained(error: InputError, cameras: &[CameraReport]) -> JobError {
    let mut message = error.to_string();
    let advice = cameras.iter().filter_map(|camera| {
        let quality = camera.quality.as_ref().filter(|quality| !quality.advice.is_empty())?;
        let said: Vec<String> = quality.advice.iter().take(2).map(ToString::to_string).collect();
        Some(format!(
            "camera {} (silhouettes {:.2} of 1): {}",
            camera.camera.name,
            quality.score,
            said.join("; ")
        ))
    });
    let advice: Vec<String> = advice.collect();
    if !advice.is_empty() {
        message.push_str(". Of the cameras: ");
        message.push_str(&advice.join(". "));
    }
    message.push_str(
        ". The pictures silhouette_CAMERA.png among the results show what was taken for the person",
    );
    JobError::give_up(message, format!("{error:?}"))
}

/// What a user should know of a fit that did not fail.
fn doubts(fits: &[Fit]) -> Vec<String> {
    let mut doubts = Vec::new();
    for fit in fits {
        for view in fit.views.iter().filter(|view| !view.is_used) {
            doubts.push(format!(
                "camera {} was left out: it sees nobody, or disagrees with the others (overlap {:.2})",
                view.camera, view.iou
            ));
        }
        if fit.confidence < LOW_CONFIDENCE {
            doubts.push(format!("the confidence is {:.2} of 1: look at the overlays", fit.confidence));
        }
    }
    doubts.sort();
    doubts.dedup();
    doubts
}
