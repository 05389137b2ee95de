//! Starting runs by inverse kinematics.

use formats::FileRole;
use jobs::{
    InputFile,
    inverse_kinematics::{BodyDescription, IkSolver, InverseKinematics},
};
use serde::Deserialize;
use utoipa::ToSchema;

use crate::error::{Error, Result};

/// Most steps of one solve, and those when left out.
const STEPS: (usize, usize) = (200, 15);
/// Frames a second.
const FRAME_RATES: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// How poses are solved by inverse kinematics, and for whom.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct InverseKinematicsRequest {
    /// `plain` (measured points alone), `priority` (then a neutral posture), `image-constrained` (measured points, silhouettes in
    /// their null space), `extended` (both in one Jacobian), `image-first`, or `reach-then-image-then-posture`; when left out
    /// `image-constrained` if the session has cameras, else `priority`
    #[schema(example = "image-constrained")]
    solver: Option<String>,
    /// most steps of one solve, 1 to 200; 15 when left out
    #[schema(example = 15)]
    steps: Option<usize>,
    /// frames a second that are solved; the cameras', or else those of the file of points, when left out
    #[schema(example = 30.0)]
    frame_rate: Option<f64>,
    /// metres; the mean of the body model when left out, as all that describes the body
    #[schema(example = 1.78)]
    stature_m: Option<f64>,
    /// kilograms
    #[schema(example = 74.0)]
    mass_kg: Option<f64>,
    /// years
    #[schema(example = 31.0)]
    age_years: Option<f64>,
    /// `female` or `male`
    #[schema(example = "female")]
    sex: Option<String>,
    /// coefficients of the body model, standard deviations, as in `shape.json`; instead of measurements
    #[serde(default)]
    alpha: Vec<f64>,
}

impl InverseKinematicsRequest {
    /// Everything resolved, but for points and markers.
    pub fn resolve(&self, files: &[InputFile]) -> Result<InverseKinematics> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        let has = |roles: &[FileRole]| files.iter().any(|file| roles.contains(&file.role));
        let has_cameras =
            has(&[FileRole::Calibration]) && has(&[FileRole::Video, FileRole::Images, FileRole::Masks]);
        let solver = match self.solver.as_deref() {
            None if has_cameras => IkSolver::ImageConstrained,
            None => IkSolver::Priority,
            Some(name) => serde_json::from_value(name.into()).map_err(|_| {
                Error::Unprocessable(format!(
                    "solver is {name:?}, expected plain, priority, image-constrained, extended, image-first or \
                     reach-then-image-then-posture"
                ))
            })?,
        };
        if solver.uses_images() && !has_cameras {
            return refuse(format!(
                "solver is {:?}, which needs silhouettes; upload a calibration and what the cameras saw, or say plain or priority",
                self.solver.as_deref().unwrap_or_default()
            ));
        }
        let steps = self.steps.unwrap_or(STEPS.1);
        if !(1..=STEPS.0).contains(&steps) {
            return refuse(format!("steps is {steps}, expected 1 to {}", STEPS.0));
        }
        if let Some(rate) = self.frame_rate.filter(|rate| !FRAME_RATES.contains(rate)) {
            return refuse(format!("frame_rate is {rate}, expected 1 to 1000"));
        }
        if let Some(sex) = self.sex.as_deref().filter(|sex| !["female", "male"].contains(sex)) {
            return refuse(format!("sex is {sex:?}, expected female or male"));
        }
        if !has(&[FileRole::ControlPoints]) {
            return refuse(
                "the session has no measured points; upload a .csv, .trc or .c3d file first".into(),
            );
        }
        let body = BodyDescription {
            alpha: self.alpha.clone(),
            stature_m: self.stature_m,
            mass_kg: self.mass_kg,
            age_years: self.age_years,
            sex: self.sex.clone(),
        };
        Ok(InverseKinematics {
            solver,
            steps,
            frame_rate: self.frame_rate,
            body,
            ..InverseKinematics::default()
        })
    }
}
