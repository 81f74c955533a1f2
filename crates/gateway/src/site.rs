//! The site file: which wires and devices there are. TOML, checked as a whole before anything starts.

mod checks;
mod devices;
mod diagram;
mod hosts;
mod keys;
mod profiles;
mod reader;
mod text;
mod time_zone;
mod wires;
mod words;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::time::Duration;

use busbar_link::Endpoint;
use busbar_profile::text::shown;
use busbar_profile::{Collector, Finding, Findings, Profile, WordOrder};
use toml::de::DeTable;

pub use self::diagram::{Connection, Diagram, Node, NodeKind};
use self::reader::Table;

/// Where the gateway listens unless it is told otherwise: this machine only.
pub const DEFAULT_LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);

/// A site: its wires, the devices on them, and how what they control is connected. Everything in it has been checked.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Site {
    /// What the page calls it.
    pub name: String,
    /// Its time zone by the IANA database, as that spells it.
    pub time_zone: Option<String>,
    /// Where the gateway listens.
    pub listen: SocketAddr,
    /// Host names that a gateway for this machine alone answers to besides this machine's own: those of a proxy.
    pub hosts: Vec<String>,
    /// The wires, in the order of the file; ids are unique.
    pub wires: Vec<SiteWire>,
    /// The devices, in the order of the file; ids are unique.
    pub devices: Vec<SiteDevice>,
    /// How what they control is connected; empty where the file draws nothing.
    pub diagram: Diagram,
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
    /// The model that it has to be, one that its profile knows.
    pub model: Option<String>,
    /// Index of its wire in [`Site::wires`].
    pub wire: usize,
    /// Its unit id on that wire.
    pub unit: u8,
    /// Word order of its 32-bit numbers.
    pub word_order: WordOrder,
    /// How often it is polled.
    pub poll: Poll,
    /// The mode that it should be in, a canonical word that its profile can show.
    pub desired_mode: Option<String>,
    /// What stands on the machine.
    pub nameplate: Nameplate,
}

/// What the plates of a machine say, where the file does.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Nameplate {
    /// Power in kW.
    pub power_kw: Option<f64>,
    /// What the fuel tank holds, in litres.
    pub tank_l: Option<f64>,
    /// Nominal voltage of the starter battery.
    pub battery_v: Option<f64>,
}

impl SiteDevice {
    /// Whether the two are one device, read in one way. Which wire it is on is not looked at.
    pub(crate) fn is_same_device(&self, other: &Self) -> bool {
        let Self { id, name, profile, model, wire: _, unit, word_order, poll, desired_mode, nameplate } =
            self;
        *id == other.id
            && *name == other.name
            && std::ptr::eq(*profile, other.profile)
            && *unit == other.unit
            && *word_order == other.word_order
            && *poll == other.poll
            && *model == other.model
            && *desired_mode == other.desired_mode
            && *nameplate == other.nameplate
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
        if text.trim_matches(|c: char| c.is_whitespace() || c == '\u{FEFF}').is_empty() {
            findings.add(
                0..0,
                "there is nothing in this file",
                "write [site] and name = \"North hospital\", then [[wires]] and [[devices]]",
            );
        }
        let (root, errors) = DeTable::parse_recoverable(text);
        for error in errors {
            let span = error.span().unwrap_or(0..0);
            let (message, help) = syntax(text, span.start, error.message());
            findings.add(span, format!("this is not TOML: {message}"), help);
        }
        // After a syntax error the rest of the text means who knows what.
        findings.finish()?;

        let mut findings = Collector::new(file, text);
        let mut warnings = Collector::new(file, text);
        let root = Table::new("a site file", keys::FILE, root.get_ref(), 0..0, &mut findings);
        let site = read(&root, &mut findings, &mut warnings);
        findings.finish()?;
        let warnings = warnings.finish().err().into_iter().flatten().collect();
        Ok(Self { warnings, ..site })
    }
}

