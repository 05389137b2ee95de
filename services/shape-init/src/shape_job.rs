//! The job that finds pose and shape of the person in the first frames and writes the results.

use std::sync::Arc;

use body::BodyModel;
use camera_jobs::{Silhouettes, reports};
use formats::image_files;
use jobs::{
    Object, file_part,
    multi_view::{CameraClips, CameraReport, FitShape, TrackingSession, picture_name},
    run_json::MultiViewReport,
};
use model::Image;
use multi_view::Parameters;
use queue::{Artefact, Handler, JobContext, JobError, Outcome};
use service::{compute, objects};
use shape_fit::Fit;

use crate::{
    InputError, Shared,
    children::{FIT_SHOWN, children},
    drawing::{Drawer, FITS},
    fit::{self, Found, Moment},
    hull::hull,
    results::{self, ResultFile},
    shape_report::shape_report,
};

/// Name of the result with everything that decided the others.
const RUN: &str = "run.json";
/// Largest picture, bytes.
const MAX_PICTURE_BYTES: u64 = 256 << 20;
/// Below this a user had better look.
const LOW_CONFIDENCE: f64 = 0.5;
/// Name of the artefact with all that the jobs after this one are given.
const SESSION: &str = "tracking.json";
/// Frames, spread over the session, in which a person is looked for who was not in the first.
const LATER_TRIES: usize = 7;
/// Frames a second where no file tells.
const FRAME_RATE: f64 = 30.0;

pub(crate) struct ShapeHandler {
    pub shared: Arc<Shared>,
}

impl Handler for ShapeHandler {
    type Job = FitShape;

    async fn run(&self, context: JobContext, job: FitShape) -> Result<Outcome, JobError> {
        let FitShape { request, mut warnings, plan } = job;
        let Shared { resources, models } = &*self.shared;
        let shown = if request.parameters.track { FIT_SHOWN } else { 1.0 };
        let progress = |share: f64, phrase: &str| context.progress(shown * share, phrase);
        progress(0.0, "reading the silhouettes");
        let artefacts = resources.artefacts_before(&context).await?;
        let cameras = reports(resources, &artefacts).await?;
        warnings.extend(cameras.iter().flat_map(|camera| camera.warnings.iter().cloned()));
        let clips: Result<Vec<_>, _> =
            cameras.iter().map(|camera| CameraClips::new(camera, &artefacts)).collect();
        let clips = clips?;
        let end_frame = end_frame(&cameras, &mut warnings);
        let model = models.get(&request.body_model).await?;
        context.check()?;
        progress(0.1, "finding pose and shape");
        let parameters = &request.parameters;
        let found = self.find(&context, &model, parameters, &clips, end_frame).await;
        let found = found.map_err(|error| explained(error, &cameras))?;
        context.check()?;
        let Found { moments, fits, left_out } = found;
        let (moments, fits) = (Arc::new(moments), Arc::new(fits));
        warnings.extend(left_out);
        warnings.extend(doubts(&fits));
        progress(0.7, "carving the visual hull");
        let (seen, cell_m) = (moments.clone(), parameters.hull_voxel_m);
        let carved = compute::run(move || seen.first().map(|first| hull(&first.views, cell_m))).await;
        context.check()?;
        let mut files = Vec::new();
        match carved {
            Some(Ok(carved)) => files.push(results::mesh("hull.ply", &carved.mesh)),
            // The body was found all the same.
            Some(Err(error)) => warnings.push(format!("no visual hull: {error}")),
            None => {}
        }
        progress(0.8, "writing the body");
        let frame_rate = frame_rate(parameters, &cameras, &mut warnings);
        files.extend(self.body(&model, &moments, &fits, frame_rate, &warnings).await?);
        if parameters.track {
            // those of the whole motion come later
            files.retain(|file| ![results::BODY, results::POSE].contains(&file.name.as_str()));
        }
        let mut artefacts_of_results = Vec::new();
        for file in files {
            artefacts_of_results.push(self.write(&context, file).await?);
        }
        for (index, camera) in cameras.iter().enumerate() {
            context.check()?;
            progress(0.85 + 0.14 * index as f64 / cameras.len() as f64, "drawing overlays");
            if let Some(file) = self.overlay(camera, &artefacts, &moments, (&model, &fits)).await? {
                artefacts_of_results.push(self.write(&context, file).await?);
            }
        }
        let report = resources.job_report(&context, moments.len());
        let mut outcome = artefacts_of_results.into_iter().fold(Outcome::default(), Outcome::artefact);
        if parameters.track {
            let session = TrackingSession {
                alpha: fits.first().map_or(Vec::new(), |fit| fit.alpha.clone()),
                first_frame: parameters.first_frame,
                plan,
                fit_shape: report,
                clips,
                cameras,
                end_frame,
                frame_rate,
                warnings,
                request,
            };
            let content = serde_json::to_vec(&session).map_err(JobError::retry)?;
            let artefact =
                objects::write(&resources.store, &context, SESSION, "application/json", content).await?;
            let children = children(&session, &Object::from(&artefact))?;
            outcome = outcome.artefact(artefact).children(children);
        } else {
            let report = MultiViewReport::new(
                context.run_id().0,
                &request,
                (&plan, &report),
                &cameras,
                &warnings,
                None,
            );
            let content = serde_json::to_vec_pretty(&report).map_err(JobError::retry)?;
            let run = ResultFile { name: RUN.to_owned(), media_type: "application/json", content };
            outcome = outcome.artefact(self.write(&context, run).await?);
        }
        Ok(outcome)
    }
}

