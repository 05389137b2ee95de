//! Body models: made, shown, deleted. `shipped` is always there.

use axum::{Json, extract::State, http::StatusCode};
use body::shipped;
use chrono::{DateTime, Utc};
use jobs::body_model::{BodyModelFile, SHIPPED};
use queue::RunId;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::lookup::{self, Latest, Lock};
use crate::{
    App,
    access::{Reader, Writer},
    answer::Answer,
    error::{Error, Result},
    extract::{Path, Posted, Query},
    names,
    page::{Item, Page, PageQuery},
    upload::uninterrupted,
};

/// A body model: one version of one name.
#[derive(Debug, Clone, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct BodyModel {
    /// id; all zeros for the shipped one
    pub id: Uuid,
    /// name in the project, or `shipped`
    #[schema(example = "athletes")]
    pub name: String,
    /// version of that name, from 1
    #[schema(example = 1)]
    pub version: i32,
    /// `open` (collects files), `building`, `ready`, or `failed` (collects files again)
    #[schema(example = "ready")]
    pub state: String,
    /// the run that builds or built it
    pub build_run_id: Option<Uuid>,
    /// size of its file, bytes
    pub bytes: Option<i64>,
    /// BLAKE3 of its file, hexadecimal
    pub blake3: Option<String>,
    /// vertices of its mesh
    pub num_vertices: Option<i32>,
    /// principal components
    pub num_components: Option<i32>,
    /// what it was learned from and how well: scans, variance kept by the first 1, 2, … components, warnings
    pub contents: Option<Value>,
    /// when it was made; null for the shipped one
    pub created_at: Option<DateTime<Utc>>,
    /// when it became ready
    pub ready_at: Option<DateTime<Utc>>,
    #[serde(skip)]
    pub store_key: Option<String>,
}

impl Item for BodyModel {
    fn id(&self) -> Uuid {
        self.id
    }
}

impl BodyModel {
    fn is_shipped(&self) -> bool {
        self.id.is_nil()
    }

    /// As jobs name it.
    ///
    /// # Errors
    /// 409 with its state, if it is not ready.
    pub fn ready(&self) -> Result<BodyModelFile> {
        match &self.blake3 {
            Some(blake3) => Ok(BodyModelFile {
                id: self.id,
                name: self.name.clone(),
                version: self.version,
                store_key: self.store_key.clone(),
                blake3: blake3.clone(),
            }),
            None => Err(Error::Conflict(format!(
                "body model {}@{} is {}, expected ready{}",
                self.name,
                self.version,
                self.state,
                match self.state.as_str() {
                    "open" => ": upload scans to it and build it",
                    "building" => ": wait for its build",
                    _ => ": see the error of its build",
                }
            ))),
        }
    }
}

/// The model that comes with the program.
fn shipped_row() -> BodyModel {
    let shipped = shipped();
    let model = &shipped.model;
    let count = |n: usize| i32::try_from(n).ok();
    BodyModel {
        id: Uuid::nil(),
        name: SHIPPED.to_owned(),
        version: 1,
        state: "ready".to_owned(),
        build_run_id: None,
        bytes: i64::try_from(shipped.bytes.len()).ok(),
        blake3: Some(shipped.blake3.clone()),
        num_vertices: count(model.num_vertices()),
        num_components: count(model.num_components()),
        contents: Some(json!({
            "description": model.description(),
            "variance_kept": model.variance_kept(),
            "num_joints": model.rig().num_joints(),
            "num_dofs": model.rig().num_dofs(),
            "num_faces": model.faces().len(),
        })),
        created_at: None,
        ready_at: None,
        store_key: None,
    }
}

macro_rules! select_body_models {
    ($rest:literal) => {
        concat!(
            "SELECT m.id, m.name, m.version,
                    CASE WHEN m.store_key IS NOT NULL THEN 'ready'
                         WHEN r.id IS NULL THEN 'open'
                         WHEN r.state IN ('failed', 'cancelled') THEN 'failed'
                         ELSE 'building' END AS state,
                    m.build_run_id, m.bytes, m.blake3, m.num_vertices, m.num_components, m.contents, m.created_at, m.ready_at,
                    m.store_key
             FROM body_models m LEFT JOIN runs r ON r.id = m.build_run_id ",
            $rest
        )
    };
}

/// The body model that `which` names: an id, `name` (its latest version), `name@version`, or `shipped`.
pub(super) async fn find(
    db: &mut PgConnection,
    project_id: Uuid,
    which: &str,
    latest: Latest,
    lock: Lock,
) -> Result<BodyModel> {
    if which == SHIPPED || which == "shipped@1" {
        return Ok(shipped_row());
    }
    if Uuid::try_parse(which).is_ok_and(|id| id.is_nil()) {
        return Ok(shipped_row());
    }
    let id: Option<Uuid> = lookup::version_id!(db, "body_models", "body model", project_id, which, latest);
    let query = match lock {
        Lock::None => select_body_models!("WHERE m.id = $1 AND m.project_id = $2"),
        Lock::Share => select_body_models!("WHERE m.id = $1 AND m.project_id = $2 FOR SHARE OF m"),
        Lock::Update => select_body_models!("WHERE m.id = $1 AND m.project_id = $2 FOR UPDATE OF m"),
    };
    sqlx::query_as(query)
        .bind(id)
        .bind(project_id)
        .fetch_optional(db)
        .await?
        .ok_or_else(|| Error::not_found("body model", which))
}

