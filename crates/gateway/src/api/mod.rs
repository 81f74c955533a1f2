//! The HTTP API `/api/v1` and the document that describes it.

mod common;
mod etag;
mod operation;
mod problem;
pub mod types;

use std::sync::{Arc, LazyLock};

use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Json, Router};
use serde::Deserialize;
use utoipa::{IntoParams, OpenApi};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

pub(crate) use self::etag::tagged;
pub use self::problem::Problem;
use self::types::{
    AlarmView, AlarmsEvent, DeviceView, JoinedView, PointsView, ResumedEvent, SiteInfo, SiteView,
    SnapshotEvent, StateEvent, ValueView, ValuesEvent, WireDetailView, WireView,
};
use crate::events;
use crate::hub::Hub;

/// Where the event stream is.
pub(crate) const EVENTS: &str = "/api/v1/events";

/// What changes with a restart or another site file only may be kept, as long as its tag is asked for each time.
const KEPT: [(header::HeaderName, &str); 1] = [(header::CACHE_CONTROL, "no-cache")];

/// The OpenAPI 3.1 document of the API, as `/api/v1/openapi.json` serves it.
pub fn openapi() -> utoipa::openapi::OpenApi {
    let mut document = routes().into_openapi();
    common::describe(&mut document);
    document
}

/// Every route of the API, with those for whoever keeps the gateway running.
pub(crate) fn router(hub: Arc<Hub>) -> Router {
    Router::from(routes()).with_state(hub)
}

fn routes() -> OpenApiRouter<Arc<Hub>> {
    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(site))
        .routes(routes!(devices))
        .routes(routes!(device))
        .routes(routes!(points))
        .routes(routes!(values))
        .routes(routes!(joined))
        .routes(routes!(alarms))
        .routes(routes!(wires))
        .routes(routes!(wire))
        .routes(routes!(stream))
        .routes(routes!(document))
        .routes(routes!(operation::healthz))
        .routes(routes!(operation::readyz))
        .routes(routes!(operation::metrics))
}

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Busbar",
        description = "Live values, states and alarms of standby-power controllers. Read only.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0"),
    ),
    // The events are not a body that the document could describe, so their shapes are named here.
    components(schemas(SnapshotEvent, StateEvent, ResumedEvent, SiteInfo, ValuesEvent, AlarmsEvent, Problem)),
    tags((name = "site", description = "The site, its devices and its wires"), (name = "live", description = "What they read now"), (name = "operation", description = "For whoever keeps the gateway running")),
)]
struct Document;

/// The site and every device on it.
#[utoipa::path(get, path = "/api/v1/site", tag = "site", responses((status = OK, body = SiteView, description = "The site")))]
async fn site(State(hub): State<Arc<Hub>>) -> Json<SiteView> {
    Json(hub.site())
}

/// The devices in the order of the site file.
#[utoipa::path(get, path = "/api/v1/devices", tag = "site", responses((status = OK, body = Vec<DeviceView>, description = "The devices")))]
async fn devices(State(hub): State<Arc<Hub>>) -> Json<Vec<DeviceView>> {
    Json(hub.device_views())
}

/// One device.
#[utoipa::path(
    get, path = "/api/v1/devices/{device}", tag = "site",
    params(("device" = String, Path, description = "Id of the device", example = "gen1")),
    responses(
        (status = OK, body = DeviceView, description = "The device"),
        (status = NOT_FOUND, body = Problem, content_type = "application/problem+json", description = "There is no such device"),
    ),
)]
async fn device(
    State(hub): State<Arc<Hub>>,
    device: Result<Path<String>, PathRejection>,
) -> Result<Json<DeviceView>, Problem> {
    hub.device_view(&known(device)?).map(Json)
}

/// Which points of a device are wanted.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct PointsQuery {
    /// Only what carries one of these signals: ids of the shared vocabulary with commas between them. Those that the
    /// device does not have are passed over.
    #[param(example = "genset.power.active,breaker.genset.closed")]
    pub(crate) signal: Option<String>,
}

