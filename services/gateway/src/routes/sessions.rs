use axum::{Json, http::StatusCode};
use serde::Deserialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::{
    access::{Access, Reader, Writer},
    answer::Answer,
    error::{Error, Result},
    extract::{Path, Posted, Query},
    lock::Lock,
    names,
    page::{Page, PageQuery},
    sessions::{self, Session},
    upload::uninterrupted,
};

/// Most tags of a session.
const MAX_TAGS: usize = 32;

/// A session to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewSession {
    /// display name; 1 to 200 characters
    #[schema(example = "walk, take 3")]
    name: String,
    /// words to find it by; at most 32
    #[serde(default)]
    #[schema(value_type = Option<Vec<String>>)]
    tags: Vec<String>,
}

/// Make a session
#[utoipa::path(
    post, path = "/v1/sessions", tag = "sessions", request_body = NewSession,
    params(("Idempotency-Key" = Option<String>, Header, description = "the same key gives the same answer for a day")),
    responses((status = 201, body = Session, headers(("Location" = String, description = "the session")))),
)]
pub(super) async fn create(
    Writer(Access { app, caller }): Writer,
    Posted { body, request }: Posted<NewSession>,
) -> Result<Answer> {
    names::check_line("name", &body.name)?;
    if body.tags.len() > MAX_TAGS {
        return Err(Error::Unprocessable(format!(
            "there are {} tags, expected at most {MAX_TAGS}",
            body.tags.len()
        )));
    }
    for (number, tag) in body.tags.iter().enumerate() {
        names::check_line(&format!("tags[{number}]"), tag)?;
    }
    let mut tx = app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, caller.project_id).await? {
        return Ok(answer);
    }
    let session = sessions::insert(&mut tx, caller.project_id, &body.name, &body.tags).await?;
    let answer = Answer::created(format!("/v1/sessions/{}", session.id), &session)?;
    request.commit(tx, caller.project_id, answer).await
}

/// List sessions
///
/// Newest first.
#[utoipa::path(
    get, path = "/v1/sessions", tag = "sessions", params(PageQuery),
    responses((status = 200, body = Page<Session>)),
)]
pub(super) async fn list(
    Reader(Access { app, caller }): Reader,
    Query(page): Query<PageQuery>,
) -> Result<Json<Page<Session>>> {
    page.select(&app.db, sessions::SELECT_BY_PROJECT, caller.project_id).await
}

/// Show a session
#[utoipa::path(
    get, path = "/v1/sessions/{session_id}", tag = "sessions",
    params(("session_id" = Uuid, Path,)), responses((status = 200, body = Session)),
)]
pub(super) async fn show(
    Reader(Access { app, caller }): Reader,
    Path(id): Path<Uuid>,
) -> Result<Json<Session>> {
    let mut db = app.db.acquire().await?;
    Ok(Json(sessions::find(&mut db, caller.project_id, id, Lock::None).await?))
}

/// Delete a session
///
/// With its files, runs and their results. Refused (409) while a run of it is under way: cancel that first.
#[utoipa::path(
    delete, path = "/v1/sessions/{session_id}", tag = "sessions",
    params(("session_id" = Uuid, Path,)), responses((status = 204)),
)]
pub(super) async fn delete(
    Writer(Access { app, caller }): Writer,
    Path(id): Path<Uuid>,
) -> Result<StatusCode> {
    uninterrupted(async move {
        let mut tx = app.db.begin().await?;
        sessions::find(&mut tx, caller.project_id, id, Lock::Update).await?;
        let active = sessions::count_active_runs(&mut tx, id).await?;
        if active > 0 {
            return Err(Error::Conflict(match active {
                1 => "a run of this session is under way; cancel it first".to_owned(),
                _ => format!("{active} runs of this session are under way; cancel them first"),
            }));
        }
        let runs = sessions::delete(&mut tx, id).await?;
        tx.commit().await?;
        // nothing names these objects any more
        app.store.remove_all(&store::key::session_prefix(caller.project_id, id)).await?;
        for run in runs {
            app.store.remove_all(&store::key::run_prefix(run.0)).await?;
        }
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}
