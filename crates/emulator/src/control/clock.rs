//! What there is, and its clocks: paused, stepped, faster or slower.

use std::sync::Arc;
use std::time::Duration;

use axum::Json as Answer;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use tokio::task::spawn_blocking;

use super::problem::{Json, Problem};
use super::site::{Site, named};
use super::types::{ClockChange, ClockView, ControllerView, Step};

/// As much as is let pass at once; what takes longer is several steps.
const LONGEST_STEP: f64 = 3600.0;

/// The imitated controllers.
#[utoipa::path(get, path = "/api/v1/controllers", tag = "controllers", responses((status = OK, body = Vec<ControllerView>, description = "The controllers")))]
pub(super) async fn controllers(State(site): State<Arc<Site>>) -> Answer<Vec<ControllerView>> {
    Answer(site.all().iter().map(ControllerView::of).collect())
}

/// One of them: what it is, how its clock runs, and what was done to it.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}", tag = "controllers",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = ControllerView, description = "The controller")),
)]
pub(super) async fn controller(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<ControllerView>, Problem> {
    Ok(Answer(ControllerView::of(site.one(&named(id)?)?)))
}

/// Pauses its clock, lets it go on, or changes its speed.
///
/// Requests are answered while it is paused; only time stands still.
#[utoipa::path(
    put, path = "/api/v1/controllers/{controller}/clock", tag = "controllers",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    request_body(content = ClockChange, content_type = "application/json"),
    responses(
        (status = OK, body = ClockView, description = "How it runs now"),
        (status = UNPROCESSABLE_ENTITY, body = Problem, content_type = "application/problem+json", description = "No clock runs at that speed"),
    ),
)]
pub(super) async fn change_clock(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
    body: Result<Json<ClockChange>, Problem>,
) -> Result<Answer<ClockView>, Problem> {
    let controller = &site.one(&named(id)?)?.controller;
    let Json(change) = body?;
    if let Some(speed) = change.speed {
        controller.run_at(speed)?;
    }
    if let Some(paused) = change.paused {
        controller.pause(paused);
    }
    Ok(Answer(ClockView::of(controller)))
}

/// Lets time pass at once, whether its clock is paused or not.
///
/// The plant moves in steps of 0.1 s; what is left over counts for the next step.
#[utoipa::path(
    post, path = "/api/v1/controllers/{controller}/steps", tag = "controllers",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    request_body(content = Step, content_type = "application/json"),
    responses(
        (status = OK, body = ClockView, description = "What time it is now"),
        (status = UNPROCESSABLE_ENTITY, body = Problem, content_type = "application/problem+json", description = "Not as long as that at once"),
    ),
)]
pub(super) async fn step(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
    body: Result<Json<Step>, Problem>,
) -> Result<Answer<ClockView>, Problem> {
    let controller = site.one(&named(id)?)?.controller.clone();
    let Json(Step { seconds }) = body?;
    if !(seconds > 0.0 && seconds <= LONGEST_STEP) {
        let detail = format!(
            "{seconds} s cannot be stepped at once, choose a number above 0 and up to {LONGEST_STEP}"
        );
        return Err(Problem::new(StatusCode::UNPROCESSABLE_ENTITY, detail));
    }
    // An hour of a plant is some work, and the tasks of this thread answer Modbus clients.
    let stepped = spawn_blocking(move || {
        controller.step(Duration::from_secs_f64(seconds));
        ClockView::of(&controller)
    });
    stepped.await.map(Answer).map_err(|_| {
        let detail = "the imitation ended before the step did";
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail)
    })
}
