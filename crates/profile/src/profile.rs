//! The checked model of one controller family.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use crate::command::Command;
use crate::findings::Findings;
use crate::image::Outline;
use crate::joined::Joined;
use crate::number::Number;
use crate::point::Point;
use crate::terms::{Kind, OverRead, Parity, Rate, Transport, WordOrder};
use crate::vocabulary::vocabulary;

/// A controller family: what it is, how it is reached, what can be read and written.
///
/// Made by [`Profile::parse`] alone, so whatever is here has been checked.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Profile {
    /// Name of the profile, such as `datakom-d`.
    pub key: String,
    /// Maker, as the maker writes it.
    pub vendor: String,
    /// Models that the manual covers.
    pub models: Vec<String>,
    /// What it controls.
    pub kind: Kind,
    /// The manual the facts come from.
    pub manual: Manual,
    /// How to tell the model on the wire.
    pub identity: Option<Identity>,
    /// How to talk to it.
    pub wire: Wire,
    /// Groups, in the order of a page.
    pub groups: Vec<Group>,
    /// All points in address order; fields of one register with the lowest bits first.
    pub points: Vec<Point>,
    /// Coils that function 5 writes, in address order.
    pub coils: Vec<Coil>,
    /// Remote commands.
    pub commands: Vec<Command>,
    /// What an imitation of the controller is set to, in the order of the file.
    pub settings: Vec<Setting>,
    pub(crate) by_id: HashMap<String, usize>,
    pub(crate) joined: Vec<Joined>,
    pub(crate) outline: Arc<Outline>,
}

impl Profile {
    /// Reads and checks a profile file.
    ///
    /// `file_name` only serves the findings.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with the text, as far as it can be seen at once.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, Findings> {
        crate::load::parse(file_name, text, vocabulary())
    }

    /// The point of that id.
    pub fn point(&self, id: &str) -> Option<&Point> {
        self.point_index(id).map(|index| &self.points[index])
    }

    /// Where the point of that id stands in `points`.
    pub fn point_index(&self, id: &str) -> Option<usize> {
        self.by_id.get(id).copied()
    }

    /// The setting of an imitation with this id.
    pub fn setting(&self, id: &str) -> Option<&Setting> {
        self.settings.iter().find(|setting| setting.id == id)
    }

    /// The command of that id.
    pub fn command(&self, id: &str) -> Option<&Command> {
        self.commands.iter().find(|command| command.id == id)
    }

    /// The group a point belongs to.
    pub fn group(&self, point: &Point) -> &Group {
        &self.groups[point.group]
    }

    /// The model behind a code of the identity point; none for codes that are not known.
    pub fn model(&self, identity_code: u16) -> Option<&str> {
        self.identity.as_ref()?.model(identity_code)
    }

    /// What this maker means by an exception code, where it differs from the standard.
    pub fn exception_name(&self, code: u8) -> Option<&str> {
        let exception = self.wire.exceptions.iter().find(|e| e.code == code)?;
        Some(&exception.name)
    }

    /// The point that carries a signal of the vocabulary.
    pub fn signal(&self, signal: &str) -> Option<&Point> {
        self.points.iter().find(|point| point.signal.as_deref() == Some(signal))
    }

    /// The point and bit that carry a flag of the vocabulary.
    pub fn flag(&self, signal: &str) -> Option<(&Point, u16)> {
        self.points.iter().find_map(|point| {
            let bit = point.bits.iter().find(|bit| bit.signal.as_deref() == Some(signal))?;
            Some((point, bit.bit))
        })
    }

    /// Signals that several points make up, in the order of the file.
    pub fn joined(&self) -> &[Joined] {
        &self.joined
    }

    /// The points that lie wholly inside a window, in address order.
    pub fn points_within(&self, address: u16, count: usize) -> impl Iterator<Item = &Point> {
        let first = usize::from(address);
        let end = first + count;
        let start = self.points.partition_point(|p| usize::from(p.address) < first);
        self.points[start..]
            .iter()
            .take_while(move |point| usize::from(point.address) < end)
            .filter(move |point| usize::from(point.address) + usize::from(point.registers) <= end)
    }
}

/// The manual that a profile follows.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Manual {
    /// Its title.
    pub title: String,
    /// Its revision or date, where it has one.
    pub revision: Option<String>,
}

/// How to tell the model on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Identity {
    /// Index of the point that holds the code.
    pub point: usize,
    /// Known codes; others exist and are no error.
    pub models: Vec<IdentityModel>,
}

impl Identity {
    /// The model behind a code.
    pub fn model(&self, code: u16) -> Option<&str> {
        let known = self.models.iter().find(|known| known.value == code)?;
        Some(&known.model)
    }
}

/// One known code of the identity point.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct IdentityModel {
    /// The code.
    pub value: u16,
    /// The model.
    pub model: String,
}

/// The wire rules of a controller.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Wire {
    /// Transports that the manual gives.
    pub transports: Vec<Transport>,
    /// Unit ids that can be set.
    pub unit: UnitRange,
    /// Function codes that the device knows.
    pub functions: Vec<u8>,
    /// Registers in one read, at most.
    pub max_read: u16,
    /// Registers in one write, at most; 0 where no register can be written.
    pub max_write: u16,
    /// What a longer read gets.
    pub over_read: OverRead,
    /// Pause between two requests that the manual asks for, in milliseconds.
    pub spacing_ms: u32,
    /// The device answers no sooner than this, in milliseconds.
    pub answer_delay_ms: Number,
    /// How long to wait for an answer, in milliseconds.
    pub timeout_ms: u32,
    /// Word order of 32-bit numbers unless a device's configuration says otherwise.
    pub word_order: WordOrder,
    /// Settings that a serial port can have.
    pub serial: SerialSettings,
    /// Inclusive address ranges that may be read, ascending, none adjacent to the next.
    pub readable: Vec<(u16, u16)>,
    /// Exception codes with a meaning of the maker's own.
    pub exceptions: Vec<ExceptionName>,
}

