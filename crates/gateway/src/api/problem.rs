//! Errors of the API: RFC 9457 problem documents.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

/// Why a request was not answered as asked, as `application/problem+json`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Problem {
    /// What kind of problem it is; `about:blank` says that the status tells it all.
    #[serde(rename = "type")]
    #[schema(examples("about:blank"))]
    pub kind: String,
    /// The name of the status.
    #[schema(examples("Not Found"))]
    pub title: String,
    /// The HTTP status.
    #[schema(examples(404))]
    pub status: u16,
    /// One sentence: what is wrong and what to do.
    #[schema(examples("there is no device gen9; this site has gen1, gen2"))]
    pub detail: String,
}

impl Problem {
    /// The media type of a problem.
    pub(crate) const CONTENT_TYPE: &str = "application/problem+json";

    /// A problem that its status and one sentence describe.
    pub fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self {
            kind: "about:blank".to_owned(),
            title: status.canonical_reason().unwrap_or("Error").to_owned(),
            status: status.as_u16(),
            detail: detail.into(),
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let body = serde_json::to_vec(&self).unwrap_or_default();
        let json = HeaderValue::from_static(Self::CONTENT_TYPE);
        (status, [(header::CONTENT_TYPE, json)], body).into_response()
    }
}
