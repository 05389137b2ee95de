//! Starting runs: parameters are resolved, then the run and its first job are inserted in one transaction.

use std::collections::{BTreeMap, BTreeSet};

use axum::extract::State;
use formats::FileRole;
use jobs::{
    InputFile,
    inverse_kinematics::InverseKinematics,
    sparse::{self, PlanSparse},
};
use queue::{Job, NewJob, NewRun, ProjectId};
use serde::Deserialize;
use serde_json::{Map, Value};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    builds,
    cameras::{self, CameraRequest},
    contents, files,
    inverse_kinematics::InverseKinematicsRequest,
    lookup::{self, Latest, Lock},
    runs::{self, Run},
};
use crate::{
    App,
    access::Writer,
    answer::Answer,
    error::{Error, Result},
    extract::{Path, Posted},
};

/// Most names in a mapping.
const MAX_NAMES: usize = 256;
/// Numbers of control points that can be reconstructed from.
const POINTS: std::ops::RangeInclusive<usize> = 2..=16;

/// A reconstruction to be run. What is left out has its default; the run shows everything resolved.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewReconstruction {
    /// `sparse` (from control points and a motion database), `multi-view` (from calibrated cameras) or `inverse-kinematics` (a
    /// body whose measured points are reached, and whose limbs lie in the silhouettes of any number of cameras, if there are
    /// any); what the session's files are for when left out, and to be said if they are for both
    #[schema(example = "sparse")]
    kind: Option<String>,
    /// for control points, and needed there: the motion database to learn from: id, `name` (its latest version that is
    /// ready) or `name@version`
    #[schema(example = "walks")]
    motion_database: Option<String>,
    /// for cameras: the body model, by id, `name` (its latest version that is ready) or `name@version`; `shipped`, the one
    /// that comes with the program, when left out
    #[schema(example = "shipped")]
    body_model: Option<String>,
    /// for cameras: those to use, by the calibration's names; all that have pictures when left out
    #[serde(default)]
    #[schema(example = json!(["cam01", "cam02", "cam03"]))]
    cameras: Vec<String>,
    /// for cameras: file, or `ARCHIVE/FOLDER` -> name of its camera, where names don't tell
    #[serde(default)]
    #[schema(example = json!({"GX010042.MP4": "cam01"}))]
    camera_files: BTreeMap<String, String>,
    /// for cameras: `auto` (the plate if there is one), `plate`, `adaptive` or `mixture`; `auto` when left out
    #[schema(example = "auto")]
    background: Option<String>,
    /// for cameras: metres of one unit of the calibration, where the file doesn't say it
    #[schema(example = 0.001)]
    metres_per_unit: Option<f64>,
    /// for inverse kinematics: the solver and the body; makes the kind that
    inverse_kinematics: Option<InverseKinematicsRequest>,
    /// control points to use, by name; all that the files have when left out
    #[serde(default)]
    #[schema(example = json!(["left_wrist", "right_wrist", "left_ankle", "right_ankle"]))]
    points: Vec<String>,
    /// name in the file -> name of a control point or joint, for files with marker names of their own
    #[serde(default)]
    #[schema(example = json!({"LWRA": "left_wrist"}))]
    mapping: BTreeMap<String, String>,
    /// marker set whose names the file has: `auto` to find out, `none` if they are names of control points, or a preset
    /// such as `plug-in-gait`; `auto` when left out
    #[schema(example = "auto")]
    marker_set: Option<String>,
    /// a marker map (TOML): which markers make which control point, with offsets and standard deviations
    #[schema(example = "[points]\nleft_wrist = [\"LWRA\", \"LWRB\"]\nhead = \"TOP\"\n")]
    marker_map: Option<String>,
    /// what the names of the performer's markers begin with, where a file has several people
    #[schema(example = "Anna:")]
    marker_prefix: Option<String>,
    /// the axis of a TRC or C3D file that points up: `x`, `y` or `z`; what the file says, else y (TRC) or z (C3D), when left out
    #[schema(value_type = Option<String>, example = "z")]
    up: Option<model::Axis>,
    /// metres of one unit of BVH files (their format has no unit); 0.01, centimetres, when left out
    #[schema(example = 0.01)]
    bvh_metres_per_unit: Option<f64>,
    /// `local-regression`, or `nearest` for the nearest-example baseline
    #[schema(example = "local-regression")]
    method: Option<String>,
    /// frames of history that the regression looks at
    #[schema(example = 2)]
    window: Option<u32>,
    /// neighbours that the regression learns from
    #[schema(example = 64)]
    neighbours: Option<u32>,
    /// further parameters of the method, by name. For cameras among others: `track` (false: the body in the first frame
    /// alone), `first_frame`, `num_frames`, `frame_rate` (where no video tells it), `chunk_frames` and `overlap_frames`
    /// (frames that are tracked in one piece, and that it goes on into the next), `particles` (0: none), `iterations`, `prior`
    /// and `seed` of the search for limbs that do not fit, `texture` (points are followed in the pictures), `overlay` (a video
    /// of each camera)
    #[serde(default)]
    #[schema(example = json!({"chunk_frames": 150, "particles": 25}))]
    parameters: Map<String, Value>,
}

