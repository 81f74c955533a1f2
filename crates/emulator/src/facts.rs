//! What a client would know of a controller, by name: signals of the vocabulary, points, and single bits of points.
//!
//! A name is looked up once, which tells what kind of fact it is; the fact itself is decoded from the registers that a
//! read would get.

use std::fmt;

use busbar_profile::text::shown;
use busbar_profile::vocabulary::vocabulary;
use busbar_profile::{DataType, JoinedValue, Number, Point, Profile, Value, nearest};
use serde::{Serialize, Serializer};

use crate::device::Device;

/// What a client would know at this moment.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fact {
    /// A number, in the unit of the signal or point.
    Number(Number),
    /// A canonical word of a signal, or the id of a point's choice.
    Word(&'static str),
    /// A state that the controller has a label for and the vocabulary no word: none of the words.
    NoWord(&'static str),
    /// A single bit.
    Flag(bool),
    /// Nobody can tell: the sensor is absent, the code has no name, or the controller is restarting.
    Unknown,
}

impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Word(word) => f.write_str(word),
            Self::NoWord(label) => write!(f, "none ({label})"),
            Self::Flag(true) => f.write_str("yes"),
            Self::Flag(false) => f.write_str("no"),
            Self::Unknown => f.write_str("unknown"),
        }
    }
}

impl Serialize for Fact {
    /// A number, a text, true or false; null for what is unknown or has no word.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(number) => number.serialize(serializer),
            Self::Word(word) => serializer.serialize_str(word),
            Self::Flag(flag) => serializer.serialize_bool(*flag),
            Self::NoWord(_) | Self::Unknown => serializer.serialize_none(),
        }
    }
}

/// What a fact can be.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FactKind {
    /// A number in this unit, if it has one.
    Number {
        /// The unit.
        unit: Option<&'static str>,
    },
    /// One of these words.
    Words(Vec<&'static str>),
    /// True or false.
    Flag,
}

/// A fact that one controller has, found by its name.
#[derive(Clone, Debug)]
pub struct Subject {
    profile: &'static Profile,
    name: String,
    place: Place,
    kind: FactKind,
}

/// Where a fact stands.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// A point by its index; of a signal, in the signal's unit and words.
    Point { index: usize, as_signal: bool },
    /// A bit of a point.
    Bit { index: usize, bit: u16 },
    /// A joined signal by its index.
    Joined(usize),
}

/// A name that no condition can be about.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FactError {
    /// The controller has nothing of that name.
    #[error("the controller has no `{}`; {}", shown(.name), meant(.nearest.as_ref()))]
    Unknown {
        /// What was asked for.
        name: String,
        /// What was perhaps meant.
        nearest: Option<String>,
    },
    /// There is such a thing, and it is no number, word or flag.
    #[error("`{name}` is {what}; {remedy}")]
    NotPlain {
        /// What was asked for.
        name: String,
        /// What it is.
        what: &'static str,
        /// What to write instead.
        remedy: String,
    },
}

fn meant(nearest: Option<&String>) -> String {
    match nearest {
        Some(nearest) => format!("did you mean `{nearest}`?"),
        None => "write a signal, a point or point.bit that `busbar profile show` lists".to_owned(),
    }
}

impl FactError {
    /// What is wrong, and what to write instead.
    pub(crate) fn parts(&self) -> (String, String) {
        match self {
            Self::Unknown { name, nearest } => {
                (format!("the controller has no `{}`", shown(name)), meant(nearest.as_ref()))
            }
            Self::NotPlain { name, what, remedy } => (format!("`{name}` is {what}"), remedy.clone()),
        }
    }
}

impl Subject {
    /// The fact of a name: a signal of the vocabulary, the id of a point, or `point.bit`.
    ///
    /// # Errors
    /// The controller does not have it, or it is no number, word or flag.
    pub fn find(profile: &'static Profile, name: &str) -> Result<Self, FactError> {
        let found = signal(profile, name).or_else(|| point(profile, name)).or_else(|| bit(profile, name));
        match found {
            Some((place, kind)) => Ok(Self { profile, name: name.to_owned(), place, kind: kind? }),
            None => Err(FactError::Unknown { name: name.to_owned(), nearest: nearest_name(profile, name) }),
        }
    }

