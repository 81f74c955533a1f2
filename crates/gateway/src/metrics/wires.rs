//! What went over every wire, and to and from each of its units.

use std::collections::BTreeMap;
use std::fmt;

use busbar_link::{Link, Statistics, UnitStatistics, WireState};

use super::Out;

/// One wire at the time of the scrape.
#[derive(Debug)]
pub(super) struct WireSample {
    id: String,
    connected: bool,
    counted: Statistics,
}

impl WireSample {
    pub(super) fn of(id: &str, link: &Link) -> Self {
        let connected = matches!(*link.state().borrow(), WireState::Connected);
        Self { id: id.to_owned(), connected, counted: link.statistics() }
    }

    fn label(&self) -> [(&'static str, &str); 1] {
        [("wire", self.id.as_str())]
    }
}

type Counter<T> = (&'static str, &'static str, fn(&T) -> u64);

const OF_A_WIRE: [Counter<Statistics>; 17] = [
    ("wire_requests", "Requests sent, repeats included", |counted| counted.requests),
    ("wire_answers", "Answers taken, exceptions included", |counted| counted.answers),
    ("wire_timeouts", "Requests that nobody answered in time", |counted| counted.timeouts),
    ("wire_retries", "Reads that were sent once more", |counted| counted.retries),
    ("wire_late", "Answers that came after their time was up", |counted| counted.late),
    ("wire_wrong_unit", "Answers from another unit than the one asked", |counted| counted.wrong_unit),
    ("wire_wrong_function", "Answers with another function than the request", |counted| {
        counted.wrong_function
    }),
    ("wire_wrong_length", "Answers with more or less data than asked for", |counted| counted.wrong_length),
    ("wire_wrong_echo", "Confirmations of another write than was sent", |counted| counted.wrong_echo),
    ("wire_wrong_protocol", "Frames of another protocol than Modbus", |counted| counted.wrong_protocol),
    ("wire_crc_errors", "Frames whose checksum was wrong", |counted| counted.crc_errors),
    ("wire_garbage_bytes", "Bytes that belonged to no frame", |counted| counted.garbage_bytes),
    ("wire_echoes", "Own requests that a converter sent back", |counted| counted.echoes),
    ("wire_held", "Polls of silent units that were held back", |counted| counted.held),
    ("wire_reconnects", "Times the wire was connected again", |counted| counted.reconnects),
    ("wire_received_bytes", "Bytes received", |counted| counted.bytes_received),
    ("wire_sent_bytes", "Bytes sent", |counted| counted.bytes_sent),
];

const OF_A_UNIT: [Counter<UnitStatistics>; 10] = [
    ("unit_requests", "Requests sent to the unit, repeats included", |counted| counted.requests),
    ("unit_answers", "Answers of the unit, exceptions included", |counted| counted.answers),
    ("unit_timeouts", "Requests that the unit did not answer in time", |counted| counted.timeouts),
    ("unit_retries", "Reads that were sent to the unit once more", |counted| counted.retries),
    ("unit_held", "Polls held back while the unit was silent", |counted| counted.held),
    ("unit_late", "Answers of the unit after their time was up", |counted| counted.late),
    ("unit_crc_errors", "Frames with a wrong checksum while its answer was due", |counted| {
        counted.crc_errors
    }),
    ("unit_garbage_bytes", "Bytes of no frame while its answer was due", |counted| counted.garbage_bytes),
    ("unit_received_bytes", "Bytes received while its answer was due", |counted| counted.bytes_received),
    ("unit_sent_bytes", "Bytes sent to the unit", |counted| counted.bytes_sent),
];

pub(super) fn encode(wires: &[WireSample], out: &mut Out<'_>) -> fmt::Result {
    let connected = wires.iter().map(|wire| (wire.label(), u64::from(wire.connected)));
    out.gauges("wire_connected", "Whether the wire is connected", None, connected)?;
    for (name, help, count) in OF_A_WIRE {
        out.counters(name, help, wires.iter().map(|wire| (wire.label(), count(&wire.counted))))?;
    }
    out.latencies(wires)?;
    let exceptions = wires.iter().flat_map(|wire| {
        by_code(&wire.counted.exceptions)
            .map(|(code, count)| ([("wire", wire.id.clone()), ("code", code)], count))
    });
    out.counters("wire_exceptions", "Exceptions by code", exceptions)?;

    let units = || wires.iter().flat_map(|wire| wire.counted.units.iter().map(move |unit| (wire, unit)));
    let label = |wire: &WireSample, unit: &UnitStatistics| {
        vec![("wire", wire.id.clone()), ("unit", unit.unit.to_string())]
    };
    for (name, help, count) in OF_A_UNIT {
        out.counters(name, help, units().map(|(wire, unit)| (label(wire, unit), count(unit))))?;
    }
    let exceptions = units().flat_map(|(wire, unit)| {
        by_code(&unit.exceptions).map(move |(code, count)| {
            let mut labels = label(wire, unit);
            labels.push(("code", code));
            (labels, count)
        })
    });
    out.counters("unit_exceptions", "Exceptions of the unit by code", exceptions)
}

/// Counts by code; what is no code of the standard is one sum, so that no device can make up series.
fn by_code(counted: &BTreeMap<u8, u64>) -> impl Iterator<Item = (String, u64)> + use<> {
    let mut known: BTreeMap<Option<u8>, u64> = BTreeMap::new();
    for (code, count) in counted {
        *known.entry(Some(*code).filter(|code| matches!(code, 1..=8 | 10 | 11))).or_default() += count;
    }
    known
        .into_iter()
        .map(|(code, count)| (code.map_or_else(|| "other".to_owned(), |code| code.to_string()), count))
}

impl Out<'_> {
    /// How long answers took.
    fn latencies(&mut self, wires: &[WireSample]) -> fmt::Result {
        use prometheus_client::encoding::NoLabelSet;
        use prometheus_client::metrics::MetricType;

        let answered = wires.iter().map(|wire| (wire.label(), &wire.counted.latency));
        let unit = Some("seconds");
        self.family(
            "wire_latency",
            "Time from request to answer",
            unit,
            MetricType::Histogram,
            answered,
            |out, took| {
                let sum = took.total().as_secs_f64();
                let buckets: Vec<(f64, u64)> = took
                    .histogram()
                    .map(|(bound, count)| (bound.map_or(f64::INFINITY, |bound| bound.as_secs_f64()), count))
                    .collect();
                out.encode_histogram::<NoLabelSet>(sum, took.count(), &buckets, None)
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_that_a_device_makes_up_are_one_series() {
        let counted = BTreeMap::from([(2, 7), (0, 1), (9, 1), (200, 3), (255, 4)]);
        let told: Vec<_> = by_code(&counted).collect();
        assert_eq!(told, [("other".to_owned(), 9), ("2".to_owned(), 7)]);
    }
}
