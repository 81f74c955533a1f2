//! The wires of a site: opened, and shown as the API has them.

use std::time::Duration;

use busbar_link::{Endpoint, Link, OpenError, Options, Priority, Statistics, WireState};
use busbar_profile::Profile;
use busbar_profile::plan::Cost;

use crate::api::types::{self, ExceptionCount, WireStatistics, WireView};
use crate::site::{Site, SiteWire};

/// Opens a wire for the devices of the site that are on it.
pub(crate) fn open(site: &Site, index: usize, wire: &SiteWire) -> Result<Link, OpenError> {
    let devices = site.devices.iter().filter(|device| device.wire == index);
    let profiles: Vec<&Profile> = devices.map(|device| device.profile).collect();
    Link::open(wire.endpoint.clone(), options(wire, &profiles))
}

/// How a wire with devices of these profiles behaves.
fn options(wire: &SiteWire, profiles: &[&Profile]) -> Options {
    let longest = profiles.iter().map(|profile| profile.wire.timeout_ms).max();
    let defaults = Options::default();
    Options {
        timeout: wire.timeout.or(longest.map(ms)).unwrap_or(defaults.timeout),
        // Where there are several, the pauses of one are for the others to use: its poller keeps them.
        spacing: match profiles {
            [alone] => spacing(alone),
            _ => defaults.spacing,
        },
        // Every device has one read waiting at most.
        queue: defaults.queue.max(profiles.len() + 16),
        ..defaults
    }
}

/// The pause that a device wants after each of its reads.
pub(crate) fn spacing(profile: &Profile) -> Duration {
    ms(profile.wire.spacing_ms)
}

/// The same wire for polling: whoever waits for an answer goes first.
pub(crate) fn for_polling(link: &Link) -> Link {
    link.with_priority(Priority::Poll)
}

/// What a read costs on a wire, for the planner.
pub(crate) fn cost(endpoint: &Endpoint, profile: &Profile) -> Cost {
    let cost = match endpoint {
        Endpoint::Rtu { serial, .. } => {
            Cost::rtu(serial.baud, u32::from(serial.bits_per_character()), profile.wire.answer_delay())
        }
        // A request is a round trip; the bytes hardly count.
        _ => Cost::tcp(ms(5), 1_000_000),
    };
    cost.spaced(spacing(profile))
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
        wrong_unit: counted.wrong_unit,
        wrong_function: counted.wrong_function,
        wrong_length: counted.wrong_length,
        wrong_echo: counted.wrong_echo,
        wrong_protocol: counted.wrong_protocol,
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

#[cfg(test)]
mod tests {
    use super::*;

    fn smartgen() -> &'static Profile {
        busbar_profile::builtin("smartgen-acc1700").unwrap()
    }

    fn wire() -> SiteWire {
        let endpoint = "tcp://192.0.2.7:502".parse().unwrap();
        SiteWire { id: "w1".to_owned(), endpoint, timeout: None }
    }

    #[test]
    fn a_wire_has_the_pace_of_the_one_device_on_it() {
        let datakom = busbar_profile::builtin("datakom-d").unwrap();
        assert_eq!(options(&wire(), &[smartgen()]).spacing, ms(500));
        assert_eq!(options(&wire(), &[smartgen(), datakom]).spacing, Duration::ZERO);
    }

    #[test]
    fn a_pause_is_part_of_what_a_read_costs() {
        let wire = wire();
        assert_eq!(cost(&wire.endpoint, smartgen()), Cost::tcp(ms(505), 1_000_000));
    }
}
