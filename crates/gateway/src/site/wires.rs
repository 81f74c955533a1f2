//! The wires of a site file.

use std::collections::HashMap;
use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use busbar_link::Endpoint;
use busbar_profile::Collector;
use busbar_profile::text::shown;

use super::reader::{At, Table};
use super::{SiteWire, keys, text};

const TIMEOUT: RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(60);
const SPACING: RangeInclusive<Duration> = Duration::ZERO..=Duration::from_secs(10);
const ENDPOINT_HELP: &str =
    "write an endpoint such as \"tcp://192.0.2.20:502\" or \"rtu:///dev/ttyUSB0?baud=9600\"";

/// The wires of the file, and how to find them.
#[derive(Default)]
pub(super) struct Wires {
    pub(super) placed: Vec<PlacedWire>,
    /// Indexes by id.
    by_id: HashMap<String, usize>,
    /// Ids by what is at the other end.
    by_end: HashMap<String, String>,
}

/// A wire and where the text has its id and endpoint.
pub(super) struct PlacedWire {
    pub(super) id: At<String>,
    /// None when its endpoint is wrong.
    pub(super) wire: Option<SiteWire>,
    pub(super) endpoint: Range<usize>,
}

impl Wires {
    pub(super) fn index(&self, id: &str) -> Option<usize> {
        self.by_id.get(id).copied()
    }

    pub(super) fn ids(&self) -> impl ExactSizeIterator<Item = &str> + Clone {
        self.placed.iter().map(|wire| wire.id.value.as_str())
    }
}

/// The wires in the order of the file; one whose id is right but whose endpoint is not still counts as defined.
pub(super) fn read(root: &Table<'_, '_>, findings: &mut Collector<'_>) -> Wires {
    let mut wires = Wires::default();
    for table in root.tables("wires", "[[wires]]", keys::WIRE, findings) {
        let id = text::id(&table, "wire", |id| wires.by_id.contains_key(id), findings);
        let endpoint =
            table.required("endpoint", "\"tcp://192.0.2.20:502\"", findings, |table, key, findings| {
                endpoint(table, key, &wires, findings)
            });
        let timeout = table.duration("timeout", TIMEOUT, findings).map(|timeout| timeout.value);
        let spacing = table.duration("spacing", SPACING, findings).map(|spacing| spacing.value);
        let trace = table.boolean("trace", findings).unwrap_or(false);

        let Some(id) = id else { continue };
        let at = endpoint.as_ref().map_or(0..0, |endpoint| endpoint.span.clone());
        let wire = endpoint.map(|endpoint| SiteWire {
            id: id.value.clone(),
            endpoint: endpoint.value,
            timeout,
            spacing,
            trace,
        });
        if let Some(wire) = &wire {
            wires.by_end.insert(end(&wire.endpoint), id.value.clone());
        }
        wires.by_id.insert(id.value.clone(), wires.placed.len());
        wires.placed.push(PlacedWire { id, wire, endpoint: at });
    }
    wires
}

fn endpoint(
    table: &Table<'_, '_>,
    key: &str,
    wires: &Wires,
    findings: &mut Collector<'_>,
) -> Option<At<Endpoint>> {
    let text = table.string(key, findings)?;
    match text.value.parse::<Endpoint>() {
        Ok(endpoint) => reachable(endpoint, text.span, wires, findings),
        Err(error) => {
            // The link's sentences hold the remedy behind the semicolon.
            let problem = error.problem.to_string();
            let (message, help) = problem.split_once("; ").unwrap_or((&problem, ENDPOINT_HELP));
            findings.add(text.span, format!("`{}` is no endpoint: {message}", shown(&text.value)), help);
            None
        }
    }
}

/// An endpoint that this version speaks, that something can listen on and that no other wire has: a controller takes
/// one client, and only on one wire do requests keep out of each other's way.
fn reachable(
    endpoint: Endpoint,
    span: Range<usize>,
    wires: &Wires,
    findings: &mut Collector<'_>,
) -> Option<At<Endpoint>> {
    let named = shown(&endpoint.to_string());
    let refused = match &endpoint {
        Endpoint::Tls { .. } => Some((
            format!("`{named}` cannot be spoken: this version has no TLS"),
            "write a tcp:// endpoint; a TLS tunnel in front of the device, such as stunnel, can carry it"
                .into(),
        )),
        Endpoint::Tcp { port: 0, .. } | Endpoint::RtuTcp { port: 0, .. } => Some((
            format!("`{named}` cannot be connected to: nothing listens on port 0"),
            "write the port of the device, or leave it out for the usual one".into(),
        )),
        // A new pseudo-terminal is for an imitation to listen on; nobody is at the other end of ours.
        Endpoint::Rtu { path, .. } if path == "pty" => Some((
            format!("`{named}` cannot be connected to: `pty` is no serial device"),
            "write the device that the imitation printed, such as \"rtu:///dev/pts/3\"".into(),
        )),
        endpoint => wires.by_end.get(&end(endpoint)).map(|id| {
            (
                format!("`{named}` is the endpoint of the wire `{id}` already"),
                format!("put all devices that are reached through it on the wire `{id}`"),
            )
        }),
    };
    match refused {
        Some((message, help)) => {
            findings.add(span, message, help);
            None
        }
        None => Some(At { value: endpoint, span }),
    }
}

/// What is at the other end: a line is one line however it is set, and a port speaks one kind of framing.
fn end(endpoint: &Endpoint) -> String {
    match endpoint {
        Endpoint::Rtu { path, .. } => path.clone(),
        other => {
            let text = other.to_string().to_ascii_lowercase();
            text.split_once("://").map_or(text.clone(), |(_, end)| end.to_owned())
        }
    }
}
