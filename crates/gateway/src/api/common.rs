//! What every operation takes and answers besides its own: tags, and the problems that any request may run into.

use axum::http::StatusCode;
use utoipa::openapi::path::{Operation, ParameterBuilder, ParameterIn};
use utoipa::openapi::response::ResponseBuilder;
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{ContentBuilder, HeaderBuilder, OpenApi, Ref, RefOr, Required};

use super::Problem;

/// What can go wrong before a request reaches its operation.
const PROBLEMS: [(StatusCode, &str); 6] = [
    (StatusCode::BAD_REQUEST, "The request has no Host header, more than one, or a body that is none"),
    (StatusCode::URI_TOO_LONG, "The address is too long"),
    (StatusCode::MISDIRECTED_REQUEST, "A gateway for one machine was asked under a name that is not its own"),
    (StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE, "There are too many header fields, or they are too long"),
    (StatusCode::INTERNAL_SERVER_ERROR, "The request met a bug in the gateway"),
    (StatusCode::SERVICE_UNAVAILABLE, "Too many clients ask at once; Retry-After says when to try again"),
];

/// Adds it to every operation of the document.
pub(super) fn describe(document: &mut OpenApi) {
    let operations = document.paths.paths.values_mut().filter_map(|path| path.get.as_mut());
    operations.for_each(describe_operation);
}

fn describe_operation(operation: &mut Operation) {
    if is_tagged(operation) {
        let list = ParameterBuilder::new()
            .name("If-None-Match")
            .parameter_in(ParameterIn::Header)
            .required(Required::False)
            .description(Some("Entity tags of answers that the client has, with commas between them"))
            .schema(Some(ObjectBuilder::new().schema_type(Type::String)))
            .example(Some(serde_json::json!("W/\"0123456789abcdef\"")))
            .build();
        operation.parameters.get_or_insert_default().push(RefOr::T(list));
        let unchanged =
            ResponseBuilder::new().description("What the client has is what there is").header("ETag", tag());
        operation.responses.responses.insert("304".to_owned(), RefOr::T(unchanged.build()));
    }
    for (status, description) in PROBLEMS {
        let code = status.as_str().to_owned();
        operation.responses.responses.entry(code).or_insert_with(|| RefOr::T(problem(description)));
    }
}

/// Whether its good answer is JSON, which carries a tag; says so, if it is.
fn is_tagged(operation: &mut Operation) -> bool {
    let Some(RefOr::T(answer)) = operation.responses.responses.get_mut("200") else { return false };
    let tagged = answer.content.contains_key("application/json");
    if tagged {
        answer.headers.insert("ETag".to_owned(), tag().into());
    }
    tagged
}

fn tag() -> utoipa::openapi::Header {
    HeaderBuilder::new()
        .description(Some("Changes with the content; weak, as the same content may be compressed or not"))
        .schema(Some(ObjectBuilder::new().schema_type(Type::String)))
        .build()
}

fn problem(description: &str) -> utoipa::openapi::Response {
    let body = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).build();
    ResponseBuilder::new().description(description).content(Problem::CONTENT_TYPE, body).build()
}