/// Records the model that a run needs: until the run has ended, it is not deleted.
pub(super) async fn uses(db: &mut PgConnection, run_id: Uuid, model: Option<Uuid>) -> Result<()> {
    sqlx::query("UPDATE runs SET body_model_id = $2 WHERE id = $1")
        .bind(run_id)
        .bind(model)
        .execute(db)
        .await?;
    Ok(())
}

/// A body model to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewBodyModel {
    /// 1 to 64 letters, digits, `.`, `_` or `-`; a name that is there gets another version
    #[schema(example = "athletes")]
    name: String,
}

/// Make a body model
///
/// It is `open` then: upload registered scans to it, and have it built.
#[utoipa::path(
    post, path = "/v1/body-models", tag = "body models", request_body = NewBodyModel,
    params(("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day")),
    responses((status = 201, body = BodyModel, headers(("Location" = String, description = "the body model")))),
)]
pub(super) async fn create(
    State(app): State<App>,
    Writer(caller): Writer,
    Posted { body, request }: Posted<NewBodyModel>,
) -> Result<Answer> {
    names::check_versioned_name("body model", &body.name)?;
    if body.name == SHIPPED {
        return Err(Error::Unprocessable(
            "body model shipped comes with the program; choose another name".into(),
        ));
    }
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, caller.project_id).await? {
        return Ok(answer);
    }
    // versions are counted one at a time
    sqlx::query("SELECT 1 FROM projects WHERE id = $1 FOR NO KEY UPDATE")
        .bind(caller.project_id)
        .execute(&mut *tx)
        .await?;
    let id = Uuid::now_v7();
    sqlx::query(
        "INSERT INTO body_models (id, project_id, name, version)
         SELECT $1, $2, $3, coalesce(max(version), 0) + 1 FROM body_models WHERE project_id = $2 AND name = $3",
    )
    .bind(id)
    .bind(caller.project_id)
    .bind(&body.name)
    .execute(&mut *tx)
    .await?;
    let model = find(&mut tx, caller.project_id, &id.to_string(), Latest::Any, Lock::None).await?;
    let answer = Answer::created(format!("/v1/body-models/{id}"), &model)?;
    request.commit(tx, caller.project_id, answer).await
}

/// List body models
///
/// All versions, newest first; the last is the shipped one.
#[utoipa::path(
    get, path = "/v1/body-models", tag = "body models", params(PageQuery),
    responses((status = 200, body = Page<BodyModel>)),
)]
pub(super) async fn list(
    State(app): State<App>,
    Reader(caller): Reader,
    Query(page): Query<PageQuery>,
) -> Result<Json<Page<BodyModel>>> {
    let query = select_body_models!("WHERE m.project_id = $1 AND m.id < $2 ORDER BY m.id DESC LIMIT $3");
    page.ending_with(&app.db, query, caller.project_id, Some(shipped_row())).await
}

/// Show a body model
#[utoipa::path(
    get, path = "/v1/body-models/{body_model}", tag = "body models",
    params(("body_model" = String, Path, description = "id, name (its latest version), name@version or shipped")),
    responses((status = 200, body = BodyModel)),
)]
pub(super) async fn show(
    State(app): State<App>,
    Reader(caller): Reader,
    Path(which): Path<String>,
) -> Result<Json<BodyModel>> {
    let mut db = app.db.acquire().await?;
    Ok(Json(find(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?))
}

/// Delete a body model
///
/// With the scans that it was built from. Refused (409, with who it is) while it is being built or a run uses it. What
/// finished runs made with it stays.
#[utoipa::path(
    delete, path = "/v1/body-models/{body_model}", tag = "body models",
    params(("body_model" = String, Path, description = "id or name@version")),
    responses((status = 204)),
)]
pub(super) async fn delete(
    State(app): State<App>,
    Writer(caller): Writer,
    Path(which): Path<String>,
) -> Result<StatusCode> {
    uninterrupted(async move {
        let mut tx = app.db.begin().await?;
        let model = find(&mut tx, caller.project_id, &which, Latest::Any, Lock::Update).await?;
        if model.is_shipped() {
            return Err(Error::Conflict("body model shipped comes with the program and can't be deleted".into()));
        }
        check_unused(&mut tx, &model).await?;
        sqlx::query("DELETE FROM body_models WHERE id = $1").bind(model.id).execute(&mut *tx).await?;
        let builds: Vec<RunId> = sqlx::query_scalar(
            "DELETE FROM runs
             WHERE kind = 'body-model' AND project_id = $1 AND parameters->'body_model'->>'id' = $2 RETURNING id",
        )
        .bind(caller.project_id)
        .bind(model.id.to_string())
        .fetch_all(&mut *tx)
        .await?;
        tx.commit().await?;
        app.store.remove_all(&store::key::body_model_prefix(model.id)).await?;
        for run in builds {
            app.store.remove_all(&store::key::run_prefix(run.0)).await?;
        }
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}

/// Refuses to go on while somebody needs a model.
async fn check_unused(db: &mut PgConnection, model: &BodyModel) -> Result<()> {
    let users: Vec<Uuid> = sqlx::query_scalar(
        "SELECT id FROM runs WHERE (body_model_id = $1 OR id = $2) AND finished_at IS NULL ORDER BY id LIMIT 5",
    )
    .bind(model.id)
    .bind(model.build_run_id)
    .fetch_all(db)
    .await?;
    if users.is_empty() {
        return Ok(());
    }
    let users: Vec<String> = users.iter().map(|run| format!("run {run}")).collect();
    Err(Error::Conflict(format!(
        "body model {}@{} is in use by {}; cancel that first",
        model.name,
        model.version,
        users.join(", ")
    )))
}
