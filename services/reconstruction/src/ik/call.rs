//! `SolveInverseKinematics`: a few frames at once.

use std::sync::Arc;

use camera_jobs::views;
use inverse_kinematics::{Figure, Method};
use jobs::inverse_kinematics::BodyDescription;
use kinematics::control_points;
use model::PointTrajectories;
use proto::v1::{self, InverseKinematicsMethod as Wire, solve_inverse_kinematics_request::Performer};
use service::FileError;
use tokio_util::sync::CancellationToken;

use super::{
    MAX_POINTS, MAX_STEPS,
    outliers::{self, Reach},
};
use crate::{InputError, error::CallError};

/// Largest request, bytes: silhouettes as PNG take some kilobytes each.
pub(crate) const MAX_REQUEST_BYTES: usize = 64 << 20;
const MAX_FRAMES: usize = 600;
/// Most silhouettes of one moment, and of a request.
const MAX_VIEWS: usize = 64;
const MAX_SILHOUETTES: usize = 2400;
/// It is read once a frame.
const MAX_CALIBRATION_BYTES: usize = 1 << 20;
const DEFAULT_STEPS: usize = 15;

/// Checks what can be checked before anything is read.
///
/// # Errors
/// With the field that is out of range.
pub(crate) fn check(request: &v1::SolveInverseKinematicsRequest) -> Result<(), proto::Error> {
    let refuse = |what, found, expected| Err(proto::Error::Count { what, found, expected });
    let frames = request.frames.len();
    if !(1..=MAX_FRAMES).contains(&frames) {
        return refuse("frames", frames, "1 to 600");
    }
    if request.steps as usize > MAX_STEPS {
        let (found, expected) = (request.steps.to_string(), "1 to 200, or 0 for 15");
        return Err(proto::Error::OutOfRange { field: "steps", found, expected });
    }
    if request.calibration.len() > MAX_CALIBRATION_BYTES {
        return refuse("bytes of calibration", request.calibration.len(), "at most 1048576");
    }
    let most = request.frames.iter().map(|frame| frame.silhouettes.len()).max().unwrap_or(0);
    if most > MAX_VIEWS {
        return refuse("silhouettes of a frame", most, "at most 64");
    }
    let all: usize = request.frames.iter().map(|frame| frame.silhouettes.len()).sum();
    if all > MAX_SILHOUETTES {
        return refuse("silhouettes in all frames", all, "at most 2400");
    }
    if all > 0 && request.calibration.is_empty() {
        return Err(proto::Error::Missing { field: "calibration (there are silhouettes)" });
    }
    match request.performer {
        Some(_) => Ok(()),
        None => Err(proto::Error::Missing { field: "performer: body or skeleton_asf" }),
    }
}

