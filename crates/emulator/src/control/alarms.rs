//! Alarms that are injected: the panel takes them for its own, whatever the plant says.

use std::sync::Arc;

use axum::Json as Answer;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};

use super::problem::Problem;
use super::site::{Site, named};
use super::types::AlarmView;

/// Every alarm of a controller, with those that are injected.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}/alarms", tag = "plant",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = Vec<AlarmView>, description = "Its alarms")),
)]
pub(super) async fn alarms(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<Vec<AlarmView>>, Problem> {
    let controller = &site.one(&named(id)?)?.controller;
    Ok(Answer(controller.with(|device| {
        let injected = device.injected();
        device.alarms().map(|alarm| AlarmView::of(&alarm, injected.contains(&alarm))).collect()
    })))
}

/// Injects an alarm: the panel takes it for active and reacts as to its own, until it is let go.
///
/// Some alarms follow from others, such as that there is any; those cannot be injected.
#[utoipa::path(
    put, path = "/api/v1/controllers/{controller}/alarms/{alarm}", tag = "plant",
    params(
        ("controller" = String, Path, description = "Id of the controller", example = "genset-1"),
        ("alarm" = String, Path, description = "Name of the alarm", example = "shutdown_alarms.genset_low_frequency"),
    ),
    responses(
        (status = OK, body = Vec<AlarmView>, description = "The alarms that are injected now"),
        (status = UNPROCESSABLE_ENTITY, body = Problem, content_type = "application/problem+json", description = "It follows from other alarms, or several have that name"),
    ),
)]
pub(super) async fn inject(
    State(site): State<Arc<Site>>,
    ids: Result<Path<(String, String)>, PathRejection>,
) -> Result<Answer<Vec<AlarmView>>, Problem> {
    set(&site, ids, true)
}

/// Lets an injected alarm go: it is what the plant says again.
#[utoipa::path(
    delete, path = "/api/v1/controllers/{controller}/alarms/{alarm}", tag = "plant",
    params(
        ("controller" = String, Path, description = "Id of the controller", example = "genset-1"),
        ("alarm" = String, Path, description = "Name of the alarm", example = "shutdown_alarms.genset_low_frequency"),
    ),
    responses(
        (status = OK, body = Vec<AlarmView>, description = "The alarms that are still injected"),
        (status = UNPROCESSABLE_ENTITY, body = Problem, content_type = "application/problem+json", description = "It follows from other alarms, or several have that name"),
    ),
)]
pub(super) async fn release(
    State(site): State<Arc<Site>>,
    ids: Result<Path<(String, String)>, PathRejection>,
) -> Result<Answer<Vec<AlarmView>>, Problem> {
    set(&site, ids, false)
}

fn set(
    site: &Site,
    ids: Result<Path<(String, String)>, PathRejection>,
    active: bool,
) -> Result<Answer<Vec<AlarmView>>, Problem> {
    let (id, alarm) = named(ids)?;
    site.one(&id)?.controller.with(|device| {
        device.inject(&alarm, active)?;
        Ok(Answer(device.injected().iter().map(|alarm| AlarmView::of(alarm, true)).collect()))
    })
}
