use axum::{Json, extract::State, http::StatusCode};
use queue::RunId;
use serde::Deserialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::lookup::{self, Latest, Lock, MotionDatabase, select_motion_databases};
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
}

/// Make a motion database
///
/// It is `open` then: upload files to it, and have it built.
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
    names::check_database_name(&body.name)?;
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
        "INSERT INTO motion_databases (id, project_id, name, version)
         SELECT $1, $2, $3, coalesce(max(version), 0) + 1 FROM motion_databases WHERE project_id = $2 AND name = $3",
    )
    .bind(id)
    .bind(caller.project_id)
    .bind(&body.name)
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
    let rows: Vec<MotionDatabase> = sqlx::query_as(select_motion_databases!(
        "WHERE d.project_id = $1 AND d.id < $2 ORDER BY d.id DESC LIMIT $3"
    ))
    .bind(caller.project_id)
    .bind(page.before()?)
    .bind(page.fetch()?)
    .fetch_all(&app.db)
    .await?;
    Ok(Json(Page::of(&page, rows, |row| row.id, |row| row)?))
}

/// Show a motion database
#[utoipa::path(
    get, path = "/v1/motion-databases/{motion_database}", tag = "motion databases",
    params(("motion_database" = String, Path, description = "id, name (its latest version) or name@version")),
    responses((status = 200, body = MotionDatabase)),
)]
pub(super) async fn show(
    State(app): State<App>,
    Reader(caller): Reader,
    Path(which): Path<String>,
) -> Result<Json<MotionDatabase>> {
    let mut db = app.db.acquire().await?;
    Ok(Json(lookup::motion_database(&mut db, caller.project_id, &which, Latest::Any, Lock::None).await?))
}

/// Delete a motion database
///
/// With the files that it was built from. Refused (409) while it is being built or a run uses it; what finished runs
/// made with it stays.
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
        let active: i64 = sqlx::query_scalar(
            "SELECT count(*) FROM runs WHERE (motion_database_id = $1 OR id = $2) AND finished_at IS NULL",
        )
        .bind(database.id)
        .bind(database.build_run_id)
        .fetch_one(&mut *tx)
        .await?;
        if active > 0 {
            return Err(Error::Conflict(format!(
                "{active} runs build or use motion database {}@{}; cancel them first",
                database.name, database.version
            )));
        }
        sqlx::query("DELETE FROM motion_databases WHERE id = $1").bind(database.id).execute(&mut *tx).await?;
        // its builds, failed ones included, are of no use without it
        let builds: Vec<RunId> = sqlx::query_scalar(
            "DELETE FROM runs
             WHERE kind = 'motion-database' AND project_id = $1 AND parameters->'motion_database'->>'id' = $2
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