/// Solves the frames; `model` is that of a body, `gone` stops it.
///
/// # Errors
/// If points, body, calibration or pictures can't be used.
pub(crate) fn solve(
    request: &v1::SolveInverseKinematicsRequest,
    model: Option<&body::BodyModel>,
    gone: &CancellationToken,
) -> Result<v1::SolveInverseKinematicsResponse, CallError> {
    let targets = request.frames.iter().map(|frame| v1::ControlPointFrame { samples: frame.targets.clone() });
    // the rate makes no difference: frames are solved as they are
    let trajectories = proto::points::trajectories(&targets.collect::<Vec<_>>(), 1.0)?;
    let names = trajectories.names();
    if names.len() > MAX_POINTS {
        let (what, found, expected) = ("control points", names.len(), "1 to 16");
        return Err(proto::Error::Count { what, found, expected }.into());
    }
    let figure = figure(request, model, &trajectories)?;
    let has_images = request.frames.iter().any(|frame| !frame.silhouettes.is_empty());
    let (method, wire) = method(request.method(), has_images);
    let steps = if request.steps == 0 { DEFAULT_STEPS } else { request.steps as usize };
    let mut solver = figure.solver(method, steps).map_err(InputError::from)?;
    let mut warnings: Vec<String> = Vec::new();
    let mut frames = Vec::with_capacity(request.frames.len());
    let mut before: Option<Vec<f64>> = None;
    for (index, frame) in request.frames.iter().enumerate() {
        if gone.is_cancelled() {
            return Err(CallError::Gone);
        }
        let seen = if frame.silhouettes.is_empty() {
            Vec::new()
        } else {
            let read = views(&request.calibration_name, &request.calibration, &frame.silhouettes);
            let read = read.map_err(|source| InputError::Frame { frame: index, source })?;
            warnings.extend(read.warnings.into_iter().filter(|_| index == 0));
            read.views
        };
        let targets = figure.targets(trajectories.frame(index));
        let solved = solver.next(&targets, &seen).map_err(InputError::from)?;
        let pose = figure.pose(&solved, before.as_deref());
        frames.push(v1::InverseKinematicsSolution {
            pose: Some(proto::poses::to_wire(&pose)),
            joint_positions: figure.joints(&solved).iter().map(proto::points::to_wire).collect(),
            residual_m: solved.residual_m,
            overlap: solved.overlap,
            steps: u32::try_from(solved.steps).unwrap_or(u32::MAX),
        });
        before = Some(pose);
    }
    Ok(v1::SolveInverseKinematicsResponse {
        dof_names: figure.dof_names().to_vec(),
        joint_names: figure.joint_names().to_vec(),
        frames,
        method: wire.into(),
        warnings,
    })
}

fn figure(
    request: &v1::SolveInverseKinematicsRequest,
    model: Option<&body::BodyModel>,
    trajectories: &PointTrajectories,
) -> Result<Figure, CallError> {
    let names = trajectories.names();
    let figure = match (&request.performer, model) {
        (Some(Performer::Body(body)), Some(model)) => {
            let described = BodyDescription {
                alpha: body.alpha.clone(),
                stature_m: body.stature_m,
                mass_kg: body.mass_kg,
                age_years: body.age_years,
                sex: camera_jobs::sex(&body.sex)?,
            };
            let shape = camera_jobs::shape(model, &described)?;
            let skeleton = model.skeleton(&shape).map_err(InputError::from)?;
            let points = control_points(&skeleton, names).map_err(InputError::from)?;
            let reach = Reach::new(&skeleton, &points, shape.measurements(model).stature_m);
            let rows = (0..trajectories.num_frames()).map(|frame| trajectories.frame(frame).to_vec());
            outliers::check_unit(&rows.collect::<Vec<_>>(), &reach, &points)?;
            Figure::body(model, &shape, &points)
        }
        (Some(Performer::SkeletonAsf(text)), _) => {
            let in_file = FileError::in_file("skeleton_asf");
            let skeleton = formats::asf::read(text.as_bytes())
                .map_err(in_file)
                .map_err(InputError::from)?
                .value
                .skeleton;
            let points = control_points(&skeleton, names).map_err(InputError::from)?;
            Figure::skeleton(&Arc::clone(&skeleton), &points)
        }
        _ => return Err(proto::Error::Missing { field: "performer: body or skeleton_asf" }.into()),
    };
    Ok(figure.map_err(InputError::from)?)
}

/// The method asked for.
fn method(asked: Wire, has_images: bool) -> (Method, Wire) {
    match asked {
        Wire::Default if has_images => (Method::ImageConstrained, Wire::ImageConstrained),
        Wire::Default => (Method::Priority, Wire::Priority),
        Wire::Plain => (Method::Plain, asked),
        Wire::Priority => (Method::Priority, asked),
        Wire::ImageConstrained => (Method::ImageConstrained, asked),
        Wire::Extended => (Method::Extended, asked),
        Wire::ImageFirst => (Method::ImageFirst, asked),
        Wire::ReachThenImageThenPosture => (Method::ReachThenImageThenPosture, asked),
    }
}
