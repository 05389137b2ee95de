use axum::{Json, extract::State, http::StatusCode};
use queue::RunId;
use serde::Deserialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    contents::{self, Clip, MotionDatabaseDetails},
    lookup::{self, Latest, Lock, MotionDatabase, select_motion_databases},
};
use crate::{
    App,
    access::{Reader, Writer},
    answer::Answer,
    error::{Error, Result},
    extract::{Path, Posted, Query},
    names,
    page::{Page, PageQuery},
    upload::uninterrupted,
};

/// A motion database to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewMotionDatabase {
    /// 1 to 64 letters, digits, `.`, `_` or `-`; a name that is there gets another version
    #[schema(example = "walks")]
    name: String,
    /// a motion database that is ready, whose clips the new one begins with: id, `name` (its latest version that is
    /// ready) or `name@version`
    #[schema(example = "walks@1")]
    base: Option<String>,
    /// clips of `base` to be left out, with all that was made from them
    #[serde(default)]
    #[schema(example = json!(["16_15"]))]
    without: Vec<String>,
}

/// Most clips that one version leaves out.
const MAX_WITHOUT: usize = 10_000;

impl NewMotionDatabase {
    fn check(&self) -> Result<()> {
        names::check_versioned_name("motion database", &self.name)?;
        if self.base.is_none() && !self.without.is_empty() {
            return Err(Error::Unprocessable("without names clips of base, and there is no base".into()));
        }
        if self.without.len() > MAX_WITHOUT {
            return Err(Error::Unprocessable(format!(
                "without has {} clips, expected at most {MAX_WITHOUT}",
                self.without.len()
            )));
        }
        Ok(())
    }
}

/// Make a motion database
///
/// It is `open` then: upload files to it, and have it built. With a `base` it is that database with clips added, or
/// left out; what there is stays as it is.
#[utoipa::path(
    post, path = "/v1/motion-databases", tag = "motion databases", request_body = NewMotionDatabase,
    params(("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day")),
    responses((status = 201, body = MotionDatabase, headers(("Location" = String, description = "the motion database")))),
)]
pub(super) async fn create(
    State(app): State<App>,
    Writer(caller): Writer,
    Posted { body, request }: Posted<NewMotionDatabase>,
) -> Result<Answer> {
    body.check()?;
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, caller.project_id).await? {
        return Ok(answer);
    }
    // versions are counted one at a time
    sqlx::query("SELECT 1 FROM projects WHERE id = $1 FOR NO KEY UPDATE")
        .bind(caller.project_id)
        .execute(&mut *tx)
        .await?;
    let base = match &body.base {
        None => None,
        Some(base) => {
            let base =
                lookup::motion_database(&mut tx, caller.project_id, base, Latest::Ready, Lock::Share).await?;
            base.ready()?;
            contents::check_clips(&mut tx, &base, &body.without).await?;
            Some(base.id)
        }
    };
    let id = Uuid::now_v7();
    sqlx::query(
        "INSERT INTO motion_databases (id, project_id, name, version, base_id, without)
         SELECT $1, $2, $3, coalesce(max(version), 0) + 1, $4, $5
         FROM motion_databases WHERE project_id = $2 AND name = $3",
    )
    .bind(id)
    .bind(caller.project_id)
    .bind(&body.name)
    .bind(base)
    .bind(&body.without)
    .execute(&mut *tx)
    .await?;
    let database =
        lookup::motion_database(&mut tx, caller.project_id, &id.to_string(), Latest::Any, Lock::None).await?;
    let answer = Answer::created(format!("/v1/motion-databases/{id}"), &database)?;
    request.commit(tx, caller.project_id, answer).await
}

/// List motion databases
///
/// All versions, newest first.
#[utoipa::path(
    get, path = "/v1/motion-databases", tag = "motion databases", params(PageQuery),
    responses((status = 200, body = Page<MotionDatabase>)),
)]
pub(super) async fn list(
    State(app): State<App>,
    Reader(caller): Reader,
    Query(page): Query<PageQuery>,
) -> Result<Json<Page<MotionDatabase>>> {
    let query = select_motion_databases!("WHERE d.project_id = $1 AND d.id < $2 ORDER BY d.id DESC LIMIT $3");
    page.of(&app.db, query, caller.project_id).await
}

/// Show a motion database
///
/// With what is in it, by action and subject, and who uses it.
#[utoipa::path(
    get, path = "/v1/motion-databases/{motion_database}", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name (its latest version) or name@version")),
    responses((status = 200, body = MotionDatabaseDetails)),
)]
pub(super) async fn show(
    State(app): State<App>,
    Reader(caller): Reader,
    Path(which): Path<String>,
) -> Result<Json<MotionDatabaseDetails>> {
    let mut db = app.db.acquire().await?;
    let database =
        lookup::motion_database(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    Ok(Json(contents::details(&mut db, database).await?))
}

/// List the clips of a motion database
///
/// In its order; none until it is ready.
#[utoipa::path(
    get, path = "/v1/motion-databases/{motion_database}/clips", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name (its latest version) or name@version")),
    responses((status = 200, body = Vec<Clip>)),
)]
pub(super) async fn clips(
    State(app): State<App>,
    Reader(caller): Reader,
    Path(which): Path<String>,
) -> Result<Json<Vec<Clip>>> {
    let mut db = app.db.acquire().await?;
    let database =
        lookup::motion_database(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?;
    Ok(Json(contents::clips(&mut db, database.id).await?))
}

/// Delete a motion database
///
/// With the files that it was built from and the models trained on it. Refused (409, with who it is) while it is being
/// built, a run uses it, or a version that is not built yet is to be made from it. What finished runs made with it, and
/// versions that were made from it, stay.
#[utoipa::path(
    delete, path = "/v1/motion-databases/{motion_database}", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id or name@version")),
    responses((status = 204)),
)]
pub(super) async fn delete(
    State(app): State<App>,
    Writer(caller): Writer,
    Path(which): Path<String>,
) -> Result<StatusCode> {
    uninterrupted(async move {
        let mut tx = app.db.begin().await?;
        let database =
            lookup::motion_database(&mut tx, caller.project_id, &which, Latest::Any, Lock::Update).await?;
        contents::check_unused(&mut tx, &database).await?;
        sqlx::query("DELETE FROM motion_databases WHERE id = $1").bind(database.id).execute(&mut *tx).await?;
        // its builds and trainings, failed ones included, are of no use without it
        let builds: Vec<RunId> = sqlx::query_scalar(
            "DELETE FROM runs
             WHERE kind IN ('motion-database', 'training') AND project_id = $1 AND parameters->'motion_database'->>'id' = $2
             RETURNING id",
        )
        .bind(caller.project_id)
        .bind(database.id.to_string())
        .fetch_all(&mut *tx)
        .await?;
        tx.commit().await?;
        app.store.remove_all(&store::key::motion_database_prefix(database.id)).await?;
        for run in builds {
            app.store.remove_all(&store::key::run_prefix(run.0)).await?;
        }
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}
