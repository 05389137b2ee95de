//! The job of a run by inverse kinematics: points and silhouettes to the poses of a body.

use std::sync::Arc;

use body::{BodyModel, Shape};
use camera_jobs::{Silhouettes, reports};
use formats::FileRole;
use inverse_kinematics::{Figure, sequence::Solved};
use jobs::{
    InputFile,
    inverse_kinematics::SolveInverseKinematics,
    multi_view::{CameraClips, CameraReport, frame_rate},
};
use kinematics::ControlPoint;
use model::{counted, shown, shown_rate};
use nalgebra::Vector3;
use queue::{Handler, JobContext, JobError, Outcome};
use service::compute;

use super::{
    MAX_STEPS,
    evidence::{self, Frames},
    finished::Finished,
    outliers::{self, Outlier, Reach},
    report,
};
use crate::{InputError, Shared, plan_job};

/// Rates that frames are solved at.
const FRAME_RATES: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

pub(crate) struct IkHandler {
    pub shared: Arc<Shared>,
}

/// What is solved.
struct Problem {
    model: Arc<BodyModel>,
    shape: Shape,
    figure: Figure,
    points: Vec<ControlPoint>,
    frames: Frames,
    /// metres, NaN where not measured, shape `[frames][points]`
    measured: Vec<Vec<Vector3<f64>>>,
    warnings: Vec<String>,
}

impl Handler for IkHandler {
    type Job = SolveInverseKinematics;

    async fn run(&self, context: JobContext, request: SolveInverseKinematics) -> Result<Outcome, JobError> {
        let resources = &self.shared.resources;
        check(&request)?;
        context.progress(0.0, "reading the session's files");
        let (cameras, clips) = self.cameras(&context, &request).await?;
        let model = self.shared.models.get(&request.body_model).await?;
        let problem = self.problem(&request, model, &cameras).await?;
        context.check()?;

        let (first, count) = (problem.frames.first, problem.frames.count);
        let silhouettes = Silhouettes::read(resources, &clips, first..first + count).await?;
        let (watched, how) = (context.clone(), request.how.clone());
        let solved = compute::run(move || -> Result<_, InputError> {
            let Problem { figure, measured, .. } = &problem;
            let mut solver = figure.solver(how.solver, how.steps)?;
            let mut solved = Vec::with_capacity(count);
            for (index, measured) in measured.iter().enumerate() {
                if watched.is_cancelled() {
                    break;
                }
                let views = silhouettes.views(first + index)?;
                solved.push(solver.next(&figure.targets(measured), &views)?);
                watched.progress(
                    0.02 + 0.9 * (index + 1) as f64 / count as f64,
                    format!("frame {} of {count}", index + 1),
                );
            }
            Ok((problem, solved))
        });
        let (problem, solved) = solved.await?;
        context.check()?;
        let finished = Arc::new(compute::run(move || problem.finish(solved)).await?);
        let written =
            results::write(&resources.store, &context, results::formats(&finished), 0.95..0.99).await?;
        let job = resources.job_report(&context, finished.solved.len());
        let run = report::run_json(resources.origin(&context), &request, &cameras, &finished, &job)?;
        let run = results::write_one(&resources.store, &context, run).await?;
        Ok(Outcome::default().artefacts(written).artefact(run))
    }
}

impl Problem {
    /// The poses as motion, and what is doubtful about them.
    fn finish(self, solved: Vec<Solved>) -> Result<Finished, InputError> {
        let Self { model, shape, figure, points, frames, measured, mut warnings } = self;
        let poses: Vec<_> = solved.iter().map(|solved| figure.pose(solved, None)).collect();
        let motion = model.motion(&shape, &poses, frames.rate)?;
        let count = |points: &Vec<Vector3<f64>>| points.iter().filter(|p| p.x.is_finite()).count();
        let measured = measured.iter().map(count).collect();
        let points = points.into_iter().map(|point| point.name).collect();
        warnings.extend(report::doubts(&solved));
        Ok(Finished { model, shape, points, solved, measured, frame_rate: frames.rate, motion, warnings })
    }
}