/// The points of one device: what there is to read. It does not change while the gateway runs.
#[utoipa::path(
    get, path = "/api/v1/devices/{device}/points", tag = "site",
    params(("device" = String, Path, description = "Id of the device", example = "gen1"), PointsQuery),
    responses(
        (status = OK, body = PointsView, description = "Its points, in groups"),
        (status = BAD_REQUEST, body = Problem, content_type = "application/problem+json", description = "The query is not understood"),
        (status = NOT_FOUND, body = Problem, content_type = "application/problem+json", description = "There is no such device"),
    ),
)]
async fn points(
    State(hub): State<Arc<Hub>>,
    device: Result<Path<String>, PathRejection>,
    query: Result<Query<PointsQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(bad_query)?;
    hub.points(&known(device)?, &query).map(|points| (KEPT, Json(points)).into_response())
}

/// Which values of a device are wanted.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ValuesQuery {
    /// Only the points of this group.
    #[param(example = "genset")]
    pub(crate) group: Option<String>,
    /// Only these points: ids with commas between them.
    #[param(example = "genset_l1_voltage,genset_frequency")]
    pub(crate) point: Option<String>,
}

/// The values of one device, in address order.
///
/// Points that are read on demand only are listed once they have been read.
#[utoipa::path(
    get, path = "/api/v1/devices/{device}/values", tag = "live",
    params(("device" = String, Path, description = "Id of the device", example = "gen1"), ValuesQuery),
    responses(
        (status = OK, body = Vec<ValueView>, description = "Its values"),
        (status = BAD_REQUEST, body = Problem, content_type = "application/problem+json", description = "The query names what the device does not have"),
        (status = NOT_FOUND, body = Problem, content_type = "application/problem+json", description = "There is no such device"),
    ),
)]
async fn values(
    State(hub): State<Arc<Hub>>,
    device: Result<Path<String>, PathRejection>,
    query: Result<Query<ValuesQuery>, QueryRejection>,
) -> Result<Json<Vec<ValueView>>, Problem> {
    let Query(query) = query.map_err(bad_query)?;
    hub.values(&known(device)?, &query).map(Json)
}

/// The signals of one device that several points make up: hours out of hours, minutes and seconds, a clock out of its
/// parts.
///
/// A signal that one point carries is named in that point's description.
#[utoipa::path(
    get, path = "/api/v1/devices/{device}/joined", tag = "live",
    params(("device" = String, Path, description = "Id of the device", example = "air1")),
    responses(
        (status = OK, body = Vec<JoinedView>, description = "Its joined signals"),
        (status = BAD_REQUEST, body = Problem, content_type = "application/problem+json", description = "The id is no text"),
        (status = NOT_FOUND, body = Problem, content_type = "application/problem+json", description = "There is no such device"),
    ),
)]
async fn joined(
    State(hub): State<Arc<Hub>>,
    device: Result<Path<String>, PathRejection>,
) -> Result<Json<Vec<JoinedView>>, Problem> {
    hub.joined(&known(device)?).map(Json)
}

/// The active alarms of every device, the gravest first.
#[utoipa::path(get, path = "/api/v1/alarms", tag = "live", responses((status = OK, body = Vec<AlarmView>, description = "The active alarms")))]
async fn alarms(State(hub): State<Arc<Hub>>) -> Json<Vec<AlarmView>> {
    Json(hub.alarms())
}

/// The wires in the order of the site file.
#[utoipa::path(get, path = "/api/v1/wires", tag = "site", responses((status = OK, body = Vec<WireView>, description = "The wires")))]
async fn wires(State(hub): State<Arc<Hub>>) -> Json<Vec<WireView>> {
    Json(hub.wires())
}

/// One wire in detail: its units, how long answers took, how its time is used, and the reads of each device on it.
#[utoipa::path(
    get, path = "/api/v1/wires/{wire}", tag = "site",
    params(("wire" = String, Path, description = "Id of the wire", example = "gen1")),
    responses(
        (status = OK, body = WireDetailView, description = "The wire"),
        (status = BAD_REQUEST, body = Problem, content_type = "application/problem+json", description = "The id is no text"),
        (status = NOT_FOUND, body = Problem, content_type = "application/problem+json", description = "There is no such wire"),
    ),
)]
async fn wire(
    State(hub): State<Arc<Hub>>,
    wire: Result<Path<String>, PathRejection>,
) -> Result<Json<WireDetailView>, Problem> {
    hub.wire(&named(wire, "wire")?).map(Json)
}