impl ShapeHandler {
    /// Pose and shape in the frames that were asked for. Where the person is to be followed and is not in these yet, they are
    /// looked for in others.
    async fn find(
        &self,
        context: &JobContext,
        model: &Arc<BodyModel>,
        parameters: &Parameters,
        clips: &[CameraClips],
        end_frame: usize,
    ) -> Result<Found, FindError> {
        let wanted = parameters.shape_fit_frames(end_frame);
        let first = match self.find_in(model, parameters, clips, &wanted).await {
            Err(FindError::Nobody(error)) if parameters.track => error,
            found => return found,
        };
        let spread = Parameters { shape_frames: LATER_TRIES + 1, shape_step: None, ..parameters.clone() };
        for frame in spread.shape_fit_frames(end_frame).into_iter().filter(|frame| !wanted.contains(frame)) {
            context.check()?;
            match self.find_in(model, parameters, clips, &[frame]).await {
                Err(FindError::Nobody(_)) => {}
                Err(error) => return Err(error),
                Ok(mut found) => {
                    found.left_out.push(format!("the shape is that of frame {frame}, as before: {first}"));
                    return Ok(found);
                }
            }
        }
        Err(FindError::Nobody(first))
    }

    async fn find_in(
        &self,
        model: &Arc<BodyModel>,
        parameters: &Parameters,
        clips: &[CameraClips],
        frames: &[usize],
    ) -> Result<Found, FindError> {
        let mut moments = Vec::new();
        for &frame in frames {
            let silhouettes = Silhouettes::read(&self.shared.resources, clips, frame..frame + 1).await?;
            moments.push(Moment { frame, views: silhouettes.views(frame).map_err(JobError::retry)? });
        }
        let (model, parameters) = (model.clone(), parameters.clone());
        let found = compute::run(move || fit::fit(&model, moments, &parameters)).await;
        found.map_err(FindError::Nobody)
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
        (model, fits): (&Arc<BodyModel>, &Arc<Vec<Fit>>),
    ) -> Result<Option<ResultFile>, JobError> {
        let Some(frame) = moments.first().map(|moment| moment.frame) else { return Ok(None) };
        let picture = picture_name(camera.index, frame);
        let Some(artefact) = artefacts.iter().find(|a| a.name == picture) else { return Ok(None) };
        let bytes = self.shared.resources.read_artefact(artefact, MAX_PICTURE_BYTES).await?;
        let own = camera.camera.camera().map_err(JobError::retry)?;
        let name = format!("overlay_{}.png", file_part(&camera.camera.name, camera.index));
        let (model, fits) = (model.clone(), fits.clone());
        let drawn = compute::run(move || -> Result<ResultFile, JobError> {
            let read = image_files::read_image(&bytes, &image_files::Limits::default());
            let mut picture: Image = read.map_err(JobError::retry)?;
            if let Some(first) = fits.first() {
                Drawer::new(&model, &own).outline(&mut picture, &first.mesh.vertices, FITS);
            }
            Ok(results::picture(name, &picture))
        });
        Ok(Some(drawn.await?))
    }

    async fn write(&self, context: &JobContext, file: ResultFile) -> Result<Artefact, JobError> {
        objects::write_result(
            &self.shared.resources.store,
            context,
            &file.name,
            file.media_type,
            file.content,
        )
        .await
    }
}

/// Why no body was found.
enum FindError {
    /// nobody is there, or they can't be recognised
    Nobody(InputError),
    /// something else
    Job(JobError),
}

impl From<JobError> for FindError {
    fn from(error: JobError) -> Self {
        Self::Job(error)
    }
}

/// One past the last frame that all cameras have.
fn end_frame(cameras: &[CameraReport], warnings: &mut Vec<String>) -> usize {
    let ends = || cameras.iter().map(|camera| camera.end_frame);
    let (first, last) = (ends().min().unwrap_or(0), ends().max().unwrap_or(0));
    if first < last {
        warnings.push(format!(
            "cameras have {first} to {last} frames: only those that all have are used, and all are taken to begin at the same \
             moment"
        ));
    }
    first
}

/// Frames a second: as asked for, or as the videos say.
fn frame_rate(parameters: &Parameters, cameras: &[CameraReport], warnings: &mut Vec<String>) -> f64 {
    let rates = || cameras.iter().filter_map(|camera| camera.frame_rate);
    if let Some(asked) = parameters.frame_rate {
        return asked;
    }
    let Some(rate) = rates().next() else {
        if parameters.track {
            warnings.push(format!(
                "no file states the frame rate: {FRAME_RATE} frames a second are assumed; state another by --set frame_rate=…"
            ));
        }
        return FRAME_RATE;
    };
    if let Some(other) = rates().find(|other| (other - rate).abs() > 0.01 * rate) {
        warnings.push(format!(
            "the videos have {rate:.3} and {other:.3} frames a second: frames are taken to be of the same moments all the same, \
             and {rate:.3} is used; convert them to one rate"
        ));
    }
    rate
}

/// Why no body was found, with what is known of the cameras: poor silhouettes are the usual reason.
fn explained(error: FindError, cameras: &[CameraReport]) -> JobError {
    let error = match error {
        FindError::Nobody(error) => error,
        FindError::Job(error) => return error,
    };
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
