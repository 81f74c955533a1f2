//! The wires of a site: opened, and shown as the API has them.

use std::time::Duration;

use busbar_link::{Endpoint, Link, OpenError, Options, Priority, Statistics, WireState};
use busbar_profile::Profile;
use busbar_profile::plan::Cost;

use crate::api::types::{self, ExceptionCount, WireStatistics, WireView};
use crate::site::{Site, SiteWire};

/// Opens a wire for the devices of the site that are on it.
pub(crate) fn open(site: &Site, index: usize, wire: &SiteWire) -> Result<Link, OpenError> {
    let devices: Vec<&Profile> =
        site.devices.iter().filter(|device| device.wire == index).map(|device| device.profile).collect();
    let longest = |of: fn(&Profile) -> u32| devices.iter().map(|profile| of(profile)).max();
    let timeout = longest(|profile| profile.wire.timeout_ms);
    let defaults = Options::default();
    let options = Options {
        timeout: wire.timeout.or(timeout.map(ms)).unwrap_or(defaults.timeout),
        // The wire has one pace, so the device that asks for the longest pause sets it.
        spacing: longest(|profile| profile.wire.spacing_ms).map_or(defaults.spacing, ms),
        // Every device has one read waiting at most.
        queue: defaults.queue.max(devices.len() + 16),
        ..defaults
    };
    Link::open(wire.endpoint.clone(), options)
}

/// The same wire for polling: whoever waits for an answer goes first.
pub(crate) fn for_polling(link: &Link) -> Link {
    link.with_priority(Priority::Poll)
}

/// What a read costs on a wire, for the planner.
pub(crate) fn cost(endpoint: &Endpoint, profile: &Profile) -> Cost {
    match endpoint {
        Endpoint::Rtu { serial, .. } => {
            Cost::rtu(serial.baud, u32::from(serial.bits_per_character()), profile.wire.answer_delay())
        }
        // A request is a round trip; the bytes hardly count.
        _ => Cost::tcp(ms(5), 1_000_000),
    }
}

/// A wire as the API shows it.
pub(crate) fn view(id: &str, link: &Link) -> WireView {
    let (state, reason) = match &*link.state().borrow() {
        WireState::Connected => (types::WireState::Connected, None),
        WireState::Down { reason, .. } => (types::WireState::Down, Some(reason.to_string())),
        _ => (types::WireState::Connecting, None),
    };
    WireView {
        id: id.to_owned(),
        endpoint: link.endpoint().to_string(),
        state,
        reason,
        statistics: statistics(&link.statistics()),
    }
}

fn statistics(counted: &Statistics) -> WireStatistics {
    let exceptions = counted.exceptions.iter();
    WireStatistics {
        requests: counted.requests,
        answers: counted.answers,
        timeouts: counted.timeouts,
        exceptions: exceptions.map(|(code, count)| ExceptionCount { code: *code, count: *count }).collect(),
        late: counted.late,
        crc_errors: counted.crc_errors,
        garbage: counted.garbage_bytes,
        reconnects: counted.reconnects,
        bytes_in: counted.bytes_received,
        bytes_out: counted.bytes_sent,
        latency_ms: counted.latency.mean().map(|mean| mean.as_micros() as f64 / 1_000.0),
    }
}

fn ms(ms: u32) -> Duration {
    Duration::from_millis(u64::from(ms))
}