    /// Every signal of the vocabulary that a controller has, in the order of the vocabulary's ids.
    pub fn signals(profile: &'static Profile) -> impl Iterator<Item = Self> {
        vocabulary().iter().filter_map(move |about| {
            let (place, kind) = signal(profile, &about.id)?;
            Some(Self { profile, name: about.id.clone(), place, kind: kind.ok()? })
        })
    }

    /// As it was asked for.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it can be.
    pub fn kind(&self) -> &FactKind {
        &self.kind
    }

    /// What it is now; `device` has the profile that the name was looked up in.
    pub fn fact(&self, device: &Device) -> Fact {
        debug_assert!(std::ptr::eq(self.profile, device.profile()), "another controller's fact");
        if device.is_silent() {
            return Fact::Unknown;
        }
        self.read(device).unwrap_or(Fact::Unknown)
    }

    fn read(&self, device: &Device) -> Option<Fact> {
        let order = self.profile.wire.word_order;
        let registers = |index: usize| {
            let point: &Point = self.profile.points.get(index)?;
            device.registers(point.address, point.registers)
        };
        let decoded = |index: usize| {
            let point: &'static Point = self.profile.points.get(index)?;
            Some((point, point.decode(registers(index)?, order).value?))
        };
        match self.place {
            Place::Bit { index, bit } => Some(Fact::Flag(decoded(index)?.1.as_bits()?.contains(bit))),
            Place::Point { index, as_signal } => {
                let (point, value) = decoded(index)?;
                plain(point, &value, as_signal)
            }
            Place::Joined(index) => {
                let joined = self.profile.joined().get(index)?;
                match joined.reading_of(self.profile, order, registers)?.value? {
                    JoinedValue::Number(number) => Some(Fact::Number(number)),
                    JoinedValue::Clock(_) => None,
                }
            }
        }
    }
}

impl Device {
    /// What a client would know by this name: a signal of the vocabulary, the id of a point, or `point.bit`. None
    /// where the controller has no such thing, or it is no number, word or flag.
    pub fn fact(&self, name: &str) -> Option<Fact> {
        Some(Subject::find(self.profile(), name).ok()?.fact(self))
    }
}

/// The value of a point as a fact.
fn plain(point: &'static Point, value: &Value, as_signal: bool) -> Option<Fact> {
    match value {
        Value::Number(number) if as_signal => point.in_signal_unit(*number).map(Fact::Number),
        Value::Number(number) => Some(Fact::Number(*number)),
        Value::Choice { code } => {
            let choice = point.choice(*code)?;
            Some(match (as_signal, choice.state.as_deref()) {
                (true, Some(word)) => Fact::Word(word),
                (true, None) => Fact::NoWord(&choice.label),
                (false, _) => Fact::Word(&choice.id),
            })
        }
        // One bit for each word, or one bit for two.
        Value::Bits(bits) => point.bits.iter().find_map(|bit| {
            let word = match bits.contains(bit.bit) {
                true => bit.state.as_deref()?,
                false => &bit.clear.as_ref()?.state,
            };
            Some(Fact::Word(word))
        }),
        _ => None,
    }
}

/// What a name is found to be; an error where nothing can be compared with it.
type Found = (Place, Result<FactKind, FactError>);

fn signal(profile: &'static Profile, name: &str) -> Option<Found> {
    let about = vocabulary().signal(name)?;
    if let Some((point, bit)) = profile.flag(name) {
        let index = readable(profile, point)?;
        return Some((Place::Bit { index, bit }, Ok(FactKind::Flag)));
    }
    let unit = about.unit.as_deref();
    if let Some(index) = profile.joined().iter().position(|joined| joined.signal == name) {
        let kind = match profile.joined()[index].parts {
            busbar_profile::JoinedParts::Hours { .. } => Ok(FactKind::Number { unit }),
            busbar_profile::JoinedParts::Clock { .. } => Err(FactError::NotPlain {
                name: name.to_owned(),
                what: "a date with its time",
                remedy: "compare its parts, such as `clock.hour`, where the controller has them".to_owned(),
            }),
        };
        return Some((Place::Joined(index), kind));
    }
    let point = profile.signal(name)?;
    let index = readable(profile, point)?;
    let kind = if point.data_type.is_numeric() {
        FactKind::Number { unit }
    } else {
        let shown = words(point);
        FactKind::Words(about.words.iter().map(String::as_str).filter(|word| shown.contains(word)).collect())
    };
    Some((Place::Point { index, as_signal: true }, Ok(kind)))
}

