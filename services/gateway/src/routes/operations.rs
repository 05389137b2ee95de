//! For operators: probes and metrics. They need no key.

use axum::{
    Json,
    extract::State,
    http::header,
    response::{IntoResponse, Response},
};
use serde::Serialize;
use utoipa::ToSchema;

use crate::{
    App,
    error::{Error, Result},
    observe,
};

/// All is well.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Health {
    /// `ok`
    #[schema(example = "ok")]
    status: &'static str,
}

/// Liveness
#[utoipa::path(get, path = "/healthz", tag = "operations", security(()), responses((status = 200, body = Health)))]
pub(super) async fn healthz() -> Json<Health> {
    Json(Health { status: "ok" })
}

/// Readiness
///
/// Whether the database and the object store answer; 503 when not.
#[utoipa::path(get, path = "/readyz", tag = "operations", security(()), responses((status = 200, body = Health)))]
pub(super) async fn readyz(State(app): State<App>) -> Result<Json<Health>> {
    sqlx::query("SELECT 1").execute(&app.db).await.map_err(|_| Error::Unavailable("the database"))?;
    // any answer will do, also that there is no such object
    match app.store.size(&store::key::motion_database_prefix(uuid::Uuid::nil())).await {
        Ok(_) | Err(store::Error::NotFound { .. }) => Ok(Json(Health { status: "ok" })),
        Err(_) => Err(Error::Unavailable("the object store")),
    }
}

/// Metrics
///
/// In Prometheus' text format: queue depth by kind and state, runs by state, requests by route and status.
#[utoipa::path(
    get, path = "/metrics", tag = "operations", security(()),
    responses((status = 200, body = String, content_type = "text/plain")),
)]
pub(super) async fn metrics(State(app): State<App>) -> Result<Response> {
    let text = observe::render(&app.db, &app.http_counts).await?;
    Ok(([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text).into_response())
}
