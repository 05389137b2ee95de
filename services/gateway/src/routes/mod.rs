//! The handlers, by noun.

mod bodies;
mod body_builds;
mod body_models;
mod builds;
mod cameras;
mod contents;
mod databases;
mod download;
mod events;
mod files;
mod inverse_kinematics;
pub(crate) mod live;
mod lookup;
mod me;
mod operations;
mod results;
mod runs;
mod session_files;
mod sessions;
mod source_files;
mod start;

use axum::{
    Router,
    extract::{DefaultBodyLimit, Request, State},
    http::{Method, Uri},
    middleware::{self, Next},
    response::{IntoResponse, Response},
};
use tower_http::{catch_panic::CatchPanicLayer, trace::TraceLayer};
use utoipa_axum::{router::OpenApiRouter, routes};
use utoipa_swagger_ui::SwaggerUi;

use crate::{App, error::Error, extract::MAX_JSON_BYTES, observe, openapi};

/// Every route of the API, with its description.
pub(crate) fn described() -> OpenApiRouter<App> {
    OpenApiRouter::with_openapi(openapi::head())
        .routes(routes!(me::show))
        .routes(routes!(sessions::create, sessions::list))
        .routes(routes!(sessions::show, sessions::delete))
        .routes(routes!(session_files::list_of_session))
        .routes(routes!(
            session_files::put_in_session,
            session_files::get_of_session,
            session_files::delete_of_session
        ))
        .routes(routes!(start::reconstruction, runs::list_of_session))
        .routes(routes!(databases::create, databases::list))
        .routes(routes!(databases::show, databases::delete))
        .routes(routes!(source_files::list_of_database))
        .routes(routes!(source_files::put_in_database, source_files::delete_of_database))
        .routes(routes!(databases::clips))
        .routes(routes!(builds::build))
        .routes(routes!(builds::train))
        .routes(routes!(body_models::create, body_models::list))
        .routes(routes!(body_models::show, body_models::delete))
        .routes(routes!(body_builds::build))
        .routes(routes!(bodies::file))
        .routes(routes!(bodies::glb))
        .routes(routes!(source_files::list_of_body_model))
        .routes(routes!(source_files::put_in_body_model, source_files::delete_of_body_model))
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

/// The whole service: API, its description, and what surrounds every request.
pub fn router(app: App) -> Router {
    let (router, api) = described().split_for_parts();
    router
        .merge(SwaggerUi::new("/docs").url("/openapi.json", openapi::finish(api)))
        .fallback(no_such_path)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(DefaultBodyLimit::max(MAX_JSON_BYTES))
        .layer(middleware::from_fn_with_state(app.clone(), limit_time))
        .layer(CatchPanicLayer::custom(after_panic))
        .layer(middleware::from_fn_with_state(app.clone(), observe::count_request))
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
