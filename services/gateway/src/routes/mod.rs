//! The handlers, by noun.

mod bodies;
mod body_models;
mod download;
mod events;
mod live;
mod me;
mod motion_databases;
mod operations;
mod results;
mod runs;
mod session_files;
mod sessions;

use std::sync::Arc;

use axum::{
    Router,
    extract::{DefaultBodyLimit, Request, State},
    http::{Method, Uri},
    middleware::{self, Next},
    response::{IntoResponse, Redirect, Response},
    routing::get,
};
use tower_http::{catch_panic::CatchPanicLayer, trace::TraceLayer};
use utoipa_axum::{router::OpenApiRouter, routes};
use utoipa_swagger_ui::SwaggerUi;

use crate::{
    App,
    error::Error,
    extract::MAX_JSON_BYTES,
    observe, openapi,
    query::{self, Known},
};

/// Every route of the API, with its description.
fn described() -> OpenApiRouter<App> {
    OpenApiRouter::with_openapi(openapi::head())
        .routes(routes!(me::show))
        .routes(routes!(sessions::create, sessions::list))
        .routes(routes!(sessions::show, sessions::delete))
        .routes(routes!(session_files::list))
        .routes(routes!(session_files::put, session_files::get, session_files::delete))
        .routes(routes!(runs::start, runs::list_by_session))
        .routes(routes!(motion_databases::create, motion_databases::list))
        .routes(routes!(motion_databases::show, motion_databases::delete))
        .routes(routes!(motion_databases::list_files))
        .routes(routes!(motion_databases::put_file, motion_databases::delete_file))
        .routes(routes!(motion_databases::clips))
        .routes(routes!(motion_databases::build))
        .routes(routes!(motion_databases::train))
        .routes(routes!(body_models::create, body_models::list))
        .routes(routes!(body_models::show, body_models::delete))
        .routes(routes!(body_models::list_files))
        .routes(routes!(body_models::put_file, body_models::delete_file))
        .routes(routes!(body_models::build))
        .routes(routes!(bodies::file))
        .routes(routes!(bodies::glb))
        .routes(routes!(runs::list))
        .routes(routes!(runs::show))
        .routes(routes!(runs::cancel))
        .routes(routes!(events::watch))
        .routes(routes!(live::follow))
        .routes(routes!(results::list))
        .routes(routes!(results::get))
        .routes(routes!(operations::healthz))
        .routes(routes!(operations::readyz))
        .routes(routes!(operations::metrics))
}

/// The OpenAPI 3.1 document, as it is served at `/openapi.json`.
pub fn openapi_document() -> utoipa::openapi::OpenApi {
    openapi::finish(described().into_openapi())
}

/// The whole service: API, its description, and what surrounds every request.
pub fn router(app: App) -> Router {
    let (router, api) = described().split_for_parts();
    let known = Arc::new(Known::from_description(&api));
    router
        .layer(middleware::from_fn_with_state(known, query::refuse_unknown))
        .merge(SwaggerUi::new("/docs").url("/openapi.json", openapi::finish(api)))
        // whoever opens the address alone finds the page
        .route("/", get(|| async { Redirect::temporary("/docs/") }))
        .fallback(no_such_path)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES))
        .layer(middleware::from_fn_with_state(app.clone(), limit_time))
        .layer(CatchPanicLayer::custom(after_panic))
        .layer(middleware::from_fn_with_state(Arc::clone(&app.http_counts), observe::count_request))
        .layer(TraceLayer::new_for_http())
        .with_state(app)
}

async fn no_such_path(uri: Uri) -> Error {
    Error::NoSuchPath(uri.path().to_owned())
}

async fn method_not_allowed(method: Method) -> Error {
    Error::MethodNotAllowed(method.to_string())
}

/// Uploads (the only PUTs) have a limit of their own, on stalling; answers that stream have begun by then.
async fn limit_time(State(app): State<App>, request: Request, next: Next) -> Response {
    if request.method() == Method::PUT {
        return next.run(request).await;
    }
    let limit = app.limits.request_timeout;
    tokio::time::timeout(limit, next.run(request))
        .await
        .unwrap_or_else(|_| Error::TimedOut(limit.as_secs()).into_response())
}

fn after_panic(panic: Box<dyn std::any::Any + Send>) -> Response {
    let text = panic
        .downcast_ref::<String>()
        .cloned()
        .or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()))
        .unwrap_or_default();
    Error::Internal(format!("panic: {text}")).into_response()
}