/// Which events are wanted, and from where on.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EventsQuery {
    /// Only these devices: ids with commas between them.
    #[param(example = "gen1,gen2")]
    pub(crate) device: Option<String>,
    /// Of the values only those of these groups: ids with commas between them. What is read on demand is read while a
    /// stream that names its group is open.
    #[param(example = "genset,display")]
    pub(crate) group: Option<String>,
    /// Of the values only what carries one of these signals: ids of the shared vocabulary with commas between them.
    /// Those that a device does not have are passed over. With groups: what is in either.
    #[param(example = "genset.power.active,breaker.genset.closed")]
    pub(crate) signal: Option<String>,
    /// Id of the last event that a reader has of this query: what it missed follows, if that is still known. The
    /// header `Last-Event-ID` counts before it.
    pub(crate) last_event_id: Option<String>,
}

/// What happens, as it happens: server-sent events.
///
/// First `snapshot` (`SnapshotEvent`), then one `state` (`StateEvent`) for each of its devices; from then on `values`
/// (`ValuesEvent`) once a poll round of a device is finished, `device` (`DeviceView`) when a device changed, `alarms`
/// (`AlarmsEvent`) when its active alarms did, and `site` (`SiteInfo`) when a site file was accepted or refused. Other
/// devices or wires begin with `snapshot` again. A round that brought nothing that is asked for is told of with
/// nothing in it as long as something that is asked for is read at its rate.
///
/// The last event of a snapshot and all later ones have an id. A reader that comes back with one gets `resumed`
/// (`ResumedEvent`) and what it missed, or a `snapshot` where that is not known any more. A reader that falls behind
/// gets `device`, `alarms` and `state` of each device in place of the events it missed. A comment keeps the connection
/// alive each 15 seconds. The stream is compressed with gzip for those who accept it.
#[utoipa::path(
    get, path = "/api/v1/events", operation_id = "events", tag = "live",
    params(EventsQuery, ("last-event-id" = Option<String>, Header, description = "Id of the last event that the reader has")),
    responses(
        (status = OK, body = String, content_type = "text/event-stream", description = "The stream"),
        (status = BAD_REQUEST, body = Problem, content_type = "application/problem+json", description = "The query is not understood, or names a group that there is not"),
        (status = NOT_FOUND, body = Problem, content_type = "application/problem+json", description = "There is no such device"),
    ),
)]
async fn stream(
    State(hub): State<Arc<Hub>>,
    query: Result<Query<EventsQuery>, QueryRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(bad_query)?;
    events::response(hub, &query, &headers)
}

/// This document.
#[utoipa::path(
    get, path = "/api/v1/openapi.json", tag = "site",
    responses((status = OK, body = Object, content_type = "application/json", description = "OpenAPI 3.1")),
)]
async fn document() -> Response {
    static DOCUMENT: LazyLock<Vec<u8>> = LazyLock::new(|| serde_json::to_vec(&openapi()).unwrap_or_default());
    (KEPT, [(header::CONTENT_TYPE, "application/json")], DOCUMENT.as_slice()).into_response()
}

/// The id of a device in a path.
fn known(device: Result<Path<String>, PathRejection>) -> Result<String, Problem> {
    named(device, "device")
}

/// The id in a path; one that is no text names nothing.
fn named(id: Result<Path<String>, PathRejection>, kind: &str) -> Result<String, Problem> {
    match id {
        Ok(Path(id)) => Ok(id),
        Err(_) => {
            let detail = format!(
                "the address is no UTF-8 text, so it names no {kind}; /api/v1/{kind}s lists the {kind}s"
            );
            Err(Problem::new(StatusCode::BAD_REQUEST, detail))
        }
    }
}

fn bad_query(rejection: QueryRejection) -> Problem {
    let reason = rejection.body_text();
    // Which field, and which there are; how it was found out is nobody's concern.
    let reason = reason.strip_prefix("Failed to deserialize query string: ").unwrap_or(&reason);
    let detail =
        format!("the query is not understood: {reason}; /api/v1/openapi.json lists what it may hold");
    Problem::new(StatusCode::BAD_REQUEST, detail)
}
