//! Runs by inverse kinematics: poses of a body whose measured points are reached.

use body::{MAX_DEVIATIONS, Wanted};
use formats::FileRole;
use jobs::inverse_kinematics::{
    BodyDescription, InverseKinematics, Method, RUN_KIND, Sex, SolveInverseKinematics,
};
use model::shown;
use serde::Deserialize;
use serde_json::{Value, json};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    cameras::{self, CameraFields},
    enqueue::NewRun,
    markers::MarkerFields,
    session_run::{OnSession, SessionRun, Shared, shared},
};
use crate::{
    error::{Error, Result},
    page::Item,
};

/// Most steps of one solve, and those when left out.
const STEPS: (usize, usize) = (200, 15);
/// Frames a second.
const FRAME_RATES: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Poses of a body by inverse kinematics, from measured points and the silhouettes of any number of cameras.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct InverseKinematicsRun {
    /// the solver and the body
    #[serde(default)]
    inverse_kinematics: InverseKinematicsRequest,
    /// the body model, by id, `name` (its latest version that is ready) or `name@version`; `shipped`, the one that comes
    /// with the program, when left out
    #[schema(example = "shipped")]
    body_model: Option<String>,
    /// the axis of the file of points, and of a calibration's world, that points up: `x`, `y` or `z`; what the files say when
    /// left out
    #[schema(value_type = Option<String>, example = "z")]
    up: Option<model::Axis>,
    #[serde(flatten)]
    #[schema(inline)]
    markers: MarkerFields,
    #[serde(flatten)]
    #[schema(inline)]
    cameras: CameraFields,
}

/// How poses are solved by inverse kinematics, and for whom.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct InverseKinematicsRequest {
    /// `plain` (measured points alone), `priority` (then a neutral posture), `image-constrained` (measured points, silhouettes in
    /// their null space), `extended` (both in one Jacobian), `image-first`, or `reach-then-image-then-posture`; when left out
    /// `image-constrained` if the session has cameras, else `priority`
    #[schema(value_type = Option<String>, example = "image-constrained")]
    solver: Option<Method>,
    /// largest number of steps for each frame, 1 to 200; 15 when left out
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
    #[schema(value_type = Option<String>, example = "female")]
    sex: Option<Sex>,
    /// coefficients of the body model, standard deviations, as in `shape.json`; instead of measurements
    #[serde(default)]
    #[schema(value_type = Option<Vec<f64>>)]
    alpha: Vec<f64>,
}

impl SessionRun for InverseKinematicsRun {
    const KIND: &'static str = RUN_KIND;
    const IMPLIED_BY: Option<&'static str> = Some("inverse_kinematics");
    const SHARED: &'static [Shared] = &[shared::<MarkerFields>, shared::<CameraFields>];

    fn example() -> Value {
        json!({
            "kind": "inverse-kinematics",
            "inverse_kinematics": {
                "frame_rate": 30.0,
                "stature_m": 1.78,
                "mass_kg": 74.0,
                "sex": "female",
            },
            "marker_set": "auto",
        })
    }

    fn check(&self) -> Result<()> {
        // the fields of cameras are checked when it is known whether there are any
        self.inverse_kinematics.check()?;
        self.markers.check()
    }

