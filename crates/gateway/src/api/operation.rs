//! What the keepers of a machine ask: does it live, is it ready, and its numbers.

use std::sync::Arc;

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use tokio::sync::Mutex;
use tokio::task::spawn_blocking;

use super::Problem;
use crate::hub::Hub;
use crate::metrics;

/// Whether the gateway lives: requests are answered and the age of values is looked at.
#[utoipa::path(
    get, path = "/healthz", tag = "operation",
    responses(
        (status = OK, body = String, content_type = "text/plain", description = "It lives", example = "ok\n"),
        (status = SERVICE_UNAVAILABLE, body = Problem, content_type = "application/problem+json", description = "It hangs; start it again"),
    ),
)]
pub(super) async fn healthz(State(hub): State<Arc<Hub>>) -> Result<&'static str, Problem> {
    let Some(since) = hub.health().hangs(hub.now()) else { return Ok("ok\n") };
    let detail = format!(
        "the age of values has not been looked at for {} s; start the gateway again",
        since.as_secs()
    );
    Err(Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail))
}

/// Whether the gateway has something to show: each device has given its first values, or it is known why it cannot.
///
/// Once ready it stays so. That a device dies later, or that a newer site file adds one, takes no gateway out of
/// service: its page is where a person sees what is wrong.
#[utoipa::path(
    get, path = "/readyz", tag = "operation",
    responses(
        (status = OK, body = String, content_type = "text/plain", description = "It is ready", example = "ready\n"),
        (status = SERVICE_UNAVAILABLE, body = Problem, content_type = "application/problem+json", description = "Some devices were not asked yet"),
    ),
)]
pub(super) async fn readyz(State(hub): State<Arc<Hub>>) -> Result<&'static str, Problem> {
    const MOST_NAMED: usize = 12;
    let missing = hub.health().waits_for(&hub.table());
    if missing.is_empty() {
        return Ok("ready\n");
    }
    let mut named = missing.iter().take(MOST_NAMED).cloned().collect::<Vec<_>>().join(", ");
    if missing.len() > MOST_NAMED {
        named.push_str(&format!(" and {} more", missing.len() - MOST_NAMED));
    }
    let detail = format!("no first answer yet, and no fault either, of {named}; ask again in a moment");
    Err(Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail))
}

/// Values by signal and device, and what went over the wires: OpenMetrics text.
///
/// A value that is not good now has no sample. Names are `busbar_`, the signal with `_` for dots, and its unit in small
/// letters: `busbar_genset_power_active_kw{device="gen1"}`.
#[utoipa::path(
    get, path = "/metrics", tag = "operation",
    responses((
        status = OK, body = String, content_type = "application/openmetrics-text; version=1.0.0; charset=utf-8",
        description = "OpenMetrics 1.0",
    )),
)]
pub(super) async fn metrics(State(hub): State<Arc<Hub>>) -> Result<Response, Problem> {
    // Of a large site it is much text: one at a time, and away from the tasks that poll.
    static ONE: Mutex<()> = Mutex::const_new(());
    let one = ONE.lock().await;
    let text = spawn_blocking(move || metrics::text(&hub)).await;
    drop(one);
    match text {
        Ok(Ok(text)) => Ok(([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response()),
        _ => {
            let detail = "the numbers could not be put together; the log has more";
            Err(Problem::new(StatusCode::INTERNAL_SERVER_ERROR, detail))
        }
    }
}