impl Wire {
    /// The function that reads registers: 3, or 4 where the device has no 3.
    pub fn read_function(&self) -> u8 {
        if self.functions.contains(&3) { 3 } else { 4 }
    }

    /// The device answers no sooner than this.
    pub fn answer_delay(&self) -> Duration {
        Duration::from_secs_f64(self.answer_delay_ms.as_f64().max(0.0) / 1000.0)
    }

    /// Whether every address of a window may be read.
    pub fn is_readable(&self, address: u16, count: u16) -> bool {
        let last = u32::from(address) + u32::from(count).max(1) - 1;
        self.readable.iter().any(|&(first, end)| first <= address && last <= u32::from(end))
    }
}

/// Unit ids that a device can be set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct UnitRange {
    /// Lowest.
    pub min: u8,
    /// Highest.
    pub max: u8,
    /// As delivered; none where the manual does not say.
    pub default: Option<u8>,
}

/// Settings that a serial port can have.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SerialSettings {
    /// Bits a second.
    pub baud: Vec<u32>,
    /// Parities.
    pub parity: Vec<Parity>,
    /// Numbers of stop bits.
    pub stop: Vec<u8>,
}

/// A maker's own name for an exception code.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ExceptionName {
    /// The code.
    pub code: u8,
    /// What the maker means by it.
    pub name: String,
}

/// Points that belong together on a page.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Group {
    /// Its id.
    pub id: String,
    /// Its title.
    pub title: String,
    /// Page of the manual.
    pub page: Option<u16>,
    /// Rate of its points, unless a point has its own.
    pub rate: Rate,
    /// Indexes of its points, in the order of the file.
    pub points: Vec<usize>,
}

/// A coil that function 5 writes.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Coil {
    /// Modbus address.
    pub address: u16,
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Page of the manual.
    pub page: Option<u16>,
}

/// A timer, a threshold or a number of attempts of an imitated controller.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Setting {
    /// Its id, unique among the settings of the profile; that of a point where a register shows what it is set to.
    pub id: String,
    /// What it is called.
    pub name: String,
    /// What it is set to where nobody says otherwise.
    pub value: Number,
    /// The least that it can be set to.
    pub min: Number,
    /// The most that it can be set to.
    pub max: Number,
    /// Unit of all three; none for a count, or for yes (1) and no (0).
    pub unit: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Profile {
        let text = include_str!("../tests/sound.toml");
        Profile::parse("sound.toml", text).unwrap_or_else(|findings| panic!("{findings}"))
    }

    #[test]
    fn a_window_holds_the_points_that_are_whole() {
        let profile = sample();
        let ids = |address, count| {
            let ids: Vec<_> = profile.points_within(address, count).map(|point| point.id.as_str()).collect();
            ids.join(" ")
        };
        assert_eq!(ids(0, 2), "voltage");
        assert_eq!(ids(1, 2), "power");
        assert_eq!(ids(2, 2), "oil_pressure");
        assert_eq!(ids(5, 1), "brand model");
        assert_eq!(ids(9, 1), "options period");
        assert_eq!(ids(9000, 60000), "keys", "write-only ones too, and past the last address");
        assert_eq!(ids(12, 8), "");
    }

    #[test]
    fn names_lead_to_things() {
        let profile = sample();
        assert_eq!(profile.point("power").unwrap().plc_number(), 40_002);
        let mut point = profile.point("power").unwrap().clone();
        for (address, number) in [(9998, 49_999), (9999, 410_000), (10246, 410_247), (65535, 465_536)] {
            point.address = address;
            assert_eq!(point.plc_number(), number);
        }
        assert!(profile.point("none").is_none());
        assert_eq!(profile.model(0xA), Some("A"));
        assert_eq!(profile.model(0xB), None);
        assert_eq!(profile.exception_name(10), Some("write protection"));
        assert_eq!(profile.exception_name(2), None);
        assert_eq!(profile.signal("genset.l1.voltage").unwrap().id, "voltage");
        let (options, bit) = profile.flag("breaker.genset.closed").unwrap();
        assert_eq!((options.id.as_str(), bit), ("options", 3));
        assert_eq!(profile.command("load").unwrap().steps[0].write.address, 3);
        assert_eq!(profile.group(options).title, "Engine");
        let status = profile.point("status").unwrap();
        assert_eq!(profile.points[status.timer.unwrap()].id, "delay");
    }

    #[test]
    fn signals_come_in_their_own_unit() {
        let profile = sample();
        let oil = profile.point("oil_pressure").unwrap();
        assert_eq!(oil.in_signal_unit("4.2".parse().unwrap()), Some(Number::integer(420)));
        assert_eq!(profile.point("power").unwrap().in_signal_unit(Number::ZERO), None);
    }

    #[test]
    fn the_wire_knows_its_map_and_its_delay() {
        let wire = sample().wire;
        assert!(wire.is_readable(199, 2) && wire.is_readable(300, 801));
        assert!(!wire.is_readable(199, 3) && !wire.is_readable(250, 1) && !wire.is_readable(1100, 2));
        assert_eq!(wire.answer_delay(), Duration::from_micros(4300));
        assert_eq!(wire.read_function(), 3);
    }
}