/// The parser's words for a mistake, and a remedy for those that people make most.
fn syntax(text: &str, at: usize, message: &str) -> (String, &'static str) {
    let (before, after) = text.split_at_checked(at).unwrap_or((text, ""));
    if before.trim_end_matches([' ', '\t']).ends_with('=')
        && let Some((message, help)) = unquoted(after, message)
    {
        return (message.to_owned(), help);
    }
    let help = match message.contains("duplicate key") {
        true => "write every key and every [table] once; the tables of a list are headed [[so]]",
        false => "mend the syntax; https://toml.io shows it",
    };
    (message.replace('\n', ", "), help)
}

/// What a value may be meant for that stands without quotes, or without those that TOML knows, and what to do.
fn unquoted(value: &str, message: &str) -> Option<(&'static str, &'static str)> {
    let word: String = value.chars().take_while(|c| c.is_alphanumeric()).collect();
    let is_choice =
        ["true", "false", "yes", "no", "on", "off"].iter().any(|no| word.eq_ignore_ascii_case(no));
    match value.chars().next()? {
        _ if is_choice => Some(("a yes or no in other words", "write true or false, in small letters")),
        '“' | '”' | '„' | '‘' | '’' | '«' | '»' => {
            Some(("quotes of a word processor", "write straight ones, as in \"North hospital\""))
        }
        c if c.is_alphabetic() => Some(("a text without quotes", "put it in quotes")),
        c if c.is_ascii_digit() && message.contains("must be quoted") => Some((
            "a number with something behind it",
            "put a text or a duration in quotes; behind a number nothing but a comment may follow",
        )),
        _ => None,
    }
}

/// What stands in for a part that has been reported missing or wrong is never seen: the findings stop it.
fn read(root: &Table<'_, '_>, findings: &mut Collector<'_>, warnings: &mut Collector<'_>) -> Site {
    let site = root.required("site", "{ name = \"North hospital\" }", findings, |root, key, findings| {
        root.table(key, "[site]", keys::SITE, findings)
    });
    let name =
        site.as_ref().and_then(|site| site.required("name", "\"North hospital\"", findings, text::name));
    let time_zone = site.as_ref().and_then(|site| time_zone::read(site, findings));
    let server = root.table("server", "[server]", keys::SERVER, findings);
    let listen = server.as_ref().and_then(|server| listen(server, findings)).unwrap_or(DEFAULT_LISTEN);
    let hosts = server.as_ref().map(|server| hosts::read(server, findings)).unwrap_or_default();
    let wires = wires::read(root, findings);
    let devices = devices::read(root, &wires, findings, warnings);
    let diagram = diagram::read(root, &devices.defined, findings, warnings);
    let on_wires = checks::on_wires(&wires.placed, &devices.placed);
    checks::serial(&on_wires, findings);
    checks::crowded(&on_wires, warnings);
    checks::doubtful_units(&devices.placed, warnings);
    checks::idle(&wires, &devices, warnings);
    Site {
        name: name.unwrap_or_default(),
        time_zone,
        listen,
        hosts,
        wires: wires.placed.into_iter().filter_map(|wire| wire.wire).collect(),
        devices: devices.placed.into_iter().map(|placed| placed.device).collect(),
        diagram,
        warnings: Vec::new(),
    }
}

fn listen(server: &Table<'_, '_>, findings: &mut Collector<'_>) -> Option<SocketAddr> {
    let text = server.string("listen", findings)?;
    let address = text.value.parse().ok();
    if address.is_none() {
        findings.add(
            text.span,
            format!("`{}` is no address to listen on", shown(&text.value)),
            format!(
                "write an IP address, a colon and a port, such as \"{DEFAULT_LISTEN}\" for this machine only or \
                 \"0.0.0.0:8080\" for the network"
            ),
        );
    }
    address
}

#[cfg(test)]
mod tests;
