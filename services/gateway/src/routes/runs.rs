use axum::Json;
use queue::RunId;
use uuid::Uuid;

use crate::{
    access::{Access, Reader, Writer},
    answer::Answer,
    error::Result,
    extract::{NoFields, Path, Posted, Query},
    files,
    lock::Lock,
    page::{Page, PageQuery},
    runs::{Run, RunWithJobs, enqueue, request::NewSessionRun, run, session_run::OnSession},
    sessions,
};

/// Start a run on a session
///
/// Full-body motion from the session's control points (`sparse`), the body of a person and its motion from what its cameras
/// saw (`multi-view`), or poses of a body by inverse kinematics, from measured points and silhouettes
/// (`inverse-kinematics`). `kind` is what the session's files are for when it is left out, and required if they are for both
/// of the first two. Answers at once (202) with the run; watch it at `/v1/runs/{run_id}/events`.
#[utoipa::path(
    post, path = "/v1/sessions/{session_id}/runs", tag = "runs", request_body = NewSessionRun,
    params(
        ("session_id" = Uuid, Path,),
        ("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day"),
    ),
    responses((status = 202, body = Run, headers(("Location" = String, description = "the run")))),
)]
pub(super) async fn start(
    Writer(Access { app, caller }): Writer,
    Path(session_id): Path<Uuid>,
    Posted { body, request }: Posted<NewSessionRun>,
) -> Result<Answer> {
    let project_id = caller.project_id;
    // What is wrong with the request is said before anything is looked up.
    body.check()?;
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    let session = sessions::find(&mut tx, project_id, session_id, Lock::Share).await?;
    let files = files::inputs(&mut tx, session_id).await?;
    let run = body.plan(&mut tx, project_id, OnSession { session, files }).await?;
    let run_id = run.enqueue(&mut tx, project_id).await?;
    enqueue::accept(tx, &request, project_id, run_id).await
}

/// List runs
///
/// All of the project, newest first.
#[utoipa::path(
    get, path = "/v1/runs", tag = "runs", params(PageQuery), responses((status = 200, body = Page<Run>)),
)]
pub(super) async fn list(
    Reader(Access { app, caller }): Reader,
    Query(page): Query<PageQuery>,
) -> Result<Json<Page<Run>>> {
    page.select(&app.db, run::SELECT_BY_PROJECT, caller.project_id).await
}

/// List the runs of a session
///
/// Newest first.
#[utoipa::path(
    get, path = "/v1/sessions/{session_id}/runs", tag = "runs",
    params(("session_id" = Uuid, Path,), PageQuery), responses((status = 200, body = Page<Run>)),
)]
pub(super) async fn list_by_session(
    Reader(Access { app, caller }): Reader,
    Path(session_id): Path<Uuid>,
    Query(page): Query<PageQuery>,
) -> Result<Json<Page<Run>>> {
    let mut db = app.db.acquire().await?;
    sessions::find(&mut db, caller.project_id, session_id, Lock::None).await?;
    drop(db);
    page.select(&app.db, run::SELECT_BY_SESSION, session_id).await
}

/// Show a run
#[utoipa::path(
    get, path = "/v1/runs/{run_id}", tag = "runs",
    params(("run_id" = Uuid, Path,)), responses((status = 200, body = RunWithJobs)),
)]
pub(super) async fn show(
    Reader(Access { app, caller }): Reader,
    Path(run_id): Path<Uuid>,
) -> Result<Json<RunWithJobs>> {
    let mut db = app.db.acquire().await?;
    let run = run::find(&mut db, caller.project_id, run_id).await?;
    Ok(Json(run::with_jobs(&mut db, run).await?))
}

/// Cancel a run
///
/// Waiting jobs end at once, running ones within moments. A run that has ended stays as it is.
#[utoipa::path(
    post, path = "/v1/runs/{run_id}/cancel", tag = "runs",
    params(("run_id" = Uuid, Path,)), responses((status = 200, body = RunWithJobs)),
)]
pub(super) async fn cancel(
    Writer(Access { app, caller }): Writer,
    Path(run_id): Path<Uuid>,
    _: Posted<NoFields>,
) -> Result<Json<RunWithJobs>> {
    let mut tx = app.db.begin().await?;
    run::find(&mut tx, caller.project_id, run_id).await?;
    queue::cancel_run(&mut tx, RunId(run_id)).await?;
    let run = run::find(&mut tx, caller.project_id, run_id).await?;
    let run = run::with_jobs(&mut tx, run).await?;
    tx.commit().await?;
    Ok(Json(run))
}
