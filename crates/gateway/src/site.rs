//! The site file: which wires and devices there are. TOML, checked as a whole before anything starts.

mod checks;
mod hosts;
mod reader;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::ops::Range;
use std::ops::RangeInclusive;
use std::time::Duration;

use busbar_link::Endpoint;
use busbar_profile::{Collector, Finding, Findings, Profile, WordOrder};
use toml::de::DeTable;

use self::checks::{PlacedDevice, PlacedWire};
use self::reader::{At, Table};

/// Where the gateway listens unless it is told otherwise: this machine only.
pub const DEFAULT_LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);

const TIMEOUT: RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(60);
const SPACING: RangeInclusive<Duration> = Duration::ZERO..=Duration::from_secs(10);
const POLL: RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(3600);

/// A site: its wires and the devices on them. Everything in it has been checked.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Site {
    /// What the page calls it.
    pub name: String,
    /// Where the gateway listens.
    pub listen: SocketAddr,
    /// Host names that a gateway for this machine alone answers to besides this machine's own: those of a proxy.
    pub hosts: Vec<String>,
    /// The wires, in the order of the file; ids are unique.
    pub wires: Vec<SiteWire>,
    /// The devices, in the order of the file; ids are unique.
    pub devices: Vec<SiteDevice>,
    /// What may well work and still deserves a look, in the order of the file.
    pub warnings: Vec<Finding>,
}

/// One wire of a site.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SiteWire {
    /// Its id.
    pub id: String,
    /// Where it leads.
    pub endpoint: Endpoint,
    /// How long to wait for an answer; none: as long as the profiles of its devices say.
    pub timeout: Option<Duration>,
    /// Least pause between an exchange and the next request, whichever unit they are with; none: no more than the
    /// line and its devices need.
    pub spacing: Option<Duration>,
    /// Whether every frame on it is logged.
    pub trace: bool,
}

impl SiteWire {
    /// Whether the two are one line, used in one way, so that it need not be opened anew.
    pub(crate) fn is_same_line(&self, other: &Self) -> bool {
        // Its frames can be shown and hidden while it runs.
        let Self { id, endpoint, timeout, spacing, trace: _ } = self;
        *id == other.id
            && *endpoint == other.endpoint
            && *timeout == other.timeout
            && *spacing == other.spacing
    }
}

/// One device of a site.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SiteDevice {
    /// Its id, as the API's addresses have it.
    pub id: String,
    /// Its name; the id where the file gives none.
    pub name: String,
    /// What it is.
    pub profile: &'static Profile,
    /// Index of its wire in [`Site::wires`].
    pub wire: usize,
    /// Its unit id on that wire.
    pub unit: u8,
    /// Word order of its 32-bit numbers.
    pub word_order: WordOrder,
    /// How often it is polled.
    pub poll: Poll,
}

impl SiteDevice {
    /// Whether the two are one device, read in one way. Which wire it is on is not looked at.
    pub(crate) fn is_same_device(&self, other: &Self) -> bool {
        let Self { id, name, profile, wire: _, unit, word_order, poll } = self;
        *id == other.id
            && *name == other.name
            && std::ptr::eq(*profile, other.profile)
            && *unit == other.unit
            && *word_order == other.word_order
            && *poll == other.poll
    }
}

/// How often a device is polled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Poll {
    /// Interval of the fast points.
    pub fast: Duration,
    /// Interval of the slow points.
    pub slow: Duration,
}

impl Default for Poll {
    fn default() -> Self {
        Self { fast: Duration::from_secs(1), slow: Duration::from_secs(10) }
    }
}

impl Site {
    /// Reads and checks a site file.
    ///
    /// `file` only serves the findings.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with the text, with line, column and remedy.
    pub fn parse(file: &str, text: &str) -> Result<Self, Findings> {
        let mut findings = Collector::new(file, text);
        let (root, errors) = DeTable::parse_recoverable(text);
        for error in errors {
            findings.add(
                error.span().unwrap_or(0..0),
                format!("this is not TOML: {}", error.message().replace('\n', ", ")),
                "mend the syntax; https://toml.io shows it",
            );
        }
        // After a syntax error the rest of the text means who knows what.
        findings.finish()?;

        let mut findings = Collector::new(file, text);
        let mut warnings = Collector::new(file, text);
        let root = Table::new("a site file", KEYS, root.get_ref(), 0..0, &mut findings);
        let site = read(&root, &mut findings, &mut warnings);
        findings.finish()?;
        let warnings = warnings.finish().err().into_iter().flatten().collect();
        Ok(Self { warnings, ..site })
    }
}

