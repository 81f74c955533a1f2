//! The event stream: a snapshot first, then what changes, for each reader at its own pace.
//!
//! All readers share one bounded ring of events, each written once as bytes. A reader that falls out of it gets a
//! fresh snapshot, so one that never reads costs a socket buffer and nothing else.

use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, stream};
use serde::Serialize;
use tokio::sync::broadcast::{self, error::RecvError};

use crate::hub::Hub;
use crate::stop::Stop;

/// Proxies close what says nothing for long.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// What changed, ready to be sent.
#[derive(Debug)]
pub(crate) enum Event {
    /// One device.
    Device {
        key: u64,
        /// Counts up for each device.
        sequence: u64,
        frames: Bytes,
    },
    /// What is known of the site file.
    Site { frames: Bytes },
    /// The devices and wires themselves.
    Exchanged,
}

/// Appends one server-sent event. JSON has no line breaks of its own, so one `data` line holds it.
pub(crate) fn frame(out: &mut Vec<u8>, name: &str, data: &impl Serialize) {
    let start = out.len();
    out.extend_from_slice(b"event: ");
    out.extend_from_slice(name.as_bytes());
    out.extend_from_slice(b"\ndata: ");
    // Our types serialise; should one ever not, its event is left out rather than sent broken.
    match serde_json::to_writer(&mut *out, data) {
        Ok(()) => out.extend_from_slice(b"\n\n"),
        Err(_) => out.truncate(start),
    }
}

/// The answer to `/api/v1/events`: endless, ends with the gateway.
pub(crate) fn response(hub: Arc<Hub>, only: Option<u64>) -> Response {
    let reader = Reader::new(hub, only);
    let chunks = stream::unfold(reader, async |mut reader| {
        let chunk = reader.next().await?;
        Some((Ok::<_, Infallible>(chunk), reader))
    });
    let headers = [
        (header::CONTENT_TYPE, "text/event-stream"),
        (header::CACHE_CONTROL, "no-cache"),
        // nginx would hold events back otherwise.
        (header::HeaderName::from_static("x-accel-buffering"), "no"),
    ];
    // An unfold that is polled after its end panics.
    (headers, Body::from_stream(chunks.fuse())).into_response()
}

/// One reader of the stream.
struct Reader {
    hub: Arc<Hub>,
    only: Option<u64>,
    events: broadcast::Receiver<Arc<Event>>,
    /// By key of the device: the last event that the reader has seen, in a snapshot or by itself.
    seen: HashMap<u64, u64>,
    behind: bool,
    stop: Stop,
}

impl Reader {
    fn new(hub: Arc<Hub>, only: Option<u64>) -> Self {
        let (events, stop) = (hub.subscribe(), hub.stop());
        Self { hub, only, events, seen: HashMap::new(), behind: true, stop }
    }

    /// The next bytes to send; none at the end.
    async fn next(&mut self) -> Option<Bytes> {
        if std::mem::take(&mut self.behind) {
            return Some(self.snapshot());
        }
        loop {
            let event = tokio::select! {
                biased;
                () = self.stop.requested() => return None,
                event = self.events.recv() => event,
                () = tokio::time::sleep(KEEP_ALIVE) => return Some(Bytes::from_static(b": keep-alive\n\n")),
            };
            match event {
                Ok(event) => match &*event {
                    Event::Exchanged => return Some(self.snapshot()),
                    Event::Site { frames } => return Some(frames.clone()),
                    Event::Device { key, sequence, frames } => {
                        if self.is_news(*key, *sequence) {
                            return Some(frames.clone());
                        }
                    }
                },
                Err(RecvError::Lagged(_)) => return Some(self.snapshot()),
                Err(RecvError::Closed) => return None,
            }
        }
    }

    /// Whether the reader asked for this event and does not have it already.
    fn is_news(&mut self, key: u64, sequence: u64) -> bool {
        if self.only.is_some_and(|only| only != key) {
            return false;
        }
        let Some(seen) = self.seen.get_mut(&key) else { return false };
        let news = sequence > *seen;
        *seen = sequence.max(*seen);
        news
    }

    /// Everything as it stands. What is still in the ring is older and would only be passed over.
    fn snapshot(&mut self) -> Bytes {
        self.events = self.events.resubscribe();
        let (snapshot, seen) = self.hub.snapshot(self.only);
        self.seen = seen;
        let mut out = Vec::new();
        frame(&mut out, "snapshot", &snapshot);
        out.into()
    }
}

#[cfg(test)]
mod tests {
    use busbar_profile::Rate;

    use super::*;
    use crate::stop::{self, Announcer};
    use crate::testing::{answered, hub};

    const FAST: [u16; 12] = [0, 1, 0, 0, 2302, 0, 215, 0, 0, 0, 0, 0];

    fn voltage(tenths: u16) -> [u16; 12] {
        let mut registers = FAST;
        registers[4] = tenths;
        registers
    }

    fn site() -> (Arc<Hub>, Announcer) {
        let (announcer, stop) = stop::channel();
        (Arc::new(hub(&["gen1", "gen2"], stop)), announcer)
    }

    fn round(hub: &Hub, device: usize, registers: &[u16]) {
        hub.finish(&hub.table().devices[device], answered(Rate::Fast, &[(100, registers)]));
    }

