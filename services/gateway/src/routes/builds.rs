//! Building motion databases, and training models on them.

use axum::extract::State;
use jobs::motion_database::{self, MotionDatabaseName, PlanMotionDatabase, TrainGplvm};
use regression::gplvm::TrainingOptions;
use serde::Deserialize;
use serde_json::{Map, Value};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    contents::{self, Augment},
    lookup::{self, Latest, Lock, MotionDatabase},
    runs::{self, Run},
    start::{inputs, start},
};
use crate::{
    App,
    access::Writer,
    answer::Answer,
    error::{Error, Result},
    extract::{Path, Posted},
};

/// Most index files of one database.
const MAX_SHARDS: usize = 64;
/// Units of BVH files, metres.
const METRES_PER_UNIT: std::ops::RangeInclusive<f64> = 1e-6..=1e3;

/// How a motion database is to be built; everything may be left out.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewBuild {
    /// motion to be made from that of the files; nothing when left out, or what was made for `base`
    augment: Option<Augment>,
    /// into how many index files it is divided, 1 to 64, for databases too large for one machine; 1 when left out, or as
    /// many as `base` has
    #[schema(example = 1)]
    shards: Option<usize>,
    /// metres of one unit of BVH files (their format has no unit); 0.01, centimetres, when left out
    #[schema(example = 0.01)]
    bvh_metres_per_unit: Option<f64>,
}

impl NewBuild {
    fn check(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        if let Some(augment) = &self.augment {
            motion_database::Augment::from(augment.clone())
                .check()
                .map_err(|error| Error::Unprocessable(error.to_string()))?;
        }
        match (self.shards, self.bvh_metres_per_unit) {
            (Some(shards), _) if !(1..=MAX_SHARDS).contains(&shards) => {
                refuse(format!("shards is {shards}, expected 1 to {MAX_SHARDS}"))
            }
            (_, Some(metres)) if !METRES_PER_UNIT.contains(&metres) => {
                refuse(format!("bvh_metres_per_unit is {metres}, expected 0.000001 to 1000"))
            }
            _ => Ok(()),
        }
    }

    /// The augmentation of a version made from another is that of the other: a database is augmented as a whole.
    async fn augment(&self, db: &mut PgConnection, base: Option<&MotionDatabase>) -> Result<Augment> {
        let Some(base) = base else { return Ok(self.augment.clone().unwrap_or_default()) };
        let of_base = contents::augment(db, base.id).await?;
        match &self.augment {
            Some(asked) if *asked != of_base => Err(Error::Unprocessable(format!(
                "augment is not that of motion database {}@{}, which this one begins with; leave it out, or build a \
                 database of all files",
                base.name, base.version
            ))),
            _ => Ok(of_base),
        }
    }
}

