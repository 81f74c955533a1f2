//! The devices of a site file.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use busbar_profile::text::{in_words, shown};
use busbar_profile::{Collector, Profile, WordOrder};

use super::reader::{At, Limits, Table};
use super::wires::Wires;
use super::words::{listed, meant, remedy};
use super::{Nameplate, Poll, SiteDevice, keys, profiles, text};

const POLL: RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(3600);
const POWER_KW: Limits =
    Limits { range: f64::MIN_POSITIVE..=100_000.0, words: "of kW above 0, up to 100000" };
const TANK_L: Limits =
    Limits { range: f64::MIN_POSITIVE..=1_000_000.0, words: "of litres above 0, up to 1000000" };
const BATTERY_V: Limits = Limits { range: 6.0..=250.0, words: "of volts from 6 to 250, such as 12 or 24" };

/// The devices of the file, and how to find them.
#[derive(Default)]
pub(super) struct Devices {
    pub(super) placed: Vec<PlacedDevice>,
    /// What the rest of the file may refer to, with the profile where that is known: a device of which something else
    /// is wrong is there all the same.
    pub(super) defined: BTreeMap<String, Option<&'static Profile>>,
    /// Indexes of the wires that any device names.
    pub(super) wires: HashSet<usize>,
}

/// A device and where the text names its wire and its unit id.
pub(super) struct PlacedDevice {
    pub(super) device: SiteDevice,
    pub(super) wire: Range<usize>,
    pub(super) unit: Range<usize>,
}

/// The devices in the order of the file.
pub(super) fn read(
    root: &Table<'_, '_>,
    wires: &Wires,
    findings: &mut Collector<'_>,
    warnings: &mut Collector<'_>,
) -> Devices {
    let mut devices = Devices::default();
    // Ids of the devices by wire and unit.
    let mut units: HashMap<(usize, u8), String> = HashMap::new();
    for table in root.tables("devices", "[[devices]]", keys::DEVICE, findings) {
        let id = text::id(&table, "device", |id| devices.defined.contains_key(id), findings);
        let name = text::name(&table, "name", findings);
        let profile = table.required("profile", "\"datakom-d\"", findings, profile);
        let model = table.string("model", findings).and_then(|model| self::model(model, profile?, findings));
        let wire = table
            .required("wire", "\"gen1\"", findings, |table, key, findings| wire(table, key, wires, findings));
        let unit =
            table.required("unit", "1", findings, |table, key, findings| unit(table, key, profile, findings));
        let word_order = word_order(&table, findings);
        let poll = poll(&table, findings);
        let desired_mode =
            table.string("desired_mode", findings).and_then(|mode| self::mode(mode, profile?, findings));
        let nameplate = nameplate(&table, profile, findings, warnings);

        if let Some(id) = &id {
            devices.defined.insert(id.value.clone(), profile);
        }
        devices.wires.extend(wire.as_ref().map(|wire| wire.value));
        let (Some(id), Some(wire), Some(unit)) = (id, wire, unit) else { continue };
        let place = (wire.value, unit.value);
        if let Some(other) = units.get(&place) {
            findings.add(
                unit.span,
                format!(
                    "unit {} on wire {} is {other} already",
                    unit.value, wires.placed[wire.value].id.value
                ),
                "give every device on a wire a unit id of its own",
            );
            continue;
        }
        units.insert(place, id.value.clone());
        let Some(profile) = profile else { continue };
        let device = SiteDevice {
            name: name.unwrap_or_else(|| id.value.clone()),
            id: id.value,
            profile,
            model,
            wire: wire.value,
            unit: unit.value,
            word_order: word_order.unwrap_or(profile.wire.word_order),
            poll,
            desired_mode,
            nameplate,
        };
        devices.placed.push(PlacedDevice { device, wire: wire.span, unit: unit.span });
    }
    devices
}