const ENDPOINT_HELP: &str =
    "write an endpoint such as \"tcp://192.0.2.20:502\" or \"rtu:///dev/ttyUSB0?baud=9600\"";
const KEYS: &[&str] = &["site", "server", "wires", "devices"];
const SITE_KEYS: &[&str] = &["name"];
const SERVER_KEYS: &[&str] = &["listen", "hosts"];
const WIRE_KEYS: &[&str] = &["id", "endpoint", "timeout", "spacing", "trace"];
const DEVICE_KEYS: &[&str] = &["id", "name", "profile", "wire", "unit", "word_order", "poll"];
const POLL_KEYS: &[&str] = &["fast", "slow"];

/// What stands in for a part that has been reported missing or wrong is never seen: the findings stop it.
fn read(root: &Table<'_, '_>, findings: &mut Collector<'_>, warnings: &mut Collector<'_>) -> Site {
    let site = root.required("site", "{ name = \"North hospital\" }", findings, |root, key, findings| {
        root.table(key, "[site]", SITE_KEYS, findings)
    });
    let name = site.and_then(|site| {
        site.required("name", "\"North hospital\"", findings, |site, key, findings| name(site, key, findings))
    });
    let server = root.table("server", "[server]", SERVER_KEYS, findings);
    let listen = server.as_ref().and_then(|server| listen(server, findings)).unwrap_or(DEFAULT_LISTEN);
    let hosts = server.as_ref().map(|server| hosts::read(server, findings)).unwrap_or_default();
    let wires = wires(root, findings);
    let devices = devices(root, &wires, findings);
    checks::serial(&wires, &devices, findings);
    checks::crowded(&wires, &devices, warnings);
    checks::doubtful_units(&devices, warnings);
    Site {
        name: name.unwrap_or_default(),
        listen,
        hosts,
        wires: wires.into_iter().filter_map(|wire| wire.wire).collect(),
        devices: devices.into_iter().map(|placed| placed.device).collect(),
        warnings: Vec::new(),
    }
}

fn listen(server: &Table<'_, '_>, findings: &mut Collector<'_>) -> Option<SocketAddr> {
    let text = server.string("listen", findings)?;
    let address = text.value.parse().ok();
    if address.is_none() {
        findings.add(
            text.span,
            format!("`{}` is no address to listen on", text.value),
            format!(
                "write an IP address, a colon and a port, such as \"{DEFAULT_LISTEN}\" for this machine only or \
                 \"0.0.0.0:8080\" for the network"
            ),
        );
    }
    address
}

/// The wires by id; one whose id is right but whose endpoint is not still counts as defined.
fn wires(root: &Table<'_, '_>, findings: &mut Collector<'_>) -> Vec<PlacedWire> {
    let mut wires: Vec<PlacedWire> = Vec::new();
    for table in root.tables("wires", "[[wires]]", WIRE_KEYS, findings) {
        let id = id(&table, "wire", wires.iter().map(|wire| wire.id.as_str()), findings);
        let endpoint =
            table.required("endpoint", "\"tcp://192.0.2.20:502\"", findings, |table, key, findings| {
                endpoint(table, key, &wires, findings)
            });
        let timeout = table.duration("timeout", TIMEOUT, findings).map(|timeout| timeout.value);
        let spacing = table.duration("spacing", SPACING, findings).map(|spacing| spacing.value);
        let trace = table.boolean("trace", findings).unwrap_or(false);
        if let Some(id) = id {
            let at = endpoint.as_ref().map_or(0..0, |endpoint| endpoint.span.clone());
            let wire = endpoint.map(|endpoint| SiteWire {
                id: id.clone(),
                endpoint: endpoint.value,
                timeout,
                spacing,
                trace,
            });
            wires.push(PlacedWire { id, wire, endpoint: at });
        }
    }
    wires
}

fn endpoint(
    table: &Table<'_, '_>,
    key: &str,
    wires: &[PlacedWire],
    findings: &mut Collector<'_>,
) -> Option<At<Endpoint>> {
    let text = table.string(key, findings)?;
    match text.value.parse::<Endpoint>() {
        Ok(endpoint) => reachable(endpoint, text.span, wires, findings),
        Err(error) => {
            // The link's sentences hold the remedy behind the semicolon.
            let problem = error.problem.to_string();
            let (message, help) = problem.split_once("; ").unwrap_or((&problem, ENDPOINT_HELP));
            findings.add(text.span, format!("`{}` is no endpoint: {message}", text.value), help);
            None
        }
    }
}

