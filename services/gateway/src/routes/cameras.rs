//! Starting runs on sessions with cameras.

use std::collections::BTreeMap;

use ::multi_view::Parameters;
use formats::FileRole;
use jobs::{
    InputFile,
    body_model::SHIPPED,
    inverse_kinematics::{self, InverseKinematics, SolveInverseKinematics},
    multi_view::{self, PlanMultiView},
};
use serde_json::{Map, Value};
use sqlx::PgConnection;
use uuid::Uuid;

use super::{
    body_models,
    lookup::{Latest, Lock, Session},
    start::start,
};
use crate::error::{Error, Result};

/// Kind of runs by inverse kinematics.
pub(super) const INVERSE_KINEMATICS: &str = inverse_kinematics::RUN_KIND;
/// Most files that a request names the cameras of.
const MAX_NAMES: usize = 256;
/// Units of calibrations, metres.
const METRES_PER_UNIT: std::ops::RangeInclusive<f64> = 1e-6..=1e3;

/// What a request says for cameras alone.
#[derive(Debug)]
pub(super) struct CameraRequest {
    /// the body model; the shipped one when left out
    pub body_model: Option<String>,
    /// cameras to use, by name
    pub cameras: Vec<String>,
    /// file -> camera
    pub camera_files: BTreeMap<String, String>,
    /// kind of the background model
    pub background: Option<String>,
    /// of the calibration
    pub metres_per_unit: Option<f64>,
}

impl CameraRequest {
    /// Refuses what is given of it: the session has no cameras.
    pub fn check_absent(&self) -> Result<()> {
        let given = [
            ("body_model", self.body_model.is_some()),
            ("cameras", !self.cameras.is_empty()),
            ("camera_files", !self.camera_files.is_empty()),
            ("background", self.background.is_some()),
            ("metres_per_unit", self.metres_per_unit.is_some()),
        ];
        match given.iter().find(|(_, is_given)| *is_given) {
            Some((name, _)) => Err(Error::Unprocessable(format!(
                "{name} is for sessions with cameras; upload a calibration, or say kind: multi-view"
            ))),
            None => Ok(()),
        }
    }
}

/// A run on cameras, as asked for.
#[derive(Debug)]
pub(super) struct NewMultiView {
    pub request: CameraRequest,
    pub up: Option<model::Axis>,
    pub parameters: Map<String, Value>,
    /// what the silhouettes are for, if it is that
    pub inverse_kinematics: Option<InverseKinematics>,
}

impl NewMultiView {
    /// The run and its first job.
    pub async fn start(
        self,
        db: &mut PgConnection,
        project_id: Uuid,
        session: &Session,
        files: Vec<InputFile>,
    ) -> Result<Uuid> {
        let parameters = self.resolve()?;
        check_files(&files)?;
        let Self { request, up, inverse_kinematics, .. } = self;
        if request.camera_files.len() > MAX_NAMES || request.cameras.len() > MAX_NAMES {
            return Err(Error::Unprocessable(format!(
                "cameras and camera_files have more than {MAX_NAMES} names, expected fewer"
            )));
        }
        if let Some(metres) = request.metres_per_unit.filter(|metres| !METRES_PER_UNIT.contains(metres)) {
            return Err(Error::Unprocessable(format!(
                "metres_per_unit is {metres}, expected 0.000001 to 1000"
            )));
        }
        let which = request.body_model.as_deref().unwrap_or(SHIPPED);
        let model = body_models::find(db, project_id, which, Latest::Ready, Lock::Share).await?;
        let plan = PlanMultiView {
            session_id: session.id,
            session_name: session.name.clone(),
            body_model: model.ready()?,
            files,
            cameras: request.cameras,
            camera_files: request.camera_files,
            up,
            metres_per_unit: request.metres_per_unit,
            parameters,
            inverse_kinematics,
        };
        let kind = if plan.inverse_kinematics.is_some() { INVERSE_KINEMATICS } else { multi_view::RUN_KIND };
        let run_id = start(db, project_id, kind, Some(session.id), &plan).await?;
        body_models::uses(db, run_id, Some(model.id).filter(|id| !id.is_nil())).await?;
        Ok(run_id)
    }