impl IkHandler {
    /// What the cameras' jobs have left; nothing without cameras.
    async fn cameras(
        &self,
        context: &JobContext,
        request: &SolveInverseKinematics,
    ) -> Result<(Vec<CameraReport>, Vec<CameraClips>), JobError> {
        if request.cameras.is_none() {
            return Ok((Vec::new(), Vec::new()));
        }
        let resources = &self.shared.resources;
        let artefacts = resources.artefacts_before(context).await?;
        let cameras = reports(resources, &artefacts).await?;
        let clips = cameras.iter().map(|camera| CameraClips::new(camera, &artefacts));
        let clips = clips.collect::<Result<_, _>>()?;
        Ok((cameras, clips))
    }

    async fn problem(
        &self,
        request: &SolveInverseKinematics,
        model: Arc<BodyModel>,
        cameras: &[CameraReport],
    ) -> Result<Problem, JobError> {
        let resources = &self.shared.resources;
        let is_wanted = |file: &&InputFile| file.role == FileRole::ControlPoints;
        let files: Vec<_> = request.inputs.files.iter().filter(is_wanted).cloned().collect();
        let files = plan_job::fetch(&resources.store, &files, resources.memory.max_object_bytes).await?;
        let (request, limit) = (request.clone(), resources.memory.max_session_frames);
        let mut warnings = request.cameras.as_ref().map_or(Vec::new(), |planned| planned.warnings.clone());
        warnings.extend(cameras.iter().flat_map(|camera| camera.warnings.iter().cloned()));
        let rate_of_cameras = frame_rate(cameras, &mut warnings);
        let end = cameras.iter().map(|camera| camera.end_frame).min();
        let read = compute::run(move || -> Result<Problem, InputError> {
            let shape = camera_jobs::shape(&model, &request.how.body)?;
            let skeleton = model.skeleton(&shape)?;
            let chosen = evidence::read(&files, &request.how, request.inputs.up, &skeleton, &mut warnings)?;
            let own = chosen.trajectories.frame_rate();
            let rate = request.how.frame_rate.or(rate_of_cameras).unwrap_or(own);
            if !FRAME_RATES.contains(&rate) {
                return Err(out_of_range("the frame rate", rate, "1 to 1000 frames a second"));
            }
            let first = request.cameras.as_ref().map_or(0, |planned| planned.first_frame);
            let mut frames = Frames::within(&chosen.trajectories, first, rate);
            if let Some(end) = end {
                let seen = end.saturating_sub(first);
                if seen.abs_diff(frames.count) > 1 {
                    warnings.push(format!(
                        "the cameras have {}, the measured points {} at the same {} frames a second: only those \
                         that both have are used, and both are assumed to begin at the same moment",
                        counted(seen, "frame"),
                        frames.count,
                        shown_rate(rate)
                    ));
                }
                frames.count = frames.count.min(seen);
            }
            if frames.count == 0 {
                return Err(InputError::NoFrame);
            }
            if frames.count > limit {
                return Err(InputError::TooLong { frames: frames.count, limit });
            }
            let figure = Figure::body(&model, &shape, &chosen.points)?;
            let mut measured = evidence::resampled(&chosen.trajectories, &chosen.points, frames);
            let reach = Reach::new(&skeleton, &chosen.points, shape.measurements(&model).stature_m);
            let out = outliers::remove(&mut measured, &reach);
            outliers::check_unit(&measured, &reach, &chosen.points)?;
            if let Some(Outlier { frame, point }) = out.first() {
                warnings.push(format!(
                    "positions that no body reaches from the other points are ignored: {}, the first of {} in frame \
                     {frame}",
                    counted(out.len(), "sample"),
                    chosen.points[*point].name
                ));
            }
            if let Some((frame, way_m)) = outliers::jump(&measured, rate) {
                warnings.push(format!(
                    "all measured points move {way_m:.1} m from frame {} to frame {frame}, faster than anybody can: the \
                     recording may have been cut there, or its origin moved",
                    frame - 1
                ));
            }
            if measured.iter().flatten().all(|position| position.x.is_nan()) {
                return Err(InputError::NothingMeasured);
            }
            Ok(Problem { shape, figure, points: chosen.points, frames, measured, warnings, model })
        });
        Ok(read.await?)
    }
}

fn check(request: &SolveInverseKinematics) -> Result<(), InputError> {
    let steps = request.how.steps;
    if !(1..=MAX_STEPS).contains(&steps) {
        return Err(out_of_range("steps", steps as f64, "1 to 200"));
    }
    Ok(())
}

fn out_of_range(field: &'static str, found: f64, expected: &'static str) -> InputError {
    InputError::OutOfRange { field, found: shown(found), expected }
}