fn point(profile: &'static Profile, name: &str) -> Option<Found> {
    let index = profile.point_index(name)?;
    let point = profile.points.get(index)?;
    let not_plain = |what, remedy: String| FactError::NotPlain { name: name.to_owned(), what, remedy };
    let kind = match point.data_type {
        _ if !point.access.is_readable() => {
            Err(not_plain("written by clients and never read", "compare what it brings about".to_owned()))
        }
        DataType::Choice => {
            Ok(FactKind::Words(point.choices.iter().map(|choice| choice.id.as_str()).collect()))
        }
        DataType::Bits => {
            let bit = point.bits.first().map_or("bit", |bit| &bit.id);
            Err(not_plain("a set of bits", format!("name one of them, such as `{name}.{bit}`")))
        }
        kind if kind.is_numeric() => Ok(FactKind::Number { unit: point.unit.as_deref() }),
        _ => Err(not_plain("no number, word or flag", "compare another point".to_owned())),
    };
    Some((Place::Point { index, as_signal: false }, kind))
}

fn bit(profile: &'static Profile, name: &str) -> Option<Found> {
    let (point, bit) = name.split_once('.')?;
    let point = profile.point(point)?;
    let bit = point.bit_by_id(bit)?.bit;
    Some((Place::Bit { index: readable(profile, point)?, bit }, Ok(FactKind::Flag)))
}

fn readable(profile: &'static Profile, point: &Point) -> Option<usize> {
    profile.point_index(&point.id).filter(|_| point.access.is_readable())
}

