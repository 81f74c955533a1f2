//! Profiles as `busbar profile list` and `busbar profile show` print them; the keys are a contract.

use serde::Serialize;

use crate::command::{Arg, ArgValues};
use crate::number::{Number, Scale};
use crate::point::Point;
use crate::profile::Profile;
use crate::terms::{Access, ArgKind, Class, DataType, Kind, OverRead, Parity, Transport, WordOrder};

/// One line of `profile list`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ProfileSummary<'a> {
    /// Name of the profile.
    pub key: &'a str,
    /// Maker.
    pub vendor: &'a str,
    /// Models.
    pub models: &'a [String],
    /// What it controls.
    pub kind: Kind,
    /// Number of points.
    pub points: usize,
    /// Number of named bits, of every point.
    pub bits: usize,
    /// Number of coils.
    pub coils: usize,
    /// Number of commands.
    pub commands: usize,
}

impl<'a> ProfileSummary<'a> {
    /// The summary of a profile.
    pub fn new(profile: &'a Profile) -> Self {
        Self {
            key: &profile.key,
            vendor: &profile.vendor,
            models: &profile.models,
            kind: profile.kind,
            points: profile.points.len(),
            bits: profile.points.iter().map(|point| point.bits.len()).sum(),
            coils: profile.coils.len(),
            commands: profile.commands.len(),
        }
    }
}

/// `profile show`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ProfileShow<'a> {
    /// Name of the profile.
    pub key: &'a str,
    /// Maker.
    pub vendor: &'a str,
    /// Models.
    pub models: &'a [String],
    /// What it controls.
    pub kind: Kind,
    /// Wire rules.
    pub wire: WireShow<'a>,
    /// Points in address order.
    pub points: Vec<PointShow<'a>>,
    /// Coils in address order.
    pub coils: Vec<CoilShow<'a>>,
    /// Commands.
    pub commands: Vec<CommandShow<'a>>,
}

impl<'a> ProfileShow<'a> {
    /// A profile, shown.
    pub fn new(profile: &'a Profile) -> Self {
        Self {
            key: &profile.key,
            vendor: &profile.vendor,
            models: &profile.models,
            kind: profile.kind,
            wire: WireShow::new(profile),
            points: profile.points.iter().map(PointShow::new).collect(),
            coils: profile
                .coils
                .iter()
                .map(|coil| CoilShow { address: coil.address, id: &coil.id, name: &coil.name })
                .collect(),
            commands: profile
                .commands
                .iter()
                .map(|command| CommandShow {
                    id: &command.id,
                    name: &command.name,
                    args: command.args.iter().map(ArgShow::new).collect(),
                })
                .collect(),
        }
    }
}

/// The wire rules.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct WireShow<'a> {
    /// Transports that the manual gives.
    pub transports: &'a [Transport],
    /// Unit ids.
    pub unit: UnitShow,
    /// Function codes.
    pub functions: &'a [u8],
    /// Registers a read.
    pub max_read: u16,
    /// What a longer read gets.
    pub over_read: OverRead,
    /// Pause between requests, in milliseconds.
    pub spacing_ms: u32,
    /// Least answer time, in milliseconds.
    pub answer_delay_ms: Number,
    /// Word order.
    pub word_order: WordOrder,
    /// Serial settings.
    pub serial: SerialShow<'a>,
    /// Readable ranges.
    pub readable: Vec<[u16; 2]>,
}

impl<'a> WireShow<'a> {
    fn new(profile: &'a Profile) -> Self {
        let wire = &profile.wire;
        Self {
            transports: &wire.transports,
            unit: UnitShow { min: wire.unit.min, max: wire.unit.max, default: wire.unit.default },
            functions: &wire.functions,
            max_read: wire.max_read,
            over_read: wire.over_read,
            spacing_ms: wire.spacing_ms,
            answer_delay_ms: wire.answer_delay_ms,
            word_order: wire.word_order,
            serial: SerialShow {
                baud: &wire.serial.baud,
                parity: &wire.serial.parity,
                stop: &wire.serial.stop,
            },
            readable: wire.readable.iter().map(|&(first, last)| [first, last]).collect(),
        }
    }
}

/// Unit ids.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct UnitShow {
    /// Lowest.
    pub min: u8,
    /// Highest.
    pub max: u8,
    /// As delivered, null where the manual does not say.
    pub default: Option<u8>,
}

