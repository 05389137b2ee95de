//! One frame as a request says it.

use std::sync::atomic::AtomicBool;

use body::{BodyModel, MAX_DEVIATIONS};
use camera_jobs::views;
use proto::v1::{self, RefineAnnealing, RefineStage};
use tracking::{Annealing, ObservedFrame, Options, Part, ParticleOptions, Stage, Tracked, Tracker};

use crate::{InputError, error::CallError};

/// Most silhouettes.
const MAX_VIEWS: usize = 64;
/// Most particles times iterations: some seconds on one core.
const MOST_WORK: u32 = 40_000;

/// Refuses what can be refused without looking at pictures or models.
///
/// # Errors
/// With the name of the field.
pub(crate) fn check(request: &v1::RefineFrameRequest) -> Result<(), proto::Error> {
    let least = if request.start.is_some() { 1 } else { 2 };
    if !(least..=MAX_VIEWS).contains(&request.silhouettes.len()) {
        let expected = if least == 1 { "1 to 64" } else { "2 to 64, as no start is given" };
        let (what, found) = ("silhouettes", request.silhouettes.len());
        return Err(proto::Error::Count { what, found, expected });
    }
    if let Some(found) = request.alpha.iter().find(|a| a.is_nan() || a.abs() > MAX_DEVIATIONS) {
        return Err(out_of_range("alpha", found, "-6 to 6 standard deviations"));
    }
    let ParticleOptions { particles, iterations, .. } = particles(&request.options.unwrap_or_default());
    if !(2..=2000).contains(&particles) {
        return Err(out_of_range("options.particles", particles, "2 to 2000, or 0 for 25"));
    }
    if !(1..=200).contains(&iterations) {
        return Err(out_of_range("options.iterations", iterations, "1 to 200, or 0 for 10"));
    }
    let work = particles * iterations;
    if work > MOST_WORK as usize {
        return Err(out_of_range("options.particles times iterations", work, "at most 40000"));
    }
    Ok(())
}

/// Finds the pose.
///
/// # Errors
/// If silhouettes, calibration, shape or pose can't be used, or nobody is found without a start.
pub(crate) fn refine(
    model: &BodyModel,
    request: &v1::RefineFrameRequest,
    stop: &AtomicBool,
) -> Result<v1::RefineFrameResponse, CallError> {
    let seen = views(&request.calibration_name, &request.calibration, &request.silhouettes)
        .map_err(InputError::from)?;
    let asked = request.options.unwrap_or_default();
    let start = match &request.start {
        Some(start) => start.values.clone(),
        None => {
            let options = shape_fit::Options::default();
            shape_fit::fit_pose(model, &request.alpha, &seen.views, &options).map_err(InputError::from)?.pose
        }
    };
    let options = Options { particles: (!asked.local_only).then(|| particles(&asked)), ..Options::default() };
    let mut tracker = Tracker::new(model, &request.alpha, &start, options).map_err(InputError::from)?;
    let frame = ObservedFrame::new(asked.frame as usize, &seen.views).map_err(InputError::from)?;
    let found = tracker.track(&frame, stop).map_err(InputError::from)?;
    let cameras = seen.views.iter().map(|(camera, _)| camera.name.clone()).collect();
    Ok(answer(model, &found, cameras, seen.warnings))
}

fn particles(asked: &v1::RefineOptions) -> ParticleOptions {
    let or = |asked: u32, default: usize| if asked == 0 { default } else { asked as usize };
    let default = ParticleOptions::default();
    ParticleOptions {
        particles: or(asked.particles, default.particles),
        iterations: or(asked.iterations, default.iterations),
        with_prior: !asked.without_prior,
        annealing: match asked.annealing() {
            RefineAnnealing::Interacting => Annealing::Interacting,
            RefineAnnealing::Filter => Annealing::Filter,
        },
        part: if asked.whole_pose { Part::Whole } else { Part::Misaligned },
        seed: asked.seed,
        ..default
    }
}

fn answer(
    model: &BodyModel,
    found: &Tracked,
    cameras: Vec<String>,
    warnings: Vec<String>,
) -> v1::RefineFrameResponse {
    let rig = model.rig();
    let stage = match found.stage {
        Stage::Unseen => RefineStage::Unseen,
        Stage::Local => RefineStage::Local,
        Stage::Particles => RefineStage::Particles,
        Stage::Misaligned => RefineStage::Misaligned,
    };
    let limbs = found.misalignment.limbs.iter().map(|limb| v1::LimbFit {
        name: limb.limb.name().to_owned(),
        error_m: limb.error_m,
        is_misaligned: limb.is_misaligned,
    });
    let overlaps = cameras.into_iter().zip(&found.ious);
    v1::RefineFrameResponse {
        pose: Some(proto::poses::to_wire(&found.pose)),
        dof_names: rig.dofs().iter().map(|dof| dof.name.clone()).collect(),
        joint_positions: found.joints.iter().map(proto::points::to_wire).collect(),
        joint_names: rig.joints().iter().map(|joint| joint.name.clone()).collect(),
        stage: stage.into(),
        limbs: limbs.collect(),
        overlaps: overlaps.map(|(camera, overlap)| v1::CameraOverlap { camera, overlap: *overlap }).collect(),
        effective_sample_size: found.effective_sample_size,
        warnings,
    }
}

fn out_of_range(field: &'static str, found: impl ToString, expected: &'static str) -> proto::Error {
    proto::Error::OutOfRange { field, found: found.to_string(), expected }
}
