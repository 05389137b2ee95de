use axum::{Json, http::HeaderMap, response::Response};
use queue::{Artefact, RunId};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::download::{self, Object};
use crate::{
    App,
    access::{Access, Reader},
    error::{Error, Result},
    extract::Path,
    runs::run,
};

/// A file that a run has made.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ResultFile {
    /// name
    #[schema(example = "motion.bvh")]
    name: String,
    /// media type
    media_type: String,
    /// size, bytes
    bytes: i64,
    /// BLAKE3 of the content, hexadecimal; also its ETag
    blake3: String,
    /// where to download it
    #[schema(example = "/v1/runs/…/results/motion.bvh")]
    url: String,
}

async fn find(app: &App, project_id: Uuid, run_id: Uuid) -> Result<Vec<Artefact>> {
    let mut db = app.db.acquire().await?;
    run::find(&mut db, project_id, run_id).await?;
    Ok(queue::run_results(&mut db, RunId(run_id)).await?)
}

/// List a run's results
///
/// What the run has written: which files depends on its kind (docs/api.md). They appear when the run has succeeded; silhouettes
/// appear even if it fails.
#[utoipa::path(
    get, path = "/v1/runs/{run_id}/results", tag = "runs",
    params(("run_id" = Uuid, Path,)), responses((status = 200, body = Vec<ResultFile>)),
)]
pub(super) async fn list(
    Reader(Access { app, caller }): Reader,
    Path(run_id): Path<Uuid>,
) -> Result<Json<Vec<ResultFile>>> {
    let results = find(&app, caller.project_id, run_id).await?;
    let view = |artefact: Artefact| ResultFile {
        url: format!("/v1/runs/{run_id}/results/{}", artefact.name),
        name: artefact.name,
        media_type: artefact.media_type,
        bytes: artefact.bytes,
        blake3: artefact.blake3,
    };
    Ok(Json(results.into_iter().map(view).collect()))
}

/// Download a result
///
/// `ETag` is the file's BLAKE3; a single `Range` is honoured.
#[utoipa::path(
    get, path = "/v1/runs/{run_id}/results/{name}", tag = "runs",
    params(("run_id" = Uuid, Path,), ("name" = String, Path, example = "motion.bvh")),
    responses((status = 200, content_type = "application/octet-stream"), (status = 206), (status = 304)),
)]
pub(super) async fn get(
    Reader(Access { app, caller }): Reader,
    Path((run_id, name)): Path<(Uuid, String)>,
    headers: HeaderMap,
) -> Result<Response> {
    let results = find(&app, caller.project_id, run_id).await?;
    let result =
        results.iter().find(|r| r.name == name).ok_or_else(|| Error::not_found_in("run", "result", &name))?;
    let object = Object {
        name: &result.name,
        store_key: &result.store_key,
        bytes: result.bytes,
        blake3: &result.blake3,
        media_type: &result.media_type,
    };
    download::send(&app, &headers, &object).await
}