    /// The events of a chunk: name and data.
    fn events(chunk: &Bytes) -> Vec<(String, serde_json::Value)> {
        let text = std::str::from_utf8(chunk).unwrap();
        let parse = |event: &str| {
            let (name, data) = event.split_once("\ndata: ").unwrap();
            (name.strip_prefix("event: ").unwrap().to_owned(), serde_json::from_str(data).unwrap())
        };
        text.split_terminator("\n\n").map(parse).collect()
    }

    async fn next(reader: &mut Reader) -> Vec<(String, serde_json::Value)> {
        events(&reader.next().await.unwrap())
    }

    #[tokio::test]
    async fn a_snapshot_first_then_what_changes() {
        let (hub, _announcer) = site();
        round(&hub, 0, &FAST);
        let mut reader = Reader::new(Arc::clone(&hub), None);

        let first = next(&mut reader).await;
        assert_eq!(first[0].0, "snapshot");
        let devices = first[0].1["devices"].as_array().unwrap();
        assert_eq!(devices.len(), 2);
        assert_eq!(devices[0]["device"]["online"], true);
        assert_eq!(devices[1]["device"]["online"], false);

        round(&hub, 0, &voltage(2310));
        let second = next(&mut reader).await;
        assert_eq!(second.len(), 1, "{second:?}");
        assert_eq!((second[0].0.as_str(), &second[0].1["device"]), ("values", &"gen1".into()));
        let changed = second[0].1["changed"].as_array().unwrap();
        assert_eq!((changed.len(), &changed[0]["value"]), (1, &231.into()));

        // A round that changed nothing says that everything was read.
        round(&hub, 0, &voltage(2310));
        assert_eq!(next(&mut reader).await[0].1["changed"], serde_json::json!([]));
    }

    #[tokio::test]
    async fn an_alarm_is_told_with_the_device_it_changes() {
        let (hub, _announcer) = site();
        round(&hub, 0, &FAST);
        let mut reader = Reader::new(Arc::clone(&hub), None);
        next(&mut reader).await;
        let mut alarmed = FAST;
        alarmed[10] = 1;
        round(&hub, 0, &alarmed);
        let told = next(&mut reader).await;
        assert_eq!(
            told.iter().map(|event| event.0.as_str()).collect::<Vec<_>>(),
            ["values", "alarms", "device"]
        );
        assert_eq!(told[1].1["alarms"][0]["id"], "low_oil");
        assert_eq!(told[2].1["alarms"]["shutdown"], 1);
    }

    #[tokio::test]
    async fn what_a_snapshot_holds_is_not_told_again() {
        let (hub, _announcer) = site();
        round(&hub, 0, &FAST);
        round(&hub, 0, &FAST);
        let mut reader = Reader::new(Arc::clone(&hub), None);
        next(&mut reader).await;
        // Two rounds of the first device are in the snapshot, none of the second.
        let [first, second] = [0, 1].map(|device: usize| hub.table().devices[device].key);
        assert!(!reader.is_news(first, 2));
        assert!(reader.is_news(first, 3));
        assert!(!reader.is_news(first, 3));
        assert!(reader.is_news(second, 1));
    }

    #[tokio::test]
    async fn what_happened_before_the_snapshot_is_in_it() {
        let (hub, _announcer) = site();
        let mut reader = Reader::new(Arc::clone(&hub), None);
        round(&hub, 0, &voltage(2310));
        assert!(next(&mut reader).await[0].1.to_string().contains("231"));
        round(&hub, 0, &voltage(2320));
        assert_eq!(next(&mut reader).await[0].1["changed"][0]["value"], 232);
    }

    #[tokio::test]
    async fn a_reader_that_fell_behind_gets_a_snapshot() {
        let (hub, _announcer) = site();
        let mut reader = Reader::new(Arc::clone(&hub), None);
        next(&mut reader).await;
        for step in 0..1_000 {
            round(&hub, 0, &voltage(2_000 + step));
        }
        let told = next(&mut reader).await;
        assert_eq!(told[0].0, "snapshot");
        assert!(told[0].1.to_string().contains("299.9"), "as it stands now");
        round(&hub, 1, &FAST);
        let told = next(&mut reader).await;
        assert_eq!((told[0].0.as_str(), &told[0].1["device"]), ("values", &"gen2".into()));
    }

    #[tokio::test]
    async fn a_reader_of_one_device_hears_of_no_other() {
        let (hub, _announcer) = site();
        let mut reader = Reader::new(Arc::clone(&hub), Some(hub.table().devices[1].key));
        let first = next(&mut reader).await;
        assert_eq!(first[0].1["devices"].as_array().unwrap().len(), 1);
        round(&hub, 0, &FAST);
        round(&hub, 1, &FAST);
        assert_eq!(next(&mut reader).await[0].1["device"], "gen2");
    }

    #[tokio::test(start_paused = true)]
    async fn silence_is_kept_alive() {
        let (hub, _announcer) = site();
        let mut reader = Reader::new(hub, None);
        next(&mut reader).await;
        let before = tokio::time::Instant::now();
        assert_eq!(reader.next().await.unwrap(), ": keep-alive\n\n");
        assert_eq!(before.elapsed(), KEEP_ALIVE);
    }

    #[tokio::test]
    async fn the_stream_ends_with_the_gateway() {
        let (hub, announcer) = site();
        let mut reader = Reader::new(hub, None);
        next(&mut reader).await;
        announcer.announce();
        assert_eq!(reader.next().await, None);
    }
}
