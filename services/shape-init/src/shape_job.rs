//! The job that finds pose and shape of the person in the first frames and writes the results.

use std::sync::Arc;

use body::BodyModel;
use camera_jobs::reports;
use formats::image_files;
use jobs::{
    JobReport, Object, file_part,
    multi_view::{CameraClips, CameraReport, FitShape, TrackingSession, picture_name, timings},
    run_json::{Origin, RunReport},
};
use model::Image;
use multi_view::Parameters;
use queue::{Artefact, Handler, JobContext, JobError, Outcome};
use results::ResultFile;
use serde_json::json;
use service::{Resources, compute, objects};
use shape_fit::Fit;

use crate::{
    InputError, Shared,
    children::{FIT_SHOWN, children},
    drawing::{Drawer, FITS},
    export::{self, Finished},
    find::Search,
    fit::{Found, Moment},
    hull::hull,
    shape_report::shape_report,
};

/// Largest picture, bytes.
const MAX_PICTURE_BYTES: u64 = 256 << 20;
/// Below this a user had better look.
const LOW_CONFIDENCE: f64 = 0.5;
/// Name of the artefact with all that the jobs after this one are given.
const SESSION: &str = "tracking.json";
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
        let store = &resources.store;
        let parameters = &request.parameters;
        let shown = if parameters.track { FIT_SHOWN } else { 1.0 };
        context.progress(0.0, "reading the silhouettes");
        let Evidence { artefacts, cameras, clips } = Evidence::read(resources, &context).await?;
        warnings.extend(cameras.iter().flat_map(|camera| camera.warnings.iter().cloned()));
        let end_frame = end_frame(&cameras, &mut warnings);
        let model = models.get(&request.body_model).await?;
        context.check()?;
        context.progress(0.1 * shown, "finding pose and shape");
        let search = Search {
            resources,
            context: &context,
            model: &model,
            parameters,
            cameras: &cameras,
            clips: &clips,
            end_frame,
        };
        let Found { moments, fits, left_out } = search.find().await?;
        context.check()?;
        let (moments, fits) = (Arc::new(moments), Arc::new(fits));
        warnings.extend(left_out);
        warnings.extend(doubts(&fits));
        context.progress(0.7 * shown, "carving the visual hull");
        let mut files = Vec::from_iter(carve(&moments, parameters.hull_voxel_m, &mut warnings).await);
        context.check()?;
        let frame_rate = frame_rate(parameters, &cameras, &mut warnings);
        files.extend(body(&model, &moments, &fits, frame_rate, parameters.track, &warnings).await?);
        let written = results::write(store, &context, files, 0.8 * shown..0.85 * shown).await?;
        let mut outcome = Outcome::default().artefacts(written);
        for (index, camera) in cameras.iter().enumerate() {
            context.check()?;
            let share = 0.85 + 0.14 * index as f64 / cameras.len() as f64;
            context.progress(share * shown, "drawing overlays");
            if let Some(file) = self.overlay(camera, &artefacts, &moments, (&model, &fits)).await? {
                outcome = outcome.artefact(results::write_one(store, &context, file).await?);
            }
        }
        let report = resources.job_report(&context, moments.len());
        if !parameters.track {
            let job = FitShape { request, warnings, plan };
            let run =
                run_json(resources.origin(&context), &job, &cameras, (moments.len(), frame_rate), &report)?;
            return Ok(outcome.artefact(results::write_one(store, &context, run).await?));
        }
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
        let artefact = objects::write_json(store, &context, SESSION, &session).await?;
        let children = children(&session, &Object::from(&artefact))?;
        Ok(outcome.artefact(artefact).children(children))
    }
}

/// What the jobs before this one left.
struct Evidence {
    artefacts: Vec<Artefact>,
    cameras: Vec<CameraReport>,
    /// of every camera
    clips: Vec<CameraClips>,
}

impl Evidence {
    async fn read(resources: &Resources, context: &JobContext) -> Result<Self, JobError> {
        let artefacts = resources.artefacts_before(context).await?;
        let cameras = reports(resources, &artefacts).await?;
        let clips: Result<_, _> = cameras.iter().map(|camera| CameraClips::new(camera, &artefacts)).collect();
        Ok(Self { clips: clips?, cameras, artefacts })
    }
}

/// The visual hull of the first moment. The body was found all the same where there is none.
async fn carve(moments: &Arc<Vec<Moment>>, cell_m: f64, warnings: &mut Vec<String>) -> Option<ResultFile> {
    let moments = moments.clone();
    let carved = compute::run(move || moments.first().map(|first| hull(&first.views, cell_m))).await?;
    match carved {
        Ok(carved) => Some(export::mesh("hull.ply", carved.mesh)),
        Err(error) => {
            warnings.push(format!("no visual hull: {error}"));
            None
        }
    }
}

impl ShapeHandler {
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
            Ok(export::picture(name, picture))
        });
        Ok(Some(drawn.await?))
    }
}

/// What people get of the person: mesh and shape, and where nobody follows them the body in its poses.
async fn body(
    model: &Arc<BodyModel>,
    moments: &Arc<Vec<Moment>>,
    fits: &Arc<Vec<Fit>>,
    frame_rate: f64,
    is_followed: bool,
    warnings: &[String],
) -> Result<Vec<ResultFile>, JobError> {
    let (model, moments, fits, warnings) = (model.clone(), moments.clone(), fits.clone(), warnings.to_vec());
    let made = compute::run(move || -> Result<_, InputError> {
        let shape = model.shape(fits.first().map_or(&[][..], |fit| &fit.alpha));
        let report = shape_report(&model, &shape, &moments, &fits, &warnings);
        let mesh = fits.first().map(|first| export::mesh("mesh.ply", first.mesh.clone()));
        let posed = if is_followed {
            // those of the whole motion come later
            Vec::new()
        } else {
            results::formats(&Arc::new(Finished::new(model, shape, &fits, frame_rate)?))
        };
        Ok((posed, mesh, report))
    });
    let (mut files, mesh, report) = made.await?;
    files.extend(mesh);
    files.push(ResultFile::json("shape.json", &report)?);
    Ok(files)
}

/// `run.json` of a run whose person nobody follows.
fn run_json(
    origin: Origin,
    job: &FitShape,
    cameras: &[CameraReport],
    frames: (usize, f64),
    report: &JobReport,
) -> Result<ResultFile, JobError> {
    let timings = timings(Some(&job.plan), cameras).one("fit_shape", report);
    let own = json!({ "cameras": cameras.iter().map(CameraReport::summary).collect::<Vec<_>>() });
    let run = RunReport { origin, warnings: &job.warnings, timings, frames: Some(frames), points: None };
    results::run_json(&run, &job.request, own)
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
    if let Some(asked) = parameters.frame_rate {
        return asked;
    }
    jobs::multi_view::frame_rate(cameras, warnings).unwrap_or_else(|| {
        if parameters.track {
            warnings.push(format!(
                "no file states the frame rate: {FRAME_RATE} frames a second are assumed; state another by --set frame_rate=…"
            ));
        }
        FRAME_RATE
    })
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
