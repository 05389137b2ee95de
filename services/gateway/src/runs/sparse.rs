//! Runs on control points: full-body motion, learned from a motion database.

use ::sparse::{Method, Parameters};
use formats::FileRole;
use jobs::{
    PointChoice, bvh_centimetres,
    sparse::{self, PlanSparse},
};
use serde::Deserialize;
use serde_json::{Map, Value};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    enqueue::NewRun,
    markers::MarkerFields,
    session_run::{OnSession, SessionRun, Shared, shared},
    units::check_unit,
};
use crate::{
    error::{Error, Result},
    json,
    lock::Lock,
    page::Item,
    versioned::{self, Latest, MotionDatabase},
};

/// Full-body motion from control points.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SparseRun {
    /// the motion database to learn from: id, `name` (its latest version that is ready) or `name@version`
    #[schema(example = "walks")]
    motion_database: String,
    /// the axis of the file of points that points up: `x`, `y` or `z`; what the file says, else z (C3D) or y, when left out
    #[schema(value_type = Option<String>, example = "z")]
    up: Option<model::Axis>,
    /// metres of one unit of BVH files (their format has no unit); 0.01, centimetres, when left out
    #[schema(example = 0.01)]
    bvh_metres_per_unit: Option<f64>,
    /// `local-regression`, or to compare `nearest` (the nearest example), `lpca`, `lpcr` or `gplvm`; `local-regression` when
    /// left out
    #[schema(value_type = Option<String>, example = "local-regression")]
    method: Option<Method>,
    /// frames of history that the regression looks at
    #[schema(example = 2)]
    window: Option<u32>,
    /// neighbours that the regression learns from
    #[schema(example = 64)]
    neighbours: Option<u32>,
    /// further parameters of the method, by name
    #[serde(default)]
    #[schema(example = json!({"chunk_frames": 1200}))]
    parameters: Map<String, Value>,
    #[serde(flatten)]
    #[schema(inline)]
    markers: MarkerFields,
}

impl SessionRun for SparseRun {
    const KIND: &'static str = sparse::RUN_KIND;
    const FILES: Option<(FileRole, &'static str)> = Some((FileRole::ControlPoints, "control points"));
    const SHARED: &'static [Shared] = &[shared::<MarkerFields>];
    const REQUIRED: Option<(&'static str, &'static str)> =
        Some(("motion_database", "name the recordings to learn from (--database NAME in `marey run`)"));

    fn example() -> Value {
        serde_json::json!({
            "kind": "sparse",
            "motion_database": "walks",
            "points": ["left_wrist", "right_wrist", "left_ankle", "right_ankle"],
            "marker_set": "auto",
            "neighbours": 64,
            "parameters": {"chunk_frames": 1200},
        })
    }

    fn check(&self) -> Result<()> {
        self.resolve(true)?;
        self.markers.check()?;
        check_unit("bvh_metres_per_unit", self.bvh_metres_per_unit)
    }

    async fn plan(self, db: &mut PgConnection, project_id: Uuid, on: OnSession) -> Result<NewRun> {
        let which = &self.motion_database;
        let database: MotionDatabase =
            versioned::find(db, project_id, which, Latest::Ready, Lock::Share).await?;
        let parameters = self.resolve(on.has(FileRole::Skeleton))?;
        let mut motion_database = database.ready()?;
        if parameters.method == Method::Gplvm {
            motion_database.gplvm = Some(versioned::gplvm(db, &database).await?);
        }
        if !on.has(FileRole::ControlPoints) {
            return Err(Error::Unprocessable(format!(
                "the session has no control points; upload a {} file first",
                FileRole::ControlPoints.endings()
            )));
        }
        let session_id = on.session.id;
        let mut choice = PointChoice::from(self.markers);
        choice.marker_set.get_or_insert_with(|| "auto".to_owned());
        let plan = PlanSparse {
            inputs: on.inputs(self.up),
            motion_database,
            choice,
            bvh_metres_per_unit: self.bvh_metres_per_unit.unwrap_or_else(bvh_centimetres),
            parameters,
        };
        let run = NewRun::new(&plan)?;
        Ok(run.on_session(session_id).with_motion_database(Some(database.id())))
    }
}

impl SparseRun {
    /// All parameters of the method, those with a field of their own among them.
    fn resolve(&self, has_own_skeleton: bool) -> Result<Parameters> {
        let mut given = self.parameters.clone();
        given.retain(|_, value| !value.is_null());
        let named = [
            ("method", self.method.map(|method| method.name().into())),
            ("window", self.window.map(Value::from)),
            ("neighbours", self.neighbours.map(Value::from)),
        ];
        for (name, value) in named.clone() {
            if let Some(value) = value
                && given.insert(name.into(), value).is_some()
            {
                return Err(Error::Unprocessable(format!(
                    "{name} is given twice: here and as parameters.{name}"
                )));
            }
        }
        resolve_parameters(given, has_own_skeleton).map_err(|error| match error {
            // what was given as a field is not called a parameter
            Error::Unprocessable(what) => {
                let plain = what.strip_prefix("parameters.").unwrap_or(&what);
                let is_field = named.iter().any(|(name, value)| {
                    let rest = plain.strip_prefix(name);
                    value.is_some() && rest.is_some_and(|rest| rest.starts_with(' '))
                });
                Error::Unprocessable(if is_field { plain.to_owned() } else { what })
            }
            error => error,
        })
    }
}

/// All parameters of the method, those left out with their defaults. Without a skeleton of the performer's own the
/// database's is borrowed, and whose clips have one like it says nothing: they are not preferred.
pub(crate) fn resolve_parameters(
    mut given: Map<String, Value>,
    has_own_skeleton: bool,
) -> Result<Parameters> {
    let refuse = |error: &dyn std::fmt::Display| Error::Unprocessable(format!("parameters.{error}"));
    if !has_own_skeleton {
        for name in ["skeleton_weight", "start_skeleton_weight"] {
            given.entry(name).or_insert(Value::from(0.0));
        }
    }
    let parameters: Parameters = json::read_parameters(given)?;
    parameters.check().map_err(|error| refuse(&error))?;
    Ok(parameters)
}
