//! The event stream: the whole state first, then what changes, for each reader at its own pace.
//!
//! `hub` hands in what happens; `event` writes it once, `ring` keeps the latest of it, `channel` wakes the readers. A
//! `reader` is told the whole state by `whole`, device by device as it takes it, and follows the ring from there; one
//! that falls out of the ring is told the whole state again, so one that never reads costs little and holds up nobody.
//! `filter` picks what a reader asked for, `deflate` compresses what many share once.

mod channel;
mod deflate;
mod event;
mod filter;
#[cfg(test)]
mod interleaved;
mod reader;
mod ring;
#[cfg(test)]
mod tests;
mod whole;

use std::convert::Infallible;
use std::sync::Arc;

use axum::body::Body;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, stream};

pub(crate) use self::channel::{Channel, beat};
pub(crate) use self::event::Draft;
use self::filter::Wish;
use self::reader::Reader;
use crate::api::{EventsQuery, Problem};
use crate::hub::Hub;

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");

/// The answer to `/api/v1/events`: endless, ends with the gateway.
pub(crate) fn response(hub: Arc<Hub>, query: &EventsQuery, headers: &HeaderMap) -> Result<Response, Problem> {
    let wish = Wish::new(query, &hub.table())?;
    let last = match headers.get(LAST_EVENT_ID) {
        Some(id) => id.to_str().ok(),
        None => query.last_event_id.as_deref(),
    };
    let accepted = headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
    let gzip = deflate::accepts_gzip(&accepted.collect::<Vec<_>>().join(","));

    let reader = Reader::new(hub, wish, last, gzip);
    let chunks = stream::unfold(reader, async |mut reader| {
        let chunk = reader.next().await?;
        Some((Ok::<_, Infallible>(chunk), reader))
    });
    let headers = [
        (header::CONTENT_TYPE, "text/event-stream"),
        (header::CACHE_CONTROL, "no-cache"),
        (header::VARY, "accept-encoding"),
        // nginx would hold events back otherwise.
        (HeaderName::from_static("x-accel-buffering"), "no"),
    ];
    // An unfold that is polled after its end panics.
    let mut response = (headers, Body::from_stream(chunks.fuse())).into_response();
    if gzip {
        response.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    Ok(response)
}