impl NewReconstruction {
    /// Whether it is for cameras: as it says, or else as the session's files are.
    fn is_for_cameras(&self, files: &[InputFile]) -> Result<bool> {
        let has = |role: FileRole| files.iter().any(|file| file.role == role);
        match self.kind.as_deref() {
            Some("sparse") => return Ok(false),
            Some("multi-view") => return Ok(true),
            Some(kind) => {
                return Err(Error::Unprocessable(format!(
                    "kind is {kind:?}, expected sparse, multi-view or inverse-kinematics"
                )));
            }
            None => {}
        }
        match (has(FileRole::ControlPoints), has(FileRole::Calibration)) {
            (true, true) => Err(Error::Unprocessable(
                "the session has control points and cameras; say kind: sparse, multi-view or inverse-kinematics".into(),
            )),
            (false, true) => Ok(true),
            (false, false) if self.motion_database.is_none() => Err(Error::Unprocessable(
                "the session has neither control points nor cameras; upload a .csv, .trc or .c3d file, or a calibration and \
                 what the cameras saw"
                    .into(),
            )),
            _ => Ok(false),
        }
    }

    fn for_cameras(&self) -> CameraRequest {
        CameraRequest {
            body_model: self.body_model.clone(),
            cameras: self.cameras.clone(),
            camera_files: self.camera_files.clone(),
            background: self.background.clone(),
            metres_per_unit: self.metres_per_unit,
        }
    }

    /// A run on cameras: what is for control points alone must not be given.
    fn multi_view(&self) -> Result<cameras::NewMultiView> {
        let stray = [
            ("motion_database", self.motion_database.is_some()),
            ("points", !self.points.is_empty()),
            ("mapping", !self.mapping.is_empty()),
            ("marker_set", self.marker_set.is_some()),
            ("marker_map", self.marker_map.is_some()),
            ("marker_prefix", self.marker_prefix.is_some()),
            ("bvh_metres_per_unit", self.bvh_metres_per_unit.is_some()),
            ("method", self.method.is_some()),
            ("window", self.window.is_some()),
            ("neighbours", self.neighbours.is_some()),
        ];
        if let Some((name, _)) = stray.iter().find(|(_, is_given)| *is_given) {
            return Err(Error::Unprocessable(format!(
                "{name} is for sessions of control points, this one has cameras"
            )));
        }
        let (up, parameters) = (self.up, self.parameters.clone());
        Ok(cameras::NewMultiView { request: self.for_cameras(), up, parameters, inverse_kinematics: None })
    }

    fn is_inverse_kinematics(&self) -> Result<bool> {
        match self.kind.as_deref() {
            Some(cameras::INVERSE_KINEMATICS) => Ok(true),
            Some(kind) if self.inverse_kinematics.is_some() => Err(Error::Unprocessable(format!(
                "inverse_kinematics is given with kind {kind:?}, expected kind inverse-kinematics"
            ))),
            _ => Ok(self.inverse_kinematics.is_some()),
        }
    }

