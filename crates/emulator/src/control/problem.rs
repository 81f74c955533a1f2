//! What went wrong with a request: RFC 9457 problem documents, and bodies that are refused with one.

use std::time::Duration;

use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::time::timeout;
use utoipa::ToSchema;

use crate::PinProblem;
use crate::error::PinError;
use crate::inject::InjectError;
use crate::levers::LeverError;
use crate::server::SpeedError;
use crate::settings::SettingError;

/// The largest body that is read: a picture as hexadecimal fits.
pub(super) const LARGEST_BODY: usize = 8 * 1024;

/// A client has this long to send a body.
const PATIENCE: Duration = Duration::from_secs(10);

/// Why a request was not answered as asked, as `application/problem+json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
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
    #[schema(examples("there is no controller gen9; there is genset-1, genset-2"))]
    pub detail: String,
}

impl Problem {
    /// The media type of a problem.
    pub(super) const CONTENT_TYPE: &str = "application/problem+json";

    /// A problem that its status and one sentence describe.
    pub(super) fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self {
            kind: "about:blank".to_owned(),
            title: status.canonical_reason().unwrap_or("Error").to_owned(),
            status: status.as_u16(),
            detail: detail.into(),
        }
    }

    /// What was asked for is written rightly, and the controller has no such thing.
    fn impossible(error: impl std::error::Error) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, error.to_string())
    }

    /// The address names what the controller does not have.
    fn absent(error: impl std::error::Error) -> Self {
        Self::new(StatusCode::NOT_FOUND, error.to_string())
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

impl From<LeverError> for Problem {
    fn from(error: LeverError) -> Self {
        match error {
            LeverError::Unknown { .. } => Self::absent(error),
            LeverError::Position { .. } => Self::impossible(error),
        }
    }
}

impl From<InjectError> for Problem {
    fn from(error: InjectError) -> Self {
        match error {
            InjectError::Unknown { .. } => Self::absent(error),
            InjectError::Ambiguous { .. } | InjectError::Derived { .. } => Self::impossible(error),
        }
    }
}

impl From<PinError> for Problem {
    fn from(error: PinError) -> Self {
        match error.problem {
            PinProblem::UnknownPoint { .. } => Self::absent(error),
            _ => Self::impossible(error),
        }
    }
}

impl From<SettingError> for Problem {
    fn from(error: SettingError) -> Self {
        match error {
            SettingError::Unknown { .. } => Self::absent(error),
            SettingError::Range { .. } => Self::impossible(error),
        }
    }
}

impl From<SpeedError> for Problem {
    fn from(error: SpeedError) -> Self {
        Self::impossible(error)
    }
}

/// A JSON body, or the problem with it.
///
/// A page elsewhere cannot send one: for this content type, and for every method but GET and POST, a browser asks
/// first, and it is not told that it may.
#[derive(Debug)]
pub(super) struct Json<T>(pub(super) T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Json<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        if !is_json(request.headers()) {
            let detail = "the body is not said to be JSON; send it with Content-Type: application/json";
            return Err(Problem::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, detail));
        }
        // What is announced is believed: nobody waits for a body that is not taken anyway.
        if announced(request.headers()).is_some_and(|length| length > LARGEST_BODY as u64) {
            return Err(too_large());
        }
        let bytes = timeout(PATIENCE, Bytes::from_request(request, state)).await;
        let bytes = bytes.map_err(|_| late())?.map_err(|rejection| unread(&rejection))?;
        parse(&bytes).map(Self).map_err(|error| {
            let detail =
                format!("the body is not what is needed: {error}; openapi.json lists what it may hold");
            Problem::new(StatusCode::BAD_REQUEST, detail)
        })
    }
}

/// An object, and what is wrong with any other body in words that need no knowledge of the program.
fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    // A list would pass for the values of an object in their order.
    if bytes.trim_ascii_start().starts_with(b"[") {
        return Err("it is a list, and an object is needed".to_owned());
    }
    serde_json::from_slice(bytes).map_err(|error| error.to_string().replace("f64", "a number"))
}

fn announced(headers: &HeaderMap) -> Option<u64> {
    headers.get(header::CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

fn too_large() -> Problem {
    let detail = format!("the body has more than the {LARGEST_BODY} bytes that are taken; send less");
    Problem::new(StatusCode::PAYLOAD_TOO_LARGE, detail)
}

fn late() -> Problem {
    let detail = format!("the body did not come within {} s; send all of it", PATIENCE.as_secs());
    Problem::new(StatusCode::REQUEST_TIMEOUT, detail)
}

fn unread(rejection: &BytesRejection) -> Problem {
    match rejection.status() {
        StatusCode::PAYLOAD_TOO_LARGE => too_large(),
        _ => Problem::new(StatusCode::BAD_REQUEST, "the body broke off; send all of it"),
    }
}

fn is_json(headers: &HeaderMap) -> bool {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    kind.split(';').next().unwrap_or_default().trim().eq_ignore_ascii_case("application/json")
}
