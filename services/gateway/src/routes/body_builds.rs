//! Building body models.

use axum::extract::State;
use jobs::body_model::{self, BodyModelName, BuildBodyModel};
use serde::Deserialize;
use utoipa::ToSchema;

use super::{
    body_models::find,
    lookup::{Latest, Lock},
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

/// How a body model is to be built; everything may be left out.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewBodyModelBuild {
    /// most principal components, 1 to 20; 20 when left out
    #[schema(example = 20)]
    components: Option<usize>,
    /// metres of one unit of the scans; 1 when left out, for arrays whichever of 1, 0.01, 0.001 and 0.0001 makes people
    #[schema(example = 0.001)]
    metres_per_unit: Option<f64>,
}

/// Build a body model
///
/// From the scans uploaded to it, which are fixed from then on. Answers at once (202) with the run.
#[utoipa::path(
    post, path = "/v1/body-models/{body_model}/build", tag = "body models", request_body = NewBodyModelBuild,
    params(
        ("body_model" = String, Path, description = "id, name or name@version"),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn build(
    State(app): State<App>,
    Writer(caller): Writer,
    Path(which): Path<String>,
    Posted { body, request }: Posted<NewBodyModelBuild>,
) -> Result<Answer> {
    let project_id = caller.project_id;
    let components = body.components.unwrap_or(body::MAX_COMPONENTS);
    if !(1..=body::MAX_COMPONENTS).contains(&components) {
        return Err(Error::Unprocessable(format!(
            "components is {components}, expected 1 to {}",
            body::MAX_COMPONENTS
        )));
    }
    if let Some(metres) = body.metres_per_unit.filter(|metres| !(1e-6..=1e3).contains(metres)) {
        return Err(Error::Unprocessable(format!("metres_per_unit is {metres}, expected 0.000001 to 1000")));
    }
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    let model = find(&mut tx, project_id, &which, Latest::Any, Lock::Update).await?;
    if !matches!(model.state.as_str(), "open" | "failed") {
        return Err(Error::Conflict(format!(
            "body model {}@{} is {}; make a new version to build another",
            model.name, model.version, model.state
        )));
    }
    let files = inputs(&mut tx, model.id).await?;
    if files.is_empty() {
        return Err(Error::Unprocessable(format!(
            "body model {}@{} has no files; upload an archive of registered scans first",
            model.name, model.version
        )));
    }
    let payload = BuildBodyModel {
        body_model: BodyModelName { id: model.id, name: model.name, version: model.version },
        files,
        components,
        metres_per_unit: body.metres_per_unit,
    };
    let run_id = start(&mut tx, project_id, body_model::RUN_KIND, None, &payload).await?;
    sqlx::query("UPDATE body_models SET build_run_id = $2 WHERE id = $1")
        .bind(model.id)
        .bind(run_id)
        .execute(&mut *tx)
        .await?;
    let run = runs::find(&mut tx, project_id, run_id).await?;
    let answer = Answer::accepted(format!("/v1/runs/{run_id}"), &run)?;
    request.commit(tx, project_id, answer).await
}