/// Build a motion database
///
/// From the files uploaded to it, which are fixed from then on, and the clips of its base. Answers at once (202) with the
/// run.
#[utoipa::path(
    post, path = "/v1/motion-databases/{motion_database}/build", tag = "motion databases", request_body = NewBuild,
    params(
        ("motion_database" = String, Path, description = "id, name or name@version"),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn build(
    State(app): State<App>,
    Writer(caller): Writer,
    Path(which): Path<String>,
    Posted { body, request }: Posted<NewBuild>,
) -> Result<Answer> {
    let project_id = caller.project_id;
    body.check()?;
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    let database = lookup::motion_database(&mut tx, project_id, &which, Latest::Any, Lock::Update).await?;
    if !matches!(database.state.as_str(), "open" | "failed") {
        return Err(Error::Conflict(format!(
            "motion database {}@{} is {}; make a new version to build another",
            database.name, database.version, database.state
        )));
    }
    let payload = plan(&mut tx, project_id, &database, &body).await?;
    let run_id = start(&mut tx, project_id, motion_database::RUN_KIND, None, &payload).await?;
    uses(&mut tx, run_id, database.base_id).await?;
    sqlx::query("UPDATE motion_databases SET build_run_id = $2 WHERE id = $1")
        .bind(database.id)
        .bind(run_id)
        .execute(&mut *tx)
        .await?;
    let run = runs::find(&mut tx, project_id, run_id).await?;
    let answer = Answer::accepted(format!("/v1/runs/{run_id}"), &run)?;
    request.commit(tx, project_id, answer).await
}

/// Everything that decides what is built.
async fn plan(
    db: &mut PgConnection,
    project_id: Uuid,
    database: &MotionDatabase,
    body: &NewBuild,
) -> Result<PlanMotionDatabase> {
    let files = inputs(db, database.id).await?;
    let without: Vec<String> = sqlx::query_scalar("SELECT without FROM motion_databases WHERE id = $1")
        .bind(database.id)
        .fetch_one(&mut *db)
        .await?;
    if files.is_empty() && without.is_empty() {
        return Err(Error::Unprocessable(format!(
            "motion database {}@{} has no files; upload an archive of ASF and AMC or of BVH files first",
            database.name, database.version
        )));
    }
    let base = match database.base_id {
        None => None,
        Some(id) => {
            Some(lookup::motion_database(db, project_id, &id.to_string(), Latest::Any, Lock::Share).await?)
        }
    };
    let augment = body.augment(db, base.as_ref()).await?;
    let shards_of_base = base.as_ref().and_then(|base| base.num_shards).unwrap_or(1);
    Ok(PlanMotionDatabase {
        motion_database: MotionDatabaseName {
            id: database.id,
            name: database.name.clone(),
            version: database.version,
        },
        base: base.as_ref().map(MotionDatabase::ready).transpose()?,
        without,
        files,
        augment: augment.into(),
        shards: body.shards.unwrap_or(usize::try_from(shards_of_base).unwrap_or(1)),
        bvh_metres_per_unit: body
            .bvh_metres_per_unit
            .unwrap_or(formats::BvhOptions::default().metres_per_unit),
    })
}

/// A model to be trained.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewTraining {
    /// the method that needs the model: `gplvm`, the only one that needs any
    #[schema(example = "gplvm")]
    method: Option<String>,
    /// how it is trained, by name: `latent_dims`, `active`, `max_iterations`
    #[serde(default)]
    #[schema(example = json!({"latent_dims": 4}))]
    parameters: Map<String, Value>,
}

impl NewTraining {
    /// All parameters, those left out with their defaults.
    fn resolve(&self) -> Result<TrainingOptions> {
        let refuse = |error: &dyn std::fmt::Display| Error::Unprocessable(format!("parameters: {error}"));
        if let Some(method) = self.method.as_ref().filter(|method| *method != "gplvm") {
            return Err(Error::Unprocessable(format!(
                "method is {method:?}, expected \"gplvm\": no other needs a model"
            )));
        }
        let given = Value::Object(self.parameters.clone());
        let options: TrainingOptions = serde_json::from_value(given).map_err(|error| refuse(&error))?;
        options.check().map_err(|error| refuse(&error))?;
        Ok(options)
    }
}

/// Train a model on a motion database
///
/// For method `gplvm`. It is kept with this version of the database, in place of one that was trained before. Answers at
/// once (202) with the run.
#[utoipa::path(
    post, path = "/v1/motion-databases/{motion_database}/train", tag = "motion databases", request_body = NewTraining,
    params(
        ("motion_database" = String, Path, description = "id, name (its latest version that is ready) or name@version"),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn train(
    State(app): State<App>,
    Writer(caller): Writer,
    Path(which): Path<String>,
    Posted { body, request }: Posted<NewTraining>,
) -> Result<Answer> {
    let project_id = caller.project_id;
    let parameters = body.resolve()?;
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    let database = lookup::motion_database(&mut tx, project_id, &which, Latest::Ready, Lock::Share).await?;
    let payload = TrainGplvm { motion_database: database.ready()?, parameters };
    let run_id = start(&mut tx, project_id, motion_database::TRAINING_RUN_KIND, None, &payload).await?;
    uses(&mut tx, run_id, Some(database.id)).await?;
    let run = runs::find(&mut tx, project_id, run_id).await?;
    let answer = Answer::accepted(format!("/v1/runs/{run_id}"), &run)?;
    request.commit(tx, project_id, answer).await
}

/// Records the database that a run needs: until the run has ended, it is not deleted.
pub(super) async fn uses(db: &mut PgConnection, run_id: Uuid, database: Option<Uuid>) -> Result<()> {
    sqlx::query("UPDATE runs SET motion_database_id = $2 WHERE id = $1")
        .bind(run_id)
        .bind(database)
        .execute(db)
        .await?;
    Ok(())
}