    /// A run by inverse kinematics: on cameras where its solver looks at them.
    pub async fn start_solving(
        self,
        db: &mut PgConnection,
        project_id: Uuid,
        session: &Session,
        files: Vec<InputFile>,
    ) -> Result<Uuid> {
        match &self.inverse_kinematics {
            Some(how) if how.solver.uses_images() => self.start(db, project_id, session, files).await,
            _ => start_blind(db, project_id, session, files, self).await,
        }
    }

    /// All parameters, those left out with their defaults.
    fn resolve(&self) -> Result<Parameters> {
        let refuse = |error: &dyn std::fmt::Display| Error::Unprocessable(format!("parameters: {error}"));
        let mut parameters: Parameters =
            serde_json::from_value(Value::Object(self.parameters.clone())).map_err(|error| refuse(&error))?;
        if let Some(kind) = &self.request.background {
            parameters.background.model =
                serde_json::from_value(Value::from(kind.as_str())).map_err(|_| {
                    Error::Unprocessable(format!(
                        "background is {kind:?}, expected auto, plate, adaptive or mixture"
                    ))
                })?;
        }
        parameters.check().map_err(|error| refuse(&error))?;
        Ok(parameters)
    }
}

/// A run by inverse kinematics from measured points alone: the run and its only job.
async fn start_blind(
    db: &mut PgConnection,
    project_id: Uuid,
    session: &Session,
    files: Vec<InputFile>,
    asked: NewMultiView,
) -> Result<Uuid> {
    let request = &asked.request;
    let stray = [
        ("cameras", !request.cameras.is_empty()),
        ("camera_files", !request.camera_files.is_empty()),
        ("background", request.background.is_some()),
        ("metres_per_unit", request.metres_per_unit.is_some()),
        ("parameters", !asked.parameters.is_empty()),
    ];
    if let Some((name, _)) = stray.iter().find(|(_, is_given)| *is_given) {
        return Err(Error::Unprocessable(format!(
            "{name} is for cameras; this run looks at none: upload a calibration and what they saw, or leave it out"
        )));
    }
    let which = request.body_model.as_deref().unwrap_or(SHIPPED);
    let model = body_models::find(db, project_id, which, Latest::Ready, Lock::Share).await?;
    let solve = SolveInverseKinematics {
        session_id: session.id,
        session_name: session.name.clone(),
        body_model: model.ready()?,
        files,
        up: asked.up,
        how: asked.inverse_kinematics.unwrap_or_default(),
        cameras: None,
    };
    let run_id = start(db, project_id, INVERSE_KINEMATICS, Some(session.id), &solve).await?;
    body_models::uses(db, run_id, Some(model.id).filter(|id| !id.is_nil())).await?;
    Ok(run_id)
}

/// A calibration, and something that cameras saw.
fn check_files(files: &[InputFile]) -> Result<()> {
    let count = |role: FileRole| files.iter().filter(|file| file.role == role).count();
    match count(FileRole::Calibration) {
        1 => {}
        0 => {
            return Err(Error::Unprocessable(
                "the session has no calibration; upload a .toml, .json, .yml, .xml or .qca.txt file of its cameras first".into(),
            ));
        }
        found => {
            return Err(Error::Unprocessable(format!(
                "the session has {found} calibration files, expected one"
            )));
        }
    }
    if [FileRole::Video, FileRole::Images, FileRole::Masks].into_iter().all(|role| count(role) == 0) {
        return Err(Error::Unprocessable(
            "the session has no video, images or masks; upload what the cameras saw first".into(),
        ));
    }
    Ok(())
}