    async fn plan(self, db: &mut PgConnection, project_id: Uuid, on: OnSession) -> Result<NewRun> {
        let solver = self.inverse_kinematics.solver_for(&on)?;
        if !on.has(FileRole::ControlPoints) {
            return Err(Error::Unprocessable(format!(
                "the session has no measured points; upload a {} file first",
                FileRole::ControlPoints.endings()
            )));
        }
        let choice = self.markers.into();
        let how = InverseKinematics { choice, ..self.inverse_kinematics.resolve(solver) };
        let session_id = on.session.id;
        if solver.uses_images() {
            self.cameras.check()?;
            self.cameras.check_for_silhouettes()?;
        } else if let Some(field) = self.cameras.first_given()? {
            return Err(Error::Unprocessable(format!(
                "{field} is for runs that use cameras, and this one uses none; upload a calibration and what the cameras \
                 saw, or leave {field} out"
            )));
        }
        let body_model = cameras::body_model(db, project_id, self.body_model.as_deref()).await?;
        let run = if solver.uses_images() {
            let plan = self.cameras.plan(on, &body_model, self.up, Some(how))?;
            NewRun::new(&plan)?
        } else {
            let solve = SolveInverseKinematics {
                inputs: on.inputs(self.up),
                body_model: body_model.ready()?,
                how,
                cameras: None,
            };
            NewRun::new(&solve)?
        };
        Ok(run.on_session(session_id).with_body_model(body_model.id()))
    }
}

impl InverseKinematicsRequest {
    fn check(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        if let Some(steps) = self.steps.filter(|steps| !(1..=STEPS.0).contains(steps)) {
            return refuse(format!("inverse_kinematics.steps is {steps}, expected 1 to {}", STEPS.0));
        }
        if let Some(rate) = self.frame_rate.filter(|rate| !FRAME_RATES.contains(rate)) {
            let found = shown(rate);
            return refuse(format!(
                "inverse_kinematics.frame_rate is {found}, expected 1 to 1000 frames a second"
            ));
        }
        self.check_body()
    }

    /// Refuses a body that nobody has, and one that is described in two ways.
    fn check_body(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        let (stature_m, mass_kg, age_years) = (self.stature_m, self.mass_kg, self.age_years);
        let wanted = Wanted { stature_m, mass_kg, age_years, sex: self.sex };
        wanted.check().map_err(|error| Error::Unprocessable(format!("inverse_kinematics.{error}")))?;
        if self.alpha.is_empty() {
            return Ok(());
        }
        if wanted != Wanted::default() {
            return refuse(
                "inverse_kinematics.alpha is given beside measurements, expected one of the two".into(),
            );
        }
        if self.alpha.len() > body::MAX_COMPONENTS {
            let (found, most) = (self.alpha.len(), body::MAX_COMPONENTS);
            return refuse(format!("inverse_kinematics.alpha has {found} numbers, expected at most {most}"));
        }
        match self.alpha.iter().enumerate().find(|(_, a)| a.abs() > MAX_DEVIATIONS) {
            None => Ok(()),
            Some((number, a)) => refuse(format!(
                "inverse_kinematics.alpha[{number}] is {}, expected -{MAX_DEVIATIONS} to {MAX_DEVIATIONS} standard \
                 deviations",
                shown(*a)
            )),
        }
    }

    /// The solver that is named, or the one that suits the session's files.
    fn solver_for(&self, on: &OnSession) -> Result<Method> {
        let has_cameras = on.has(FileRole::Calibration)
            && [FileRole::Video, FileRole::Images, FileRole::Masks].into_iter().any(|role| on.has(role));
        match self.solver {
            None if has_cameras => Ok(Method::ImageConstrained),
            None => Ok(Method::Priority),
            Some(solver) if solver.uses_images() && !has_cameras => Err(Error::Unprocessable(format!(
                "inverse_kinematics.solver is {}, which needs silhouettes; upload a calibration and what the cameras \
                 saw, or choose plain or priority",
                json!(solver)
            ))),
            Some(solver) => Ok(solver),
        }
    }

    /// Everything resolved, but for points and markers.
    fn resolve(self, solver: Method) -> InverseKinematics {
        InverseKinematics {
            solver,
            steps: self.steps.unwrap_or(STEPS.1),
            frame_rate: self.frame_rate,
            body: BodyDescription {
                alpha: self.alpha,
                stature_m: self.stature_m,
                mass_kg: self.mass_kg,
                age_years: self.age_years,
                sex: self.sex,
            },
            ..InverseKinematics::default()
        }
    }
}
