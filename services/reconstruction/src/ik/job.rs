//! The job of a run by inverse kinematics: points and silhouettes to the poses of a body.

use std::sync::Arc;

use body::{BodyModel, Shape};
use camera_jobs::{Described, Silhouettes, reports};
use formats::FileRole;
use inverse_kinematics::{Figure, sequence::Solved};
use jobs::{
    InputFile,
    inverse_kinematics::SolveInverseKinematics,
    multi_view::{CameraClips, CameraReport, frame_rate},
};
use kinematics::ControlPoint;
use model::Motion;
use nalgebra::Vector3;
use queue::{Artefact, Handler, JobContext, JobError, Outcome};
use service::{compute, objects};

use super::{
    MAX_STEPS,
    evidence::{self, Frames},
    method,
    report::{self, Run},
};
use crate::{InputError, Shared, export, plan_job, run_report::RUN};

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
            let mut solver = figure.solver(method(how.solver), how.steps)?;
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
        let (mut problem, solved) = solved.await?;
        context.check()?;
        problem.warnings.extend(report::doubts(&solved));

        context.progress(0.95, "writing the motion");
        let (problem, solved) = (Arc::new(problem), Arc::new(solved));
        let mut results = self.motion(&context, &problem, &solved).await?;
        let run = Run {
            id: context.run_id().0,
            request: &request,
            points: problem.points.iter().map(|point| point.name.as_str()).collect(),
            model: &problem.model,
            shape: &problem.shape,
            frame_rate: problem.frames.rate,
            solved: &solved,
            cameras: &cameras,
            warnings: &problem.warnings,
            job: &resources.job_report(&context, solved.len()),
        };
        let content = serde_json::to_vec_pretty(&run.report()).map_err(JobError::retry)?;
        results
            .push(objects::write_result(&resources.store, &context, RUN, "application/json", content).await?);
        Ok(results.into_iter().fold(Outcome::default(), Outcome::artefact))
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
        let files: Vec<_> = request.files.iter().filter(is_wanted).cloned().collect();
        let files = plan_job::fetch(&resources.store, &files, resources.memory.max_object_bytes).await?;
        let (request, limit) = (request.clone(), resources.memory.max_session_frames);
        let mut warnings = request.cameras.as_ref().map_or(Vec::new(), |planned| planned.warnings.clone());
        warnings.extend(cameras.iter().flat_map(|camera| camera.warnings.iter().cloned()));
        let rate_of_cameras = frame_rate(cameras, &mut warnings);
        let end = cameras.iter().map(|camera| camera.end_frame).min();
        let read = compute::run(move || -> Result<Problem, InputError> {
            let body = &request.how.body;
            let described = Described {
                alpha: &body.alpha,
                stature_m: body.stature_m,
                mass_kg: body.mass_kg,
                age_years: body.age_years,
                sex: body.sex.as_deref().unwrap_or_default(),
            };
            let shape = described.shape(&model)?;
            let skeleton = model.skeleton(&shape)?;
            let chosen = evidence::read(&files, &request.how, request.up, &skeleton, &mut warnings)?;
            let own = chosen.trajectories.frame_rate();
            let rate = request.how.frame_rate.or(rate_of_cameras).unwrap_or(own);
            if !FRAME_RATES.contains(&rate) {
                return Err(out_of_range("frames a second", rate, "1 to 1000"));
            }
            let first = request.cameras.as_ref().map_or(0, |planned| planned.first_frame);
            let mut frames = Frames::within(&chosen.trajectories, first, rate);
            if let Some(end) = end {
                let seen = end.saturating_sub(first);
                if seen.abs_diff(frames.count) > 1 {
                    warnings.push(format!(
                        "cameras have {seen} frames, the measured points {} at the same {rate} frames a second: only those that both \
                         have are used, and both are taken to begin at the same moment",
                        frames.count
                    ));
                }
                frames.count = frames.count.min(seen);
            }
            if frames.count == 0 {
                return Err(out_of_range("frames that were measured", 0.0, "1 or more"));
            }
            if frames.count > limit {
                return Err(InputError::TooLong { frames: frames.count, limit });
            }
            let figure = Figure::body(&model, &shape, &chosen.points)?;
            let measured = evidence::resampled(&chosen.trajectories, &chosen.points, frames);
            Ok(Problem { shape, figure, points: chosen.points, frames, measured, warnings, model })
        });
        Ok(read.await?)
    }

    /// Writes poses and joints.
    async fn motion(
        &self,
        context: &JobContext,
        problem: &Arc<Problem>,
        solved: &Arc<Vec<Solved>>,
    ) -> Result<Vec<Artefact>, JobError> {
        const TEXT: &str = "text/plain; charset=utf-8";
        const CSV: &str = "text/csv; charset=utf-8";
        let (problem, solved) = (problem.clone(), solved.clone());
        let written = compute::run(move || -> Result<_, InputError> {
            let Problem { model, shape, figure, frames, measured, .. } = &*problem;
            let poses: Vec<_> = solved.iter().map(|solved| figure.pose(solved, None)).collect();
            let motion: Motion = model.motion(shape, &poses, frames.rate)?;
            let count = |points: &Vec<Vector3<f64>>| points.iter().filter(|p| p.x.is_finite()).count();
            let counts: Vec<_> = measured.iter().map(count).collect();
            Ok([
                ("motion.bvh", TEXT, formats::bvh::write(&motion)),
                ("poses.csv", CSV, formats::motion_csv::write(&motion)),
                ("joints.csv", CSV, export::positions(&motion)),
                ("quality.csv", CSV, report::quality_csv(&solved, &counts, frames.rate)),
            ])
        });
        let mut results = Vec::new();
        for (name, media_type, content) in written.await? {
            context.check()?;
            let store = &self.shared.resources.store;
            results.push(objects::write_result(store, context, name, media_type, content).await?);
        }
        Ok(results)
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
    InputError::OutOfRange { field, found: found.to_string(), expected }
}
