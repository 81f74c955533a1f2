//! What only shows when wires and devices are seen together: serial settings, crowded lines, doubtful unit ids, idle
//! wires.

use std::fmt::Display;
use std::ops::Range;

use busbar_link::{Endpoint, Parity, StopBits};
use busbar_profile::{Collector, SerialSettings};

use super::devices::{Devices, PlacedDevice};
use super::wires::{PlacedWire, Wires};
use super::{SiteDevice, SiteWire};

/// SmartGen units that one RS-485 line carries.
const SMARTGEN_UNITS: usize = 32;

/// Controllers whose manual lets a unit id be set that its own tables of frames do not reach: the highest that they do.
const REACHED_UNITS: &[(&str, u8)] = &[("datakom-dkg705", 144)];

/// A wire and the devices on it.
pub(super) struct OnWire<'a> {
    pub(super) wire: &'a PlacedWire,
    pub(super) devices: Vec<&'a PlacedDevice>,
}

/// Every wire with its devices, in the order of the file.
pub(super) fn on_wires<'a>(wires: &'a [PlacedWire], devices: &'a [PlacedDevice]) -> Vec<OnWire<'a>> {
    let mut on_wires: Vec<OnWire<'_>> =
        wires.iter().map(|wire| OnWire { wire, devices: Vec::new() }).collect();
    for placed in devices {
        on_wires[placed.device.wire].devices.push(placed);
    }
    on_wires
}

/// Settings of a line that a device on it cannot be set to. Behind a converter the line is not ours to set.
pub(super) fn serial(wires: &[OnWire<'_>], findings: &mut Collector<'_>) {
    for OnWire { wire, devices } in wires {
        let Some(SiteWire { endpoint: Endpoint::Rtu { serial, .. }, .. }) = &wire.wire else { continue };
        let line = Line {
            devices: devices.iter().map(|placed| &placed.device).collect(),
            endpoint: wire.endpoint.clone(),
        };
        let baud = Setting { key: "baud", value: serial.baud, words: format!("{} baud", serial.baud) };
        line.check(baud, |settings| &settings.baud, findings);
        let parity = match serial.parity {
            Parity::None => busbar_profile::Parity::None,
            Parity::Even => busbar_profile::Parity::Even,
            Parity::Odd => busbar_profile::Parity::Odd,
        };
        let words = match parity {
            busbar_profile::Parity::None => "no parity".to_owned(),
            parity => format!("{parity} parity"),
        };
        line.check(Setting { key: "parity", value: parity, words }, |settings| &settings.parity, findings);
        let (stop, words) = match serial.stop {
            StopBits::One => (1, "1 stop bit"),
            StopBits::Two => (2, "2 stop bits"),
        };
        let stop = Setting { key: "stop", value: stop, words: words.to_owned() };
        line.check(stop, |settings| &settings.stop, findings);
    }
}

/// A serial line and who is on it.
struct Line<'a> {
    devices: Vec<&'a SiteDevice>,
    endpoint: Range<usize>,
}

/// One setting of a line, as its endpoint has it.
struct Setting<T> {
    key: &'static str,
    value: T,
    words: String,
}

impl Line<'_> {
    fn check<T: PartialEq + Display>(
        &self,
        setting: Setting<T>,
        of: impl Fn(&SerialSettings) -> &Vec<T>,
        findings: &mut Collector<'_>,
    ) {
        let has = |device: &&SiteDevice, value: &T| of(&device.profile.wire.serial).contains(value);
        let without: Vec<String> = self
            .devices
            .iter()
            .filter(|device| !has(device, &setting.value))
            .map(|device| format!("{} ({})", device.id, device.profile.key))
            .collect();
        let Some(first) = self.devices.first().filter(|_| !without.is_empty()) else { return };
        let all = of(&first.profile.wire.serial).iter();
        let common: Vec<String> = all
            .filter(|value| self.devices.iter().all(|device| has(device, value)))
            .map(|value| format!("{}={value}", setting.key))
            .collect();
        let help = match common.as_slice() {
            [] => "these devices have no such setting in common: give them wires of their own".to_owned(),
            [only] => format!("write {only}, and set every device on the line to it"),
            several => format!("write one of {}, and set every device on the line to it", several.join(", ")),
        };
        let message = format!("{} cannot be set to {}", without.join(" and "), setting.words);
        findings.add(self.endpoint.clone(), message, help);
    }
}

/// Lines with more SmartGen units than their drivers are made for.
pub(super) fn crowded(wires: &[OnWire<'_>], warnings: &mut Collector<'_>) {
    for OnWire { wire, devices } in wires {
        let smartgen: Vec<&&PlacedDevice> =
            devices.iter().filter(|placed| placed.device.profile.vendor == "SmartGen").collect();
        if let Some(first_too_many) = smartgen.get(SMARTGEN_UNITS) {
            warnings.add(
                first_too_many.wire.clone(),
                format!(
                    "{} SmartGen units are on the wire `{}`, and one RS-485 line carries {SMARTGEN_UNITS}",
                    smartgen.len(),
                    wire.id.value
                ),
                "give the others a line of their own, or put a repeater between",
            );
        }
    }
}

/// Wires without a device, and a site without any.
pub(super) fn idle(wires: &Wires, devices: &Devices, warnings: &mut Collector<'_>) {
    if devices.placed.is_empty() {
        warnings.add(
            0..0,
            "no device is in this file, so there is nothing to show",
            "add [[wires]] and [[devices]]",
        );
        return;
    }
    let idle = wires.placed.iter().enumerate().filter(|(index, _)| !devices.wires.contains(index));
    for (_, wire) in idle {
        warnings.add(
            wire.id.span.clone(),
            format!("no device is on the wire `{}`", wire.id.value),
            "put one on it, or leave the wire out",
        );
    }
}

/// Unit ids of which a manual says both that they can be set and that they are not reached.
pub(super) fn doubtful_units(devices: &[PlacedDevice], warnings: &mut Collector<'_>) {
    for PlacedDevice { device, unit, .. } in devices {
        let reached = REACHED_UNITS.iter().find(|(key, _)| *key == device.profile.key);
        if let Some((key, highest)) = reached.filter(|(_, highest)| device.unit > *highest) {
            warnings.add(
                unit.clone(),
                format!(
                    "{key} can be set to unit {}, but its manual reaches units only up to {highest}",
                    device.unit
                ),
                format!(
                    "should {} not answer, give it a unit id from {} to {highest}",
                    device.id, device.profile.wire.unit.min
                ),
            );
        }
    }
}
