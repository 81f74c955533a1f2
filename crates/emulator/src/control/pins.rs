//! Points that are kept at a value, and what the panel is set to: what `--set` does at the start.

use std::borrow::Cow;
use std::sync::Arc;

use axum::Json as Answer;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use busbar_profile::{Shown, reading};

use super::problem::{Json, Problem};
use super::site::{Site, named};
use super::types::{Pin, PinView, PointView, Set, SettingView};
use crate::device::Device;
use crate::pins;

/// The points that clients can read: each can be pinned.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}/points", tag = "panel",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = Vec<PointView>, description = "Its points, in the order of their addresses")),
)]
pub(super) async fn points(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<Vec<PointView>>, Problem> {
    let profile = site.one(&named(id)?)?.controller.with(|device| device.profile());
    let readable = profile.points.iter().filter(|point| point.access.is_readable());
    let views = readable.map(|point| PointView {
        id: &point.id,
        name: &point.name,
        unit: point.unit.as_deref(),
        signal: point.signal.as_deref(),
    });
    Ok(Answer(views.collect()))
}

/// The points that are pinned.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}/pins", tag = "panel",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = Vec<PinView>, description = "Its pinned points")),
)]
pub(super) async fn pins(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<Vec<PinView>>, Problem> {
    let controller = &site.one(&named(id)?)?.controller;
    Ok(Answer(controller.with(|device| pins_of(device))))
}

/// Keeps a point at a value, whatever plant and panel say: clients read it. Nothing reacts to it.
#[utoipa::path(
    put, path = "/api/v1/controllers/{controller}/pins/{point}", tag = "panel",
    params(
        ("controller" = String, Path, description = "Id of the controller", example = "genset-1"),
        ("point" = String, Path, description = "Id of the point", example = "battery_voltage"),
    ),
    request_body(content = Pin, content_type = "application/json"),
    responses(
        (status = OK, body = Vec<PinView>, description = "The points that are pinned now"),
        (status = UNPROCESSABLE_ENTITY, body = Problem, content_type = "application/problem+json", description = "The point cannot have that value"),
    ),
)]
pub(super) async fn pin(
    State(site): State<Arc<Site>>,
    ids: Result<Path<(String, String)>, PathRejection>,
    body: Result<Json<Pin>, Problem>,
) -> Result<Answer<Vec<PinView>>, Problem> {
    let (id, point) = named(ids)?;
    let controller = &site.one(&id)?.controller;
    let Json(Pin { value }) = body?;
    controller.with(|device| {
        device.pin(&point, &value.text())?;
        Ok(Answer(pins_of(device)))
    })
}

/// Lets a point follow plant and panel again.
#[utoipa::path(
    delete, path = "/api/v1/controllers/{controller}/pins/{point}", tag = "panel",
    params(
        ("controller" = String, Path, description = "Id of the controller", example = "genset-1"),
        ("point" = String, Path, description = "Id of the point", example = "battery_voltage"),
    ),
    responses((status = OK, body = Vec<PinView>, description = "The points that are still pinned")),
)]
pub(super) async fn unpin(
    State(site): State<Arc<Site>>,
    ids: Result<Path<(String, String)>, PathRejection>,
) -> Result<Answer<Vec<PinView>>, Problem> {
    let (id, point) = named(ids)?;
    site.one(&id)?.controller.with(|device| {
        if device.profile().point(&point).is_none() {
            return Err(pins::unknown(device.profile(), &point).into());
        }
        device.unpin(&point);
        Ok(Answer(pins_of(device)))
    })
}

/// What a panel is set to: timers, thresholds and attempts.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}/settings", tag = "panel",
    params(("controller" = String, Path, description = "Its id", example = "genset-1")),
    responses((status = OK, body = Vec<SettingView>, description = "Its settings")),
)]
pub(super) async fn settings(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
) -> Result<Answer<Vec<SettingView>>, Problem> {
    let controller = &site.one(&named(id)?)?.controller;
    Ok(Answer(controller.with(|device| settings_of(device))))
}

/// Sets a timer, a threshold or a number of attempts.
#[utoipa::path(
    put, path = "/api/v1/controllers/{controller}/settings/{setting}", tag = "panel",
    params(
        ("controller" = String, Path, description = "Id of the controller", example = "genset-1"),
        ("setting" = String, Path, description = "Id of the setting", example = "start_attempts"),
    ),
    request_body(content = Set, content_type = "application/json"),
    responses(
        (status = OK, body = Vec<SettingView>, description = "Its settings"),
        (status = UNPROCESSABLE_ENTITY, body = Problem, content_type = "application/problem+json", description = "It cannot be set to that"),
    ),
)]
pub(super) async fn set(
    State(site): State<Arc<Site>>,
    ids: Result<Path<(String, String)>, PathRejection>,
    body: Result<Json<Set>, Problem>,
) -> Result<Answer<Vec<SettingView>>, Problem> {
    let (id, setting) = named(ids)?;
    let controller = &site.one(&id)?.controller;
    let Json(Set { value }) = body?;
    controller.with(|device| {
        device.set(&setting, &value.text())?;
        Ok(Answer(settings_of(device)))
    })
}

fn pins_of(device: &Device) -> Vec<PinView> {
    let points = device.pinned().filter_map(|index| device.profile().points.get(index));
    let pinned = points.filter_map(|point| {
        let registers = device.registers(point.address, point.registers)?;
        let decoded = point.decode(registers, device.profile().wire.word_order);
        let value = reading(point, &decoded, registers, Some(device.model())).value.map(text);
        Some(PinView { point: &point.id, value, registers: registers.to_vec() })
    });
    pinned.collect()
}

/// A value in one line.
fn text(value: Shown<'_>) -> String {
    let listed = |words: Vec<String>| if words.is_empty() { "none".to_owned() } else { words.join(", ") };
    match value {
        Shown::Number(number) => number.to_string(),
        Shown::Label(label) => label.into_owned(),
        Shown::Labels(labels) => listed(labels.into_iter().map(Cow::into_owned).collect()),
        Shown::Codes(codes) => listed(codes.iter().map(ToString::to_string).collect()),
        Shown::Numbers(numbers) => listed(numbers.iter().map(ToString::to_string).collect()),
        Shown::Hex(hex) => hex,
        _ => String::new(),
    }
}

fn settings_of(device: &Device) -> Vec<SettingView> {
    let settings = device.settings().map(|(setting, value)| SettingView {
        id: &setting.id,
        name: &setting.name,
        value,
        min: setting.min.as_f64(),
        max: setting.max.as_f64(),
        unit: setting.unit.as_deref(),
    });
    settings.collect()
}