/// An endpoint that this version speaks, that something can listen on and that no other wire has: a controller takes
/// one client, and only on one wire do requests keep out of each other's way.
fn reachable(
    endpoint: Endpoint,
    span: Range<usize>,
    wires: &[PlacedWire],
    findings: &mut Collector<'_>,
) -> Option<At<Endpoint>> {
    let refused = match &endpoint {
        Endpoint::Tls { .. } => Some((
            format!("`{endpoint}` cannot be spoken: this version has no TLS"),
            "write a tcp:// endpoint; a TLS tunnel in front of the device, such as stunnel, can carry it"
                .into(),
        )),
        Endpoint::Tcp { port: 0, .. } | Endpoint::RtuTcp { port: 0, .. } => Some((
            format!("`{endpoint}` cannot be connected to: nothing listens on port 0"),
            "write the port of the device, or leave it out for the usual one".into(),
        )),
        // A new pseudo-terminal is for an imitation to listen on; nobody is at the other end of ours.
        Endpoint::Rtu { path, .. } if path == "pty" => Some((
            format!("`{endpoint}` cannot be connected to: `pty` is no serial device"),
            "write the device that the imitation printed, such as \"rtu:///dev/pts/3\"".into(),
        )),
        endpoint => wires.iter().find(|wire| is_same_end(wire, endpoint)).map(|PlacedWire { id, .. }| {
            (
                format!("`{endpoint}` is the endpoint of the wire `{id}` already"),
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

/// Whether a wire ends there already. However a line is set, it is one line.
fn is_same_end(wire: &PlacedWire, endpoint: &Endpoint) -> bool {
    wire.wire.as_ref().is_some_and(|wire| match (&wire.endpoint, endpoint) {
        (Endpoint::Rtu { path, .. }, Endpoint::Rtu { path: other, .. }) => path == other,
        (one, other) => one.to_string().eq_ignore_ascii_case(&other.to_string()),
    })
}

fn devices(root: &Table<'_, '_>, wires: &[PlacedWire], findings: &mut Collector<'_>) -> Vec<PlacedDevice> {
    let mut devices: Vec<PlacedDevice> = Vec::new();
    let mut ids: Vec<String> = Vec::new();
    for table in root.tables("devices", "[[devices]]", DEVICE_KEYS, findings) {
        let id = id(&table, "device", ids.iter().map(String::as_str), findings);
        ids.extend(id.clone());
        let name = name(&table, "name", findings);
        let profile = table.required("profile", "\"datakom-d\"", findings, profile);
        let wire = table
            .required("wire", "\"gen1\"", findings, |table, key, findings| wire(table, key, wires, findings));
        let unit =
            table.required("unit", "1", findings, |table, key, findings| unit(table, key, profile, findings));
        let word_order = word_order(&table, findings);
        let poll = poll(&table, findings);

        let (Some(id), Some(profile), Some(wire), Some(unit)) = (id, profile, wire, unit) else { continue };
        let same = |other: &&PlacedDevice| (other.device.wire, other.device.unit) == (wire.value, unit.value);
        if let Some(PlacedDevice { device: other, .. }) = devices.iter().find(same) {
            findings.add(
                unit.span,
                format!("unit {} on wire {} is {} already", unit.value, wires[wire.value].id, other.id),
                "give every device on a wire a unit id of its own",
            );
            continue;
        }
        let device = SiteDevice {
            name: name.unwrap_or_else(|| id.clone()),
            id,
            profile,
            wire: wire.value,
            unit: unit.value,
            word_order: word_order.unwrap_or(profile.wire.word_order),
            poll,
        };
        devices.push(PlacedDevice { device, wire: wire.span, unit: unit.span });
    }
    devices
}

/// An id of something of this `kind`, unlike the `others`.
fn id<'a>(
    table: &Table<'_, '_>,
    kind: &str,
    mut others: impl Iterator<Item = &'a str>,
    findings: &mut Collector<'_>,
) -> Option<String> {
    let id =
        table.required("id", "\"gen1\"", findings, |table, key, findings| table.string(key, findings))?;
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !(1..=64).contains(&id.value.len()) || !id.value.chars().all(allowed) {
        findings.add(
            id.span,
            format!("`{}` cannot be an id", id.value),
            "write 1 to 64 letters a-z, digits, - and _; `name` takes any text",
        );
        return None;
    }
    if others.any(|other| other == id.value) {
        findings.add(
            id.span,
            format!("there is a {kind} `{}` already", id.value),
            format!("give every {kind} an id of its own"),
        );
        return None;
    }
    Some(id.value)
}

fn name(table: &Table<'_, '_>, key: &str, findings: &mut Collector<'_>) -> Option<String> {
    let name = table.string(key, findings)?;
    let length = name.value.trim().chars().count();
    if !(1..=200).contains(&length) || name.value.contains(char::is_control) {
        findings.add(name.span, "this cannot be a name", "write 1 to 200 characters on one line");
        return None;
    }
    Some(name.value.trim().to_owned())
}

fn profile(table: &Table<'_, '_>, key: &str, findings: &mut Collector<'_>) -> Option<&'static Profile> {
    let text = table.string(key, findings)?;
    let profile = busbar_profile::builtin(&text.value);
    if profile.is_none() {
        let known: Vec<&str> =
            busbar_profile::builtins().iter().map(|profile| profile.key.as_str()).collect();
        findings.add(
            text.span,
            format!("there is no profile `{}`", text.value),
            format!("write one of: {}", known.join(", ")),
        );
    }
    profile
}

fn wire(
    table: &Table<'_, '_>,
    key: &str,
    wires: &[PlacedWire],
    findings: &mut Collector<'_>,
) -> Option<At<usize>> {
    let text = table.string(key, findings)?;
    let Some(index) = wires.iter().position(|wire| wire.id == text.value) else {
        let help = match wires {
            [] => format!("define it: [[wires]] with id = \"{}\" and its endpoint", text.value),
            _ => {
                let known: Vec<&str> = wires.iter().map(|wire| wire.id.as_str()).collect();
                format!("write one of: {}; or define it with [[wires]]", known.join(", "))
            }
        };
        findings.add(text.span, format!("the wire `{}` is not defined", text.value), help);
        return None;
    };
    Some(At { value: index, span: text.span })
}

fn unit(
    table: &Table<'_, '_>,
    key: &str,
    profile: Option<&Profile>,
    findings: &mut Collector<'_>,
) -> Option<At<u8>> {
    let number = table.integer(key, findings)?;
    // Without a profile the standard's range is what is left to check.
    let (min, max, whose) = match profile {
        Some(profile) => (profile.wire.unit.min, profile.wire.unit.max, profile.key.as_str()),
        None => (1, 247, "Modbus"),
    };
    match u8::try_from(number.value).ok().filter(|unit| (min..=max).contains(unit)) {
        Some(unit) => Some(At { value: unit, span: number.span }),
        None => {
            findings.add(
                number.span,
                format!("{whose} knows no unit {}", number.value),
                format!("write a number from {min} to {max}"),
            );
            None
        }
    }
}

fn word_order(table: &Table<'_, '_>, findings: &mut Collector<'_>) -> Option<WordOrder> {
    let text = table.string("word_order", findings)?;
    let order = match text.value.as_str() {
        "low-first" => Some(WordOrder::LowFirst),
        "high-first" => Some(WordOrder::HighFirst),
        _ => None,
    };
    if order.is_none() {
        findings.add(
            text.span,
            format!("`{}` is no word order", text.value),
            "write \"low-first\" or \"high-first\"",
        );
    }
    order
}

fn poll(table: &Table<'_, '_>, findings: &mut Collector<'_>) -> Poll {
    let mut poll = Poll::default();
    let Some(table) = table.table("poll", "poll", POLL_KEYS, findings) else { return poll };
    let fast = table.duration("fast", POLL, findings);
    let slow = table.duration("slow", POLL, findings);
    if let (Some(fast), Some(slow)) = (&fast, &slow)
        && fast.value > slow.value
    {
        findings.add(
            slow.span.clone(),
            "`slow` is shorter than `fast`",
            "make `slow` at least as long as `fast`",
        );
    }
    poll.fast = fast.map_or(poll.fast, |fast| fast.value);
    poll.slow = slow.map_or(poll.slow, |slow| slow.value).max(poll.fast);
    poll
}

#[cfg(test)]
mod tests;