    /// A run by inverse kinematics: what is for motion databases must not be given.
    fn inverse_kinematics(&self, files: &[InputFile]) -> Result<cameras::NewMultiView> {
        let stray = [
            ("motion_database", self.motion_database.is_some()),
            ("bvh_metres_per_unit", self.bvh_metres_per_unit.is_some()),
            ("method", self.method.is_some()),
            ("window", self.window.is_some()),
            ("neighbours", self.neighbours.is_some()),
        ];
        if let Some((name, _)) = stray.iter().find(|(_, is_given)| *is_given) {
            return Err(Error::Unprocessable(format!(
                "{name} is for runs with a motion database, this one is by inverse kinematics"
            )));
        }
        self.check_points()?;
        let asked = self.inverse_kinematics.clone().unwrap_or_default();
        let how = InverseKinematics {
            points: self.points.clone(),
            mapping: self.mapping.clone(),
            marker_set: self.marker_set.clone(),
            marker_map: self.marker_map.clone(),
            marker_prefix: self.marker_prefix.clone(),
            ..asked.resolve(files)?
        };
        let (up, parameters) = (self.up, self.parameters.clone());
        Ok(cameras::NewMultiView {
            request: self.for_cameras(),
            up,
            parameters,
            inverse_kinematics: Some(how),
        })
    }

    fn check_points(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        if self.mapping.len() > MAX_NAMES {
            return refuse(format!("mapping has {} names, expected at most {MAX_NAMES}", self.mapping.len()));
        }
        self.check_markers()?;
        if self.points.is_empty() {
            return Ok(());
        }
        if !POINTS.contains(&self.points.len()) {
            return refuse(format!("points has {} names, expected 2 to 16", self.points.len()));
        }
        let mut seen = BTreeSet::new();
        match self.points.iter().find(|name| !seen.insert(*name)) {
            Some(twice) => refuse(format!("points has {twice:?} twice, expected every point once")),
            None => Ok(()),
        }
    }

    /// The markers are said in one way at most, and that way makes sense.
    fn check_markers(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        let set = self.marker_set.as_deref().filter(|set| *set != "auto");
        let ways = [!self.mapping.is_empty(), self.marker_map.is_some(), set.is_some()];
        if ways.iter().filter(|is_given| **is_given).count() > 1 {
            return refuse("expected one of mapping, marker_map and marker_set, found several".into());
        }
        let checked = match (&self.marker_map, set) {
            (Some(text), _) => markers::MarkerMap::parse(text).map(drop),
            (None, Some(set)) if set != "none" => markers::preset(set).map(drop),
            _ if self.marker_prefix.is_some() => {
                return refuse("marker_prefix needs a marker_map, or a marker_set by name".into());
            }
            _ => Ok(()),
        };
        checked.map_err(|error| Error::Unprocessable(error.to_string()))
    }

    fn resolve(&self, has_own_skeleton: bool) -> Result<::sparse::Parameters> {
        resolve_parameters(self.given()?, has_own_skeleton)
    }

    fn given(&self) -> Result<Map<String, Value>> {
        let mut given = self.parameters.clone();
        let named = [
            ("method", self.method.clone().map(Value::from)),
            ("window", self.window.map(Value::from)),
            ("neighbours", self.neighbours.map(Value::from)),
        ];
        for (name, value) in named {
            if let Some(value) = value
                && given.insert(name.into(), value).is_some()
            {
                return Err(Error::Unprocessable(format!("{name} is given twice")));
            }
        }
        Ok(given)
    }
}

/// All parameters of the method, those left out with their defaults. Without a skeleton of the performer's own the
/// database's is borrowed, and whose clips have one like it says nothing: they are not preferred.
pub(super) fn resolve_parameters(
    mut given: Map<String, Value>,
    has_own_skeleton: bool,
) -> Result<::sparse::Parameters> {
    let refuse = |error: &dyn std::fmt::Display| Error::Unprocessable(format!("parameters: {error}"));
    if !has_own_skeleton {
        for name in ["skeleton_weight", "start_skeleton_weight"] {
            given.entry(name).or_insert(Value::from(0.0));
        }
    }
    let parameters: ::sparse::Parameters =
        serde_json::from_value(Value::Object(given)).map_err(|error| refuse(&error))?;
    parameters.check().map_err(|error| refuse(&error))?;
    Ok(parameters)
}