/// The words of the vocabulary that a point can show.
fn words(point: &'static Point) -> Vec<&'static str> {
    let choices = point.choices.iter().filter_map(|choice| choice.state.as_deref());
    let bits = point.bits.iter().flat_map(|bit| {
        bit.state.as_deref().into_iter().chain(bit.clear.iter().map(|clear| clear.state.as_str()))
    });
    choices.chain(bits).collect()
}

/// What was perhaps meant: of a wrong bit another one of its point, of a bit of a wrong point the one that has it.
fn nearest_name(profile: &'static Profile, name: &str) -> Option<String> {
    let full = |point: &Point, bit: &str| format!("{}.{bit}", point.id);
    let readable = || profile.points.iter().filter(|point| point.access.is_readable());
    let (point, bit) = name.split_once('.').unwrap_or(("", name));
    if let Some(point) = profile.point(point) {
        let meant = nearest(bit, point.bits.iter().map(|bit| bit.id.as_str()))?;
        return Some(full(point, meant));
    }
    let mut having = readable().filter(|point| point.bit_by_id(bit).is_some());
    if let (Some(point), None) = (having.next(), having.next()) {
        return Some(full(point, bit));
    }
    let signals = Subject::signals(profile).map(|subject| subject.name);
    let names: Vec<_> = signals.chain(readable().map(|point| point.id.clone())).collect();
    let names = || names.iter().map(String::as_str);
    nearest(name, names()).or_else(|| begun(name, names())).map(str::to_owned)
}

/// The only name that goes on from this one, such as `breaker.genset.closed` from `breaker.genset`.
fn begun<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let goes_on = |known: &&str| known.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
    let mut begun = names.filter(goes_on);
    begun.next().filter(|_| begun.next().is_none())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    fn device(key: &str, pins: &[(&str, &str)]) -> Device {
        let pins = pins.iter().map(|(point, value)| ((*point).to_owned(), (*value).to_owned())).collect();
        Device::new(&Config { profile: key.to_owned(), pins, ..Config::default() }).unwrap()
    }

    fn said(device: &Device, name: &str) -> String {
        device.fact(name).map_or("-".to_owned(), |fact| fact.to_string())
    }

    #[test]
    fn facts_are_what_a_client_decodes() {
        let pins = [
            ("operation_status", "Load transfer to genset"),
            ("genset_l1_voltage", "230.4"),
            ("oil_pressure", "4.5"),
            ("engine_temperature", "absent"),
            ("warning_alarms", "low_fuel_level"),
        ];
        let device = device("datakom-d", &pins);
        assert_eq!(said(&device, "state.engine"), "loaded", "the word of the vocabulary");
        assert_eq!(said(&device, "operation_status"), "load_transfer_to_genset", "the id of the choice");
        assert_eq!(said(&device, "genset.l1.voltage"), "230.4");
        assert_eq!(
            (said(&device, "oil_pressure"), said(&device, "engine.oil.pressure")),
            ("4.5".into(), "450".into())
        );
        assert_eq!(said(&device, "engine.coolant.temperature"), "unknown", "a sentinel is no number");
        assert_eq!(said(&device, "warning_alarms.low_fuel_level"), "yes");
        assert_eq!(said(&device, "shutdown_alarms.low_fuel_level"), "no");
        assert_eq!(said(&device, "breaker.mains.closed"), "yes");
        assert_eq!(said(&device, "compressor.loaded"), "-");
    }

    #[test]
    fn bits_that_stand_for_words_and_joined_hours_are_facts_too() {
        let dkg = device("datakom-dkg705", &[("operating_mode", "load_test")]);
        assert_eq!(said(&dkg, "state.engine"), "none (Load on mains)", "a state without a word");
        assert_eq!(said(&dkg, "mode"), "load_test");
        assert_eq!(said(&device("datakom-dkg705", &[("operating_mode", "none")]), "mode"), "unknown");
        let hat = |bits| device("smartgen-hat821si", &[("common_status", bits)]);
        assert_eq!(said(&hat("auto_mode"), "mode"), "auto");
        assert_eq!(said(&hat("none"), "mode"), "manual", "one bit stands for two words");
        for profile in busbar_profile::builtins() {
            let device = device(&profile.key, &[]);
            for subject in Subject::signals(profile) {
                let fact = subject.fact(&device);
                let fits = match subject.kind() {
                    FactKind::Number { .. } => matches!(fact, Fact::Number(_) | Fact::Unknown),
                    FactKind::Flag => matches!(fact, Fact::Flag(_)),
                    FactKind::Words(words) => match &fact {
                        Fact::Word(word) => words.contains(word),
                        fact => matches!(fact, Fact::NoWord(_) | Fact::Unknown),
                    },
                };
                assert!(fits, "{} {}: {fact:?} is no {:?}", profile.key, subject.name(), subject.kind());
            }
        }
    }

    #[test]
    fn a_restarting_controller_tells_nothing() {
        let mut device = device("datakom-d", &[]);
        let reset = busbar_modbus::Request::WriteSingleRegister { address: 8210, value: 14_536 };
        device.answer(1, &reset).unwrap();
        assert_eq!(said(&device, "state.engine"), "unknown");
    }

    #[test]
    fn a_wrong_name_gets_the_nearest() {
        let of = |key, name| {
            let profile = busbar_profile::builtin(key).unwrap();
            Subject::find(profile, name).unwrap_err().to_string()
        };
        let find = |name| of("datakom-d", name);
        for name in ["shutdown_alarms.fail_to_start", "fail_to_start"] {
            assert_eq!(
                of("datakom-dkg705", name),
                format!("the controller has no `{name}`; did you mean `shutdown_alarms_2.fail_to_start`?")
            );
        }
        for (name, sentence) in [
            ("state.engin", "the controller has no `state.engin`; did you mean `state.engine`?"),
            (
                "breaker.genset",
                "the controller has no `breaker.genset`; did you mean `breaker.genset.closed`?",
            ),
            ("unitmode", "the controller has no `unitmode`; did you mean `unit_mode`?"),
            (
                "warning_alarms.low_fuel_levl",
                "the controller has no `warning_alarms.low_fuel_levl`; did you mean `warning_alarms.low_fuel_level`?",
            ),
            (
                "compressor.loaded",
                "the controller has no `compressor.loaded`; write a signal, a point or point.bit that \
                 `busbar profile show` lists",
            ),
            (
                "warning_alarms",
                "`warning_alarms` is a set of bits; name one of them, such as `warning_alarms.input_1`",
            ),
            (
                "push_buttons",
                "`push_buttons` is written by clients and never read; compare what it brings about",
            ),
        ] {
            assert_eq!(find(name), sentence);
        }
    }
}
