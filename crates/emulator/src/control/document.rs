//! Every operation of the API, and the OpenAPI 3.1 document that describes them.

use std::sync::{Arc, LazyLock};

use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use utoipa::OpenApi;
use utoipa::openapi::path::{Operation, PathItem};
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{ContentBuilder, Ref, RefOr, Response, ResponseBuilder, ServerBuilder};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::problem::Problem;
use super::site::Site;
use super::{alarms, clock, pins, plant, values};

/// What may go wrong with any request.
const PROBLEMS: [(StatusCode, &str); 4] = [
    (
        StatusCode::BAD_REQUEST,
        "The request is not understood: its address, its query, its body or its Host header",
    ),
    (StatusCode::UNAUTHORIZED, "This imitation was started with a token, and another one or none was shown"),
    (StatusCode::NOT_FOUND, "There is no such controller, or it has nothing of that name"),
    (StatusCode::MISDIRECTED_REQUEST, "A control for one machine was asked under a name that is not its own"),
];

/// What may go wrong besides where there is a body.
const PROBLEMS_OF_BODIES: [(StatusCode, &str); 3] = [
    (StatusCode::REQUEST_TIMEOUT, "The body did not come"),
    (StatusCode::PAYLOAD_TOO_LARGE, "The body is too large"),
    (StatusCode::UNSUPPORTED_MEDIA_TYPE, "The body is not said to be JSON"),
];

/// The OpenAPI 3.1 document of the API, as `openapi.json` beside the page serves it.
pub fn openapi() -> utoipa::openapi::OpenApi {
    let mut document = routes().into_openapi();
    document.servers = Some(vec![
        // Wherever it is mounted, the document stands at its root.
        ServerBuilder::new().url("./").description(Some("Where this document is")).build(),
    ]);
    let bearer = HttpBuilder::new().scheme(HttpAuthScheme::Bearer).build();
    let components = document.components.get_or_insert_default();
    components.security_schemes.insert("token".to_owned(), RefOr::T(SecurityScheme::Http(bearer)));
    document.security = Some(vec![
        SecurityRequirement::default(),
        SecurityRequirement::new::<_, [&str; 0], &str>("token", []),
    ]);
    document.paths.paths.values_mut().flat_map(operations).for_each(describe);
    document
}

/// Where it is served.
pub(super) fn router() -> Router {
    Router::new().route("/openapi.json", get(document))
}

pub(super) fn routes() -> OpenApiRouter<Arc<Site>> {
    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(clock::controllers))
        .routes(routes!(clock::controller))
        .routes(routes!(values::values))
        .routes(routes!(clock::change_clock))
        .routes(routes!(clock::step))
        .routes(routes!(plant::levers))
        .routes(routes!(plant::pull))
        .routes(routes!(plant::restore))
        .routes(routes!(plant::events))
        .routes(routes!(alarms::alarms))
        .routes(routes!(alarms::inject, alarms::release))
        .routes(routes!(pins::points))
        .routes(routes!(pins::pins))
        .routes(routes!(pins::pin, pins::unpin))
        .routes(routes!(pins::settings))
        .routes(routes!(pins::set))
}

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Busbar imitation",
        description = "Control of imitated controllers: what happens to their plants, and how fast. Nothing here reaches a real device.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0"),
    ),
    components(schemas(Problem)),
    tags((name = "controllers", description = "What there is, its clocks, and what clients read"), (name = "plant", description = "What happens to it"), (name = "panel", description = "What the controller is set to, and what it is kept at")),
)]
struct Document;

async fn document() -> impl IntoResponse {
    static DOCUMENT: LazyLock<Vec<u8>> = LazyLock::new(|| serde_json::to_vec(&openapi()).unwrap_or_default());
    ([(header::CONTENT_TYPE, "application/json")], DOCUMENT.as_slice())
}

fn operations(path: &mut PathItem) -> impl Iterator<Item = &mut Operation> {
    [&mut path.get, &mut path.put, &mut path.post, &mut path.delete].into_iter().filter_map(Option::as_mut)
}

fn describe(operation: &mut Operation) {
    let of_bodies: &[_] = if operation.request_body.is_some() { &PROBLEMS_OF_BODIES } else { &[] };
    for (status, description) in PROBLEMS.iter().chain(of_bodies) {
        let code = status.as_str().to_owned();
        operation.responses.responses.entry(code).or_insert_with(|| RefOr::T(problem(description)));
    }
}

fn problem(description: &str) -> Response {
    let body = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).build();
    ResponseBuilder::new().description(description).content(Problem::CONTENT_TYPE, body).build()
}
