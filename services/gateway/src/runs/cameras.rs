use std::collections::BTreeMap;

use background::ModelKind;
use formats::FileRole;
use jobs::{
    CameraChoice, InputFile, body_model::SHIPPED, inverse_kinematics::InverseKinematics,
    multi_view::PlanMultiView,
};
use multi_view::Parameters;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{session_run::OnSession, units::check_unit};
use crate::{
    error::{Error, Result},
    json,
    lock::Lock,
    refusal::one_of,
    versioned::{self, BodyModel, Latest},
};

/// Most cameras, and most files whose camera is named.
const MAX_NAMES: usize = 256;

/// Which cameras are used, and how silhouettes are made of what they saw.
#[derive(Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(super) struct CameraFields {
    /// cameras to use, by the calibration's names; all that have pictures when left out
    #[schema(example = json!(["cam01", "cam02", "cam03"]))]
    cameras: Vec<String>,
    /// file, or `ARCHIVE/FOLDER` -> name of its camera, where names don't tell
    #[schema(example = json!({"GX010042.MP4": "cam01"}))]
    camera_files: BTreeMap<String, String>,
    /// `auto` (the plate if there is one), `plate`, `adaptive` or `mixture`; `auto` when left out
    #[schema(value_type = Option<String>, example = "auto")]
    background: Option<ModelKind>,
    /// metres of one unit of the calibration, where the file doesn't say it
    #[schema(example = 0.001)]
    metres_per_unit: Option<f64>,
    /// further parameters, by name, among others: `track` (false: the body in the first frame alone), `first_frame`,
    /// `num_frames`, `frame_rate` (where no video tells it), `chunk_frames` and `overlap_frames` (frames that are tracked in
    /// one piece, and that it goes on into the next), `particles` (0: none), `iterations`, `prior` and `seed` of the search
    /// for limbs that do not fit, `texture` (points are followed in the pictures), `overlay` (a video of each camera); runs
    /// by inverse kinematics take `first_frame`, `num_frames`, `largest_side` and `background` alone
    #[schema(example = json!({"chunk_frames": 150, "particles": 25}))]
    parameters: Map<String, Value>,
}

impl CameraFields {
    /// Refuses what makes no sense on any session.
    pub fn check(&self) -> Result<()> {
        if self.camera_files.len() > MAX_NAMES || self.cameras.len() > MAX_NAMES {
            return Err(Error::Unprocessable(format!(
                "cameras and camera_files have {} and {} names, expected at most {MAX_NAMES} each",
                self.cameras.len(),
                self.camera_files.len()
            )));
        }
        if self.cameras.iter().any(|name| name.trim().is_empty()) {
            return Err(Error::Unprocessable("cameras has an empty name".into()));
        }
        let mut names = self.cameras.iter().enumerate();
        if let Some((_, name)) = names.find(|(place, name)| self.cameras[..*place].contains(name)) {
            return Err(Error::Unprocessable(format!("cameras has {name:?} twice, expected each once")));
        }
        check_unit("metres_per_unit", self.metres_per_unit)?;
        self.resolve().map(drop)
    }

    /// Refuses parameters of what comes after the silhouettes, for runs that end with these.
    pub fn check_for_silhouettes(&self) -> Result<()> {
        let mut given = self.parameters.iter().filter(|(_, value)| !value.is_null());
        match given.find(|(name, _)| !Parameters::OF_SILHOUETTES.contains(&name.as_str())) {
            None => Ok(()),
            Some((name, _)) if name == "frame_rate" => Err(Error::Unprocessable(
                "parameters.frame_rate is not for inverse kinematics; use inverse_kinematics.frame_rate"
                    .into(),
            )),
            Some((name, _)) => Err(Error::Unprocessable(format!(
                "parameters.{name} is not for inverse kinematics, which takes {} of a camera run's parameters",
                one_of(&Parameters::OF_SILHOUETTES)
            ))),
        }
    }

