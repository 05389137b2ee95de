//! The API's description.

use utoipa::{
    OpenApi,
    openapi::{
        Components, Content, ContentBuilder, Ref, RefOr, Response, ResponseBuilder,
        path::Operation,
        security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme},
    },
};

use crate::{error::Problem, runs::request::add_examples};

const KEY: &str = "api_key";

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Marey",
        description = "Full-body motion from a few control points, bodies and their motion from a few cameras, and poses by \
                       inverse kinematics.\n\nMake a session, upload its control points, run it on a motion database, \
                       download the motion; or upload what calibrated cameras saw, run it, download the body. \
                       All `/v1` paths need `Authorization: Bearer mk_…`. Errors are problem details (RFC 9457). \
                       Lists are paged: give `next` back as `cursor`.",
        license(name = "Apache-2.0", identifier = "Apache-2.0"),
    ),
    components(schemas(Problem)),
    tags(
        (name = "sessions", description = "A capture session: one take of one performer, and its files"),
        (name = "files", description = "What was uploaded to a session"),
        (name = "motion databases", description = "Recorded motion to learn from: named, versioned, immutable once built"),
        (name = "body models", description = "Body shapes, learned from registered scans (`shipped`: from bodies of a \
                                              generator): named, versioned, immutable once built"),
        (name = "runs", description = "Work that was asked for, its progress and its results"),
        (name = "live", description = "Motion while it happens, on a WebSocket"),
        (name = "me", description = "Who you are to this server"),
        (name = "operations", description = "Probes and metrics, without a key"),
    ),
)]
struct Head;

/// What does not come from the routes.
pub(crate) fn head() -> utoipa::openapi::OpenApi {
    let mut api = Head::openapi();
    let bearer = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some("An API key, `mk_…`, made by `marey key create`"))
        .build();
    api.components.get_or_insert_with(Components::new).add_security_scheme(KEY, SecurityScheme::Http(bearer));
    api.security = Some(vec![SecurityRequirement::new(KEY, Vec::<String>::new())]);
    api
}

/// Adds what all operations share: any answer but the named ones is a problem; and what no
/// macro says: examples of runs.
pub(crate) fn finish(mut api: utoipa::openapi::OpenApi) -> utoipa::openapi::OpenApi {
    for path in api.paths.paths.values_mut() {
        let operations = [&mut path.get, &mut path.put, &mut path.post, &mut path.delete];
        for operation in operations.into_iter().filter_map(Option::as_mut) {
            add_problem(operation);
            add_examples(operation);
        }
    }
    api
}

fn add_problem(operation: &mut Operation) {
    let content: Content = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).build();
    let problem: Response = ResponseBuilder::new()
        .description("Failed: problem details (RFC 9457)")
        .content("application/problem+json", content)
        .build();
    operation.responses.responses.insert("default".to_owned(), RefOr::T(problem));
}
