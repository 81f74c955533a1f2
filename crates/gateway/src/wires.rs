//! The wires of a site: opened, and shown as the API has them.

pub(crate) mod frames;
mod plan;

use std::collections::BTreeMap;
use std::time::Duration;

use busbar_link::{
    Endpoint, Latency, Link, OpenError, Options, Priority, Statistics, UnitState, UnitStatistics, WireState,
};
use busbar_profile::Profile;
use busbar_profile::plan::Cost;

use crate::api::types::{
    self, ExceptionCount, LatencyBucket, LatencyView, UnitView, WireDetailView, WireStatistics, WireTime,
    WireView,
};
use crate::poll_plan::Overview;
use crate::site::{SiteDevice, SiteWire};

/// Opens a wire for devices of these profiles.
pub(crate) fn open(wire: &SiteWire, profiles: &[&Profile]) -> Result<Link, OpenError> {
    Link::open(wire.endpoint.clone(), options(wire, profiles))
}

/// How a wire with devices of these profiles behaves.
fn options(wire: &SiteWire, profiles: &[&Profile]) -> Options {
    let longest = profiles.iter().map(|profile| profile.wire.timeout_ms).max();
    let defaults = Options::default();
    Options {
        timeout: wire.timeout.or(longest.map(ms)).unwrap_or(defaults.timeout),
        // The pauses of a device are for the others on the wire to use: they are kept by unit.
        spacing: wire.spacing.unwrap_or(defaults.spacing),
        // Every device has one read waiting at most, and a reload may add devices.
        queue: defaults.queue.max(256 + 16),
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
    // Over TCP a request is a round trip; the bytes hardly count.
    let cost = line_cost(endpoint, profile).unwrap_or(Cost::tcp(ms(5), 1_000_000));
    cost.spaced(spacing(profile))
}

/// What a read takes of the time of a line whose speed is known.
pub(crate) fn line_cost(endpoint: &Endpoint, profile: &Profile) -> Option<Cost> {
    match endpoint {
        Endpoint::Rtu { serial, .. } => {
            let bits = u32::from(serial.bits_per_character());
            Some(Cost::rtu(serial.baud, bits, profile.wire.answer_delay()))
        }
        _ => None,
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
    WireStatistics {
        requests: counted.requests,
        answers: counted.answers,
        timeouts: counted.timeouts,
        retries: counted.retries,
        exceptions: exceptions(&counted.exceptions),
        late: counted.late,
        wrong_unit: counted.wrong_unit,
        wrong_function: counted.wrong_function,
        wrong_length: counted.wrong_length,
        wrong_echo: counted.wrong_echo,
        wrong_protocol: counted.wrong_protocol,
        crc_errors: counted.crc_errors,
        garbage: counted.garbage_bytes,
        echoes: counted.echoes,
        held: counted.held,
        reconnects: counted.reconnects,
        bytes_in: counted.bytes_received,
        bytes_out: counted.bytes_sent,
        latency_ms: counted.latency.mean().map(in_ms),
    }
}

/// A wire in detail, with the plans of the devices on it.
pub(crate) fn detail(id: &str, link: &Link, devices: &[(SiteDevice, Overview)]) -> WireDetailView {
    let counted = link.statistics();
    WireDetailView {
        wire: view(id, link),
        latency: latency(&counted.latency),
        open_s: rounded(counted.open_for.as_secs_f64()),
        time: time(link.endpoint(), counted.open_for, counted.busy, counted.waiting),
        units: counted
            .units
            .iter()
            .map(|unit| self::unit(link.endpoint(), &counted, unit, devices))
            .collect(),
        plans: devices.iter().map(|(device, plan)| plan::view(link.endpoint(), device, plan)).collect(),
    }
}

fn unit(
    endpoint: &Endpoint,
    wire: &Statistics,
    counted: &UnitStatistics,
    devices: &[(SiteDevice, Overview)],
) -> UnitView {
    let device = devices.iter().find(|(device, _)| device.unit == counted.unit);
    let (state, next_probe) = match counted.state {
        UnitState::Answering => (types::UnitState::Answering, None),
        UnitState::Missing => (types::UnitState::Missing, None),
        UnitState::Silent { next_probe } => (types::UnitState::Silent, Some(next_probe)),
        _ => (types::UnitState::Unknown, None),
    };
    UnitView {
        unit: counted.unit,
        device: device.map(|(device, _)| device.id.clone()),
        state,
        next_probe_s: next_probe.map(|next_probe| next_probe.as_secs_f64()),
        requests: counted.requests,
        answers: counted.answers,
        timeouts: counted.timeouts,
        retries: counted.retries,
        held: counted.held,
        exceptions: exceptions(&counted.exceptions),
        late: counted.late,
        crc_errors: counted.crc_errors,
        garbage: counted.garbage_bytes,
        bytes_in: counted.bytes_received,
        bytes_out: counted.bytes_sent,
        latency: latency(&counted.latency),
        time: time(endpoint, wire.open_for, counted.busy, counted.waiting),
    }
}

/// How much of the time that a wire has been open was used, and how.
fn time(endpoint: &Endpoint, open_for: Duration, busy: Duration, waiting: Duration) -> WireTime {
    let share = |part: Duration| match open_for.as_secs_f64() {
        open if open > 0.0 => rounded(part.as_secs_f64() / open).min(1.0),
        _ => 0.0,
    };
    // Only of a line of our own is the speed known.
    let busy = matches!(endpoint, Endpoint::Rtu { .. }).then_some(busy);
    WireTime {
        busy_s: busy.map(|busy| rounded(busy.as_secs_f64())),
        waiting_s: rounded(waiting.as_secs_f64()),
        busy_share: busy.map(share),
        waiting_share: share(waiting),
    }
}

/// To four decimals.
fn rounded(number: f64) -> f64 {
    (number * 10_000.0).round() / 10_000.0
}

fn latency(counted: &Latency) -> LatencyView {
    LatencyView {
        count: counted.count(),
        min_ms: counted.min().map(in_ms),
        mean_ms: counted.mean().map(in_ms),
        max_ms: counted.max().map(in_ms),
        buckets: counted
            .histogram()
            .map(|(bound, count)| LatencyBucket { up_to_ms: bound.map(in_ms), count })
            .collect(),
    }
}

fn exceptions(counted: &BTreeMap<u8, u64>) -> Vec<ExceptionCount> {
    counted.iter().map(|(code, count)| ExceptionCount { code: *code, count: *count }).collect()
}

fn in_ms(duration: Duration) -> f64 {
    duration.as_micros() as f64 / 1_000.0
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
        SiteWire { id: "w1".to_owned(), endpoint, timeout: None, spacing: None, trace: false }
    }

    #[test]
    fn a_wire_has_its_own_pause_and_the_longest_time_out_of_its_devices() {
        let datakom = busbar_profile::builtin("datakom-d").unwrap();
        let hat = busbar_profile::builtin("smartgen-hat821si").unwrap();
        let plain = options(&wire(), &[smartgen(), hat, datakom]);
        assert_eq!((plain.spacing, plain.timeout), (Duration::ZERO, ms(1_500)));
        let slow = SiteWire { spacing: Some(ms(20)), timeout: Some(ms(300)), ..wire() };
        let set = options(&slow, &[hat]);
        assert_eq!((set.spacing, set.timeout), (ms(20), ms(300)));
    }

    #[test]
    fn the_time_of_a_line_is_shared_out_and_that_of_tcp_is_not_claimed() {
        let line: Endpoint = "rtu:///dev/a".parse().unwrap();
        let used = time(&line, ms(10_000), ms(2_500), ms(400));
        assert_eq!((used.busy_s, used.busy_share), (Some(2.5), Some(0.25)));
        assert_eq!((used.waiting_s, used.waiting_share), (0.4, 0.04));
        let tcp = time(&wire().endpoint, ms(10_000), Duration::ZERO, ms(400));
        assert_eq!((tcp.busy_s, tcp.busy_share, tcp.waiting_share), (None, None, 0.04));
        let fresh = time(&line, Duration::ZERO, Duration::ZERO, Duration::ZERO);
        assert_eq!((fresh.busy_share, fresh.waiting_share), (Some(0.0), 0.0));
    }

    #[test]
    fn a_pause_is_part_of_what_a_read_costs() {
        let wire = wire();
        assert_eq!(cost(&wire.endpoint, smartgen()), Cost::tcp(ms(505), 1_000_000));
    }
}