    /// The first field that is given, if any is.
    pub fn first_given(&self) -> Result<Option<String>> {
        let (mut given, default) = (serde_json::to_value(self)?, serde_json::to_value(Self::default())?);
        if let Some(parameters) = given["parameters"].as_object_mut() {
            parameters.retain(|_, value| !value.is_null());
        }
        let mut fields = given.as_object().into_iter().flatten();
        Ok(fields.find(|(name, value)| default[*name] != **value).map(|(name, _)| name.clone()))
    }

    /// All parameters, those left out with their defaults.
    fn resolve(&self) -> Result<Parameters> {
        let refuse = |error: &dyn std::fmt::Display| Error::Unprocessable(format!("parameters.{error}"));
        let mut parameters: Parameters = json::read_parameters(self.parameters.clone())?;
        if let Some(kind) = self.background {
            if self.parameters.get("background").is_some_and(|given| !given["model"].is_null()) {
                let what = "background is given twice: here and as parameters.background";
                return Err(Error::Unprocessable(what.into()));
            }
            parameters.background.model = kind;
        }
        parameters.check().map_err(|error| refuse(&error))?;
        Ok(parameters)
    }

    /// The first job of a run that looks at cameras: a body is looked for in the silhouettes, or they are for inverse
    /// kinematics.
    pub fn plan(
        self,
        on: OnSession,
        body_model: &BodyModel,
        up: Option<model::Axis>,
        inverse_kinematics: Option<InverseKinematics>,
    ) -> Result<PlanMultiView> {
        check_files(&on.files)?;
        check_named_files(&self.camera_files, &on.files)?;
        let parameters = self.resolve()?;
        Ok(PlanMultiView {
            inputs: on.inputs(up),
            body_model: body_model.ready()?,
            choice: CameraChoice {
                cameras: self.cameras,
                camera_files: self.camera_files,
                metres_per_unit: self.metres_per_unit,
            },
            parameters,
            inverse_kinematics,
        })
    }
}

/// The body model that a run names: the one that comes with the program when it names none.
pub(super) async fn body_model(
    db: &mut PgConnection,
    project_id: Uuid,
    which: Option<&str>,
) -> Result<BodyModel> {
    versioned::find(db, project_id, which.unwrap_or(SHIPPED), Latest::Ready, Lock::Share).await
}

/// Refuses a name that no file of the session has. What is in an archive is seen when that is read.
fn check_named_files(named: &BTreeMap<String, String>, files: &[InputFile]) -> Result<()> {
    let is_there = |name: &str| {
        let archive = name.split_once('/').map_or(name, |(archive, _)| archive);
        files.iter().any(|file| file.name == archive)
    };
    match named.keys().find(|name| !is_there(name)) {
        None => Ok(()),
        Some(name) => Err(Error::Unprocessable(format!(
            "camera_files names {name:?}, expected a file of the session, or ARCHIVE/FOLDER"
        ))),
    }
}

/// Refuses a session without a calibration, or without anything that cameras saw.
fn check_files(files: &[InputFile]) -> Result<()> {
    let names = |role: FileRole| {
        let with_role = files.iter().filter(move |file| file.role == role);
        with_role.map(|file| file.name.as_str()).collect::<Vec<_>>()
    };
    match names(FileRole::Calibration)[..] {
        [_] => {}
        [] => {
            return Err(Error::Unprocessable(format!(
                "the session has no calibration; upload a {} file of its cameras first",
                FileRole::Calibration.endings()
            )));
        }
        ref several => return Err(Error::Unprocessable(FileRole::Calibration.keep_one(several))),
    }
    if [FileRole::Video, FileRole::Images, FileRole::Masks].into_iter().all(|role| names(role).is_empty()) {
        return Err(Error::Unprocessable(
            "the session has no video, images or masks; upload what the cameras saw first".into(),
        ));
    }
    Ok(())
}
