//! The levers of a plant: what can be made to happen to it.

use std::sync::Arc;

use axum::Json as Answer;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};

use super::problem::{Json, Problem};
use super::site::{Site, named};
use super::types::{ControllerView, EventView, LeverView, Pull};
use crate::device::Device;
use crate::levers::{Lever, LeverError};

/// The levers of a plant, with where they stand.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}/levers", tag = "plant",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = Vec<LeverView>, description = "Its levers")),
)]
pub(super) async fn levers(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<Vec<LeverView>>, Problem> {
    let controller = &site.one(&named(id)?)?.controller;
    Ok(Answer(controller.with(|device| levers_of(device))))
}

/// Pulls a lever. What follows from it is the plant's and the panel's affair, and is seen from the next step on.
#[utoipa::path(
    put, path = "/api/v1/controllers/{controller}/levers/{lever}", tag = "plant",
    params(
        ("controller" = String, Path, description = "Id of the controller", example = "genset-1"),
        ("lever" = String, Path, description = "Id of the lever", example = "mains"),
    ),
    request_body(content = Pull, content_type = "application/json"),
    responses(
        (status = OK, body = LeverView, description = "The lever, where it stands now"),
        (status = UNPROCESSABLE_ENTITY, body = Problem, content_type = "application/problem+json", description = "The lever has no such position"),
    ),
)]
pub(super) async fn pull(
    State(site): State<Arc<Site>>,
    ids: Result<Path<(String, String)>, PathRejection>,
    body: Result<Json<Pull>, Problem>,
) -> Result<Answer<LeverView>, Problem> {
    let (id, lever) = named(ids)?;
    let controller = &site.one(&id)?.controller;
    let Json(Pull { position }) = body?;
    controller.with(|device| {
        device.pull(&lever, &position.text())?;
        let mut levers = levers_of(device).into_iter();
        let pulled = levers.find(|view| view.id == lever).map(Answer);
        pulled.ok_or_else(|| LeverError::Unknown { id: lever, nearest: None, known: Vec::new() }.into())
    })
}

/// Every lever whose position is known.
pub(super) fn levers_of(device: &Device) -> Vec<LeverView> {
    let levers = device.levers().iter();
    let view = |lever: &Lever| Some(LeverView::of(lever, device.lever(lever.id)?, device.back(lever)));
    levers.filter_map(view).collect()
}

/// Puts everything back to normal: every lever, every injected alarm, every pinned point.
///
/// Settings stay as they are. What the panel has latched stays until it is reset there, as on site.
#[utoipa::path(
    put, path = "/api/v1/controllers/{controller}/normal", tag = "plant",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = ControllerView, description = "The controller, with nothing done to it")),
)]
pub(super) async fn restore(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<ControllerView>, Problem> {
    let imitated = site.one(&named(id)?)?;
    imitated.controller.with(Device::restore);
    Ok(Answer(ControllerView::of(imitated)))
}

/// What happened lately, the newest first: what was done, and what a person at the panel would have seen of that.
///
/// The panel is looked at once a second of simulated time, and the last 200 events are kept.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}/events", tag = "plant",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = Vec<EventView>, description = "The events")),
)]
pub(super) async fn events(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<Vec<EventView>>, Problem> {
    let controller = &site.one(&named(id)?)?.controller;
    Ok(Answer(controller.with(|device| device.lately().map(EventView::of).collect())))
}
