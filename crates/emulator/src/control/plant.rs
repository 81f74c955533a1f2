//! The levers of a plant: what can be made to happen to it.

use std::sync::Arc;

use axum::Json as Answer;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};

use super::problem::{Json, Problem};
use super::site::{Site, named};
use super::types::{LeverView, Pull};
use crate::device::Device;
use crate::levers::LeverError;

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
    levers.filter_map(|lever| Some(LeverView::of(lever, device.lever(lever.id)?))).collect()
}