/// Serial settings.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SerialShow<'a> {
    /// Bits a second.
    pub baud: &'a [u32],
    /// Parities.
    pub parity: &'a [Parity],
    /// Stop bits.
    pub stop: &'a [u8],
}

/// A point.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PointShow<'a> {
    /// Its id.
    pub id: &'a str,
    /// Its name.
    pub name: &'a str,
    /// Address of its first register.
    pub address: u16,
    /// Number of registers.
    pub registers: u16,
    /// What may be done with it.
    pub access: Access,
    /// How its registers are read.
    #[serde(rename = "type")]
    pub data_type: DataType,
    /// Unit of the number.
    pub unit: Option<&'a str>,
    /// Scale of the number.
    pub scale: Option<Scale>,
    /// Id in the vocabulary.
    pub signal: Option<&'a str>,
    /// Codes and labels.
    pub choices: Vec<ChoiceShow<'a>>,
    /// Named bits.
    pub bits: Vec<BitShow<'a>>,
    /// Raw words that mean "no value".
    pub sentinels: &'a [u64],
    /// What the manual leaves open.
    pub doubt: Option<&'a str>,
}

impl<'a> PointShow<'a> {
    fn new(point: &'a Point) -> Self {
        Self {
            id: &point.id,
            name: &point.name,
            address: point.address,
            registers: point.registers,
            access: point.access,
            data_type: point.data_type,
            unit: point.unit.as_deref(),
            scale: point.scale,
            signal: point.signal.as_deref(),
            choices: point
                .choices
                .iter()
                .map(|choice| ChoiceShow { value: choice.value, label: &choice.label })
                .collect(),
            bits: point
                .bits
                .iter()
                .map(|bit| BitShow { bit: bit.bit, id: &bit.id, label: &bit.label, class: bit.class })
                .collect(),
            sentinels: &point.sentinels,
            doubt: point.doubt.as_deref(),
        }
    }
}

/// A code and its label.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ChoiceShow<'a> {
    /// The code.
    pub value: u32,
    /// The label.
    pub label: &'a str,
}

/// A named bit.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct BitShow<'a> {
    /// Its number.
    pub bit: u16,
    /// Its id.
    pub id: &'a str,
    /// Its label.
    pub label: &'a str,
    /// How serious it is.
    pub class: Option<Class>,
}

/// A coil.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CoilShow<'a> {
    /// Modbus address.
    pub address: u16,
    /// Its id.
    pub id: &'a str,
    /// Its name.
    pub name: &'a str,
}

/// A command.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CommandShow<'a> {
    /// Its id.
    pub id: &'a str,
    /// Its name.
    pub name: &'a str,
    /// Its arguments.
    pub args: Vec<ArgShow<'a>>,
}

/// An argument of a command: `choices`, or `min` and `max`, or `kind`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ArgShow<'a> {
    /// Its name.
    pub name: &'a str,
    /// What can be written, where it is one of a few.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<&'a str>,
    /// Least number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<u16>,
    /// Greatest number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<u16>,
    /// What else it is: a time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<ArgKind>,
    /// What it is when it is not given; null where it must be given.
    pub default: Option<DefaultShow<'a>>,
}

/// The default of an argument.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum DefaultShow<'a> {
    /// One of the choices, or `now`.
    Choice(&'a str),
    /// A number.
    Number(u16),
}

impl<'a> ArgShow<'a> {
    fn new(arg: &'a Arg) -> Self {
        match &arg.values {
            ArgValues::Choices(choices) => Self {
                name: &arg.name,
                choices: choices.iter().map(|choice| choice.id.as_str()).collect(),
                min: None,
                max: None,
                kind: None,
                default: choices
                    .iter()
                    .find(|choice| Some(choice.value) == arg.default)
                    .map(|choice| DefaultShow::Choice(&choice.id)),
            },
            ArgValues::Range(range) => Self {
                name: &arg.name,
                choices: Vec::new(),
                min: Some(*range.start()),
                max: Some(*range.end()),
                kind: None,
                default: arg.default.map(DefaultShow::Number),
            },
            ArgValues::Time { now } => Self {
                name: &arg.name,
                choices: Vec::new(),
                min: None,
                max: None,
                kind: Some(ArgKind::Time),
                default: now.then_some(DefaultShow::Choice("now")),
            },
        }
    }
}