fn profile(table: &Table<'_, '_>, key: &str, findings: &mut Collector<'_>) -> Option<&'static Profile> {
    let text = table.string(key, findings)?;
    let profile = busbar_profile::builtin(&text.value);
    if profile.is_none() {
        let known = busbar_profile::builtins().iter().map(|profile| profile.key.as_str());
        findings.add(
            text.span,
            format!("there is no profile `{}`", shown(&text.value)),
            remedy(&text.value, known),
        );
    }
    profile
}

/// One of the models that the profile is for, or that its identity point can name.
pub(super) fn model(text: At<String>, profile: &Profile, findings: &mut Collector<'_>) -> Option<String> {
    let models = profiles::models(profile);
    if models.contains(&text.value.as_str()) {
        return Some(text.value);
    }
    let key = &profile.key;
    let remedy = match models.as_slice() {
        [] => "leave `model` out: this profile names none".to_owned(),
        [only] => format!("leave `model` out: {key} is for the {only} alone"),
        models => remedy(&text.value, models.iter().copied()),
    };
    findings.add(text.span, format!("{key} knows no model `{}`", shown(&text.value)), remedy);
    None
}

/// A mode that the controller can show: another one would never be met.
pub(super) fn mode(text: At<String>, profile: &Profile, findings: &mut Collector<'_>) -> Option<String> {
    let modes = profiles::modes(profile);
    if modes.contains(&text.value.as_str()) {
        return Some(text.value);
    }
    let remedy = match modes.as_slice() {
        [] => "leave `desired_mode` out: this controller tells no mode".to_owned(),
        modes => remedy(&text.value, modes.iter().copied()),
    };
    findings.add(text.span, format!("{} shows no mode `{}`", profile.key, shown(&text.value)), remedy);
    None
}

fn wire(table: &Table<'_, '_>, key: &str, wires: &Wires, findings: &mut Collector<'_>) -> Option<At<usize>> {
    let text = table.string(key, findings)?;
    let Some(index) = wires.index(&text.value) else {
        let named = shown(&text.value);
        let help = match (wires.placed.as_slice(), meant(&text.value, wires.ids())) {
            ([], _) => format!("define it: [[wires]] with id = \"{named}\" and its endpoint"),
            (_, Some(known)) => format!("write `{known}` if you mean that, or define it with [[wires]]"),
            _ => format!("write one of: {}; or define it with [[wires]]", listed(wires.ids())),
        };
        findings.add(text.span, format!("the wire `{named}` is not defined"), help);
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
    let order = text.value.parse().ok();
    if order.is_none() {
        findings.add(
            text.span,
            format!("`{}` is no word order", shown(&text.value)),
            "write \"low-first\" or \"high-first\"",
        );
    }
    order
}

fn poll(table: &Table<'_, '_>, findings: &mut Collector<'_>) -> Poll {
    let usual = Poll::default();
    let Some(table) = table.table("poll", "poll", keys::POLL, findings) else { return usual };
    let fast = match table.has("fast") {
        true => table.duration("fast", POLL, findings).map(|fast| fast.value),
        false => Some(usual.fast),
    };
    let slow = table.duration("slow", POLL, findings);
    if let (Some(fast), Some(slow)) = (fast, &slow)
        && slow.value < fast
    {
        findings.add(
            slow.span.clone(),
            format!("`slow` is shorter than `fast`, which is {}", in_words(fast)),
            "make `slow` at least as long as `fast`",
        );
    }
    let fast = fast.unwrap_or(usual.fast);
    Poll { fast, slow: slow.map_or(usual.slow, |slow| slow.value).max(fast) }
}

/// What the plates say, and a warning where a number has no reading to stand beside.
fn nameplate(
    table: &Table<'_, '_>,
    profile: Option<&Profile>,
    findings: &mut Collector<'_>,
    warnings: &mut Collector<'_>,
) -> Nameplate {
    let mut number = |key: &str, limits: &Limits, signal: &str, what: &str| {
        let number = table.number(key, limits, findings)?;
        if let Some(profile) = profile.filter(|profile| profile.signal(signal).is_none()) {
            warnings.add(
                number.span,
                format!("{} reads no {what}, so `{key}` shows nothing", profile.key),
                "leave it out",
            );
        }
        Some(number.value)
    };
    let tank_l = number("tank_litres", &TANK_L, "fuel.level", "fuel level");
    let battery_v = number("battery_volts", &BATTERY_V, "battery.voltage", "battery voltage");
    let power_kw = table.number("nameplate_kw", &POWER_KW, findings).map(|power| power.value);
    Nameplate { power_kw, tank_l, battery_v }
}