/// Reconstruct a session
///
/// Full-body motion from the session's control points, the body of a person from what its cameras saw, or poses of a body
/// by inverse kinematics, from measured points and silhouettes. Answers at once (202) with the run; watch it at
/// `/v1/runs/{run_id}/events`.
#[utoipa::path(
    post, path = "/v1/sessions/{session_id}/runs", tag = "runs", request_body = NewReconstruction,
    params(
        ("session_id" = Uuid, Path,),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn reconstruction(
    State(app): State<App>,
    Writer(caller): Writer,
    Path(session_id): Path<Uuid>,
    Posted { body, request }: Posted<NewReconstruction>,
) -> Result<Answer> {
    let project_id = caller.project_id;
    // What is wrong with the request is said before anything is looked up.
    if body.motion_database.is_some() {
        body.resolve(true)?;
        body.check_points()?;
    }
    let bvh_metres_per_unit =
        body.bvh_metres_per_unit.unwrap_or(formats::BvhOptions::default().metres_per_unit);
    if !(1e-6..=1e3).contains(&bvh_metres_per_unit) {
        return Err(Error::Unprocessable(format!(
            "bvh_metres_per_unit is {bvh_metres_per_unit}, expected 0.000001 to 1000"
        )));
    }
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    let session = lookup::session(&mut tx, project_id, session_id, Lock::Share).await?;
    let files = inputs(&mut tx, session_id).await?;
    let is_inverse_kinematics = body.is_inverse_kinematics()?;
    if is_inverse_kinematics || body.is_for_cameras(&files)? {
        let run_id = if is_inverse_kinematics {
            let asked = body.inverse_kinematics(&files)?;
            asked.start_solving(&mut tx, project_id, &session, files).await?
        } else {
            body.multi_view()?.start(&mut tx, project_id, &session, files).await?
        };
        let run = runs::find(&mut tx, project_id, run_id).await?;
        let answer = Answer::accepted(format!("/v1/runs/{run_id}"), &run)?;
        return request.commit(tx, project_id, answer).await;
    }
    body.for_cameras().check_absent()?;
    let Some(which) = &body.motion_database else {
        return Err(Error::Unprocessable("motion_database is missing: name the one to learn from".into()));
    };
    let database = lookup::motion_database(&mut tx, project_id, which, Latest::Ready, Lock::Share).await?;
    let parameters = body.resolve(files.iter().any(|file| file.role == FileRole::Skeleton))?;
    let mut motion_database = database.ready()?;
    if parameters.method == ::sparse::Method::Gplvm {
        motion_database.gplvm = Some(contents::gplvm(&mut tx, &database).await?);
    }
    let plan = PlanSparse {
        session_id,
        session_name: session.name,
        motion_database,
        files,
        points: body.points,
        mapping: body.mapping,
        marker_set: Some(body.marker_set.unwrap_or_else(|| "auto".to_owned())),
        marker_map: body.marker_map,
        marker_prefix: body.marker_prefix,
        up: body.up,
        bvh_metres_per_unit,
        parameters,
    };
    if !plan.files.iter().any(|file| file.role == FileRole::ControlPoints) {
        return Err(Error::Unprocessable(
            "the session has no control points; upload a .csv, .trc or .c3d file first".into(),
        ));
    }
    let run_id = start(&mut tx, project_id, sparse::RUN_KIND, Some(session_id), &plan).await?;
    builds::uses(&mut tx, run_id, Some(database.id)).await?;
    let run = runs::find(&mut tx, project_id, run_id).await?;
    let answer = Answer::accepted(format!("/v1/runs/{run_id}"), &run)?;
    request.commit(tx, project_id, answer).await
}

/// The run and its first job, which is given what the run shows as its parameters.
pub(super) async fn start<J: Job>(
    db: &mut PgConnection,
    project_id: Uuid,
    kind: &str,
    session_id: Option<Uuid>,
    first_job: &J,
) -> Result<Uuid> {
    let parameters = serde_json::to_value(first_job)?;
    let run = NewRun { project_id: ProjectId(project_id), kind, session_id, parameters };
    let run_id = queue::enqueue_run(db, &run).await?;
    queue::enqueue(db, &NewJob::new(run_id, first_job)?).await?;
    Ok(run_id.0)
}

/// The files of a session or motion database, as jobs name them.
pub(super) async fn inputs(db: &mut PgConnection, owner: Uuid) -> Result<Vec<InputFile>> {
    files::of_owner(db, owner)
        .await?
        .into_iter()
        .map(|file| {
            Ok(InputFile {
                name: file.name,
                role: file.role,
                store_key: file.store_key,
                bytes: u64::try_from(file.bytes).map_err(|e| Error::Internal(e.to_string()))?,
                blake3: file.blake3,
            })
        })
        .collect()
}
