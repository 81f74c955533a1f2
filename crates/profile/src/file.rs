//! The profile file as it is written: the types behind the TOML text and the JSON Schema, unchecked beyond their shape.

use std::borrow::{Borrow, Cow};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::ops::{Deref, Range};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};
use toml::Spanned;

use crate::number::Number;
use crate::terms::{
    Access, ArgKind, Class, Confirm, DataType, DeviceProof, Kind, OverRead, Parity, Rate, Risk, Role,
    SignalKind, Transport, WordOrder,
};

/// A value and where it stands in the text. Not `Clone`, so that `clone` gives the value.
#[derive(Debug)]
pub(crate) struct At<T> {
    pub(crate) span: Range<usize>,
    value: T,
}

impl<T> Deref for At<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = Spanned::<T>::deserialize(deserializer)?;
        Ok(Self { span: spanned.span(), value: spanned.into_inner() })
    }
}

impl<T: JsonSchema> JsonSchema for At<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

impl<T: PartialEq> PartialEq for At<T> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<T: Eq> Eq for At<T> {}

impl<T: PartialOrd> PartialOrd for At<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<T: Ord> Ord for At<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.value.cmp(&other.value)
    }
}

impl Borrow<str> for At<String> {
    fn borrow(&self) -> &str {
        &self.value
    }
}

/// A decimal number, taken exactly as it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Decimal(pub(crate) Number);

impl<'de> Deserialize<'de> for Decimal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct DecimalVisitor;

        impl Visitor<'_> for DecimalVisitor {
            type Value = Decimal;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a decimal number")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Decimal, E> {
                Ok(Decimal(Number::integer(value)))
            }

            /// The shortest text that gives this float is the text of the file, up to 15 digits.
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Decimal, E> {
                let number = value.to_string().parse().map_err(E::custom)?;
                Ok(Decimal(number))
            }
        }

        deserializer.deserialize_any(DecimalVisitor)
    }
}

impl JsonSchema for Decimal {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Decimal".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "number" })
    }
}

/// A controller family for Busbar: what it is, how it is reached, what can be read and written.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Busbar controller profile")]
pub(crate) struct ProfileFile {
    /// Version of this format: 1.
    pub(crate) format: At<u16>,
    /// Name of the profile, such as `datakom-d`: lower case, digits, hyphens.
    pub(crate) key: At<String>,
    /// Maker, as the maker writes it.
    pub(crate) vendor: At<String>,
    /// Models that the manual covers.
    pub(crate) models: At<Vec<String>>,
    /// What it controls.
    pub(crate) kind: Kind,
    /// The manual that the facts come from.
    pub(crate) manual: ManualFile,
    /// How to tell the model on the wire.
    pub(crate) identity: Option<IdentityFile>,
    /// How to talk to it.
    pub(crate) wire: WireFile,
    /// Named lists of codes that points use.
    #[serde(default)]
    pub(crate) choices: BTreeMap<At<String>, ChoiceListFile>,
    /// Named lists of bits that points use.
    #[serde(default)]
    pub(crate) bits: BTreeMap<At<String>, BitListFile>,
    /// Groups of points, in the order of a page.
    pub(crate) groups: Vec<At<GroupFile>>,
    /// Signals that several points make up.
    #[serde(default)]
    pub(crate) joined: Vec<At<JoinedFile>>,
    /// Coils that function 5 writes.
    #[serde(default)]
    pub(crate) coils: Vec<At<CoilFile>>,
    /// Remote commands.
    #[serde(default)]
    pub(crate) commands: Vec<At<CommandFile>>,
    /// How an imitation of the controller behaves.
    #[serde(default)]
    pub(crate) emulator: EmulatorFile,
}

/// How an imitation of the controller behaves.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct EmulatorFile {
    /// Timers, thresholds and numbers of attempts, as they are set where nobody says otherwise.
    #[serde(default)]
    pub(crate) settings: Vec<At<SettingFile>>,
}

/// A timer, a threshold or a number of attempts.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SettingFile {
    /// Its id, unique among the settings; that of a point where a register shows what it is set to.
    pub(crate) id: At<String>,
    /// What it is called.
    pub(crate) name: String,
    /// What it is set to.
    pub(crate) value: At<Decimal>,
    /// The least that it can be set to.
    pub(crate) min: At<Decimal>,
    /// The most that it can be set to.
    pub(crate) max: At<Decimal>,
    /// Unit of all three; none for a count or a choice of yes (1) and no (0).
    pub(crate) unit: Option<String>,
}

/// The manual that the facts come from.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ManualFile {
    /// Its title.
    pub(crate) title: String,
    /// Its revision or date.
    pub(crate) revision: Option<String>,
}

/// How to tell the model on the wire.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct IdentityFile {
    /// Id of the point that holds the code.
    pub(crate) point: At<String>,
    /// Codes that are known; others exist and are no error.
    pub(crate) models: Vec<At<IdentityModelFile>>,
}

/// A known code of the identity point.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct IdentityModelFile {
    /// The code.
    pub(crate) value: u16,
    /// The model.
    pub(crate) model: String,
}

/// How to talk to the controller.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct WireFile {
    /// Transports that the manual gives.
    pub(crate) transports: At<Vec<Transport>>,
    /// Unit ids that can be set.
    pub(crate) unit: At<UnitFile>,
    /// Function codes that the device knows.
    pub(crate) functions: At<Vec<u8>>,
    /// Registers in one read, at most.
    pub(crate) max_read: At<u16>,
    /// Registers in one write, at most; left out where no register can be written.
    pub(crate) max_write: Option<At<u16>>,
    /// What a longer read gets.
    pub(crate) over_read: OverRead,
    /// Pause between two requests that the manual asks for, in milliseconds.
    pub(crate) spacing_ms: u32,
    /// The device answers no sooner than this, in milliseconds.
    pub(crate) answer_delay_ms: At<Decimal>,
    /// How long to wait for an answer, in milliseconds.
    pub(crate) timeout_ms: At<u32>,
    /// Which register of a 32-bit number comes first.
    pub(crate) word_order: WordOrder,
    /// Settings that the serial port can have.
    pub(crate) serial: At<SerialFile>,
    /// Inclusive address ranges that may be read, ascending; nothing outside is ever read.
    pub(crate) readable: At<Vec<At<(u16, u16)>>>,
    /// Exception codes with a meaning of the maker's own.
    #[serde(default)]
    pub(crate) exceptions: Vec<At<ExceptionFile>>,
}

/// Unit ids that can be set.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct UnitFile {
    /// Lowest.
    pub(crate) min: u8,
    /// Highest.
    pub(crate) max: u8,
    /// As delivered; left out where the manual does not say.
    pub(crate) default: Option<u8>,
}

/// Settings that the serial port can have.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SerialFile {
    /// Bits a second.
    pub(crate) baud: Vec<u32>,
    /// Parities.
    pub(crate) parity: Vec<Parity>,
    /// Numbers of stop bits.
    pub(crate) stop: Vec<u8>,
}

/// An exception code with a meaning of the maker's own.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExceptionFile {
    /// The code.
    pub(crate) code: u8,
    /// What the maker means by it.
    pub(crate) name: String,
}

/// A list of codes with a meaning.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChoiceListFile {
    /// The codes.
    pub(crate) values: Vec<At<ChoiceFile>>,
    /// Inclusive ranges of codes that the manual prints as reserved.
    #[serde(default)]
    pub(crate) reserved: Vec<At<(u32, u32)>>,
}

/// A code with a meaning.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChoiceFile {
    /// The code.
    pub(crate) value: u32,
    /// Its id, unique in the list.
    pub(crate) id: At<String>,
    /// Its label.
    pub(crate) label: String,
    /// The word of the point's signal that it stands for.
    pub(crate) state: Option<At<String>>,
    /// Whether the point's timer runs in this state; true unless said otherwise.
    pub(crate) timed: Option<bool>,
    /// Labels where the model is known: model = label.
    #[serde(default)]
    pub(crate) by_model: BTreeMap<At<String>, String>,
}

/// A list of named bits.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BitListFile {
    /// The bits.
    pub(crate) bits: Vec<At<BitFile>>,
    /// Inclusive ranges of bits that the manual prints as reserved: never reported.
    #[serde(default)]
    pub(crate) reserved: Vec<At<(u16, u16)>>,
}

/// A named bit.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BitFile {
    /// Its number, from bit 0 of the first register.
    pub(crate) bit: u16,
    /// Its id, unique in the list.
    pub(crate) id: At<String>,
    /// Its label.
    pub(crate) label: String,
    /// How serious it is, where it differs from the point.
    pub(crate) class: Option<Class>,
    /// Id of a flag in the vocabulary.
    pub(crate) signal: Option<At<String>>,
    /// The word of the point's signal that it stands for.
    pub(crate) state: Option<At<String>>,
    /// What it stands for while it is clear, where it alone tells the state.
    pub(crate) clear: Option<At<ClearFile>>,
    /// What the manual leaves open.
    pub(crate) doubt: Option<String>,
}

/// What a bit stands for while it is clear.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClearFile {
    /// Its label.
    pub(crate) label: String,
    /// The word of the point's signal.
    pub(crate) state: At<String>,
}

/// Points that belong together on a page.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GroupFile {
    /// Its id.
    pub(crate) id: At<String>,
    /// Its title.
    pub(crate) title: String,
    /// Page of the manual.
    pub(crate) page: Option<u16>,
    /// How often its points deserve to be read.
    pub(crate) rate: Rate,
    /// Its points.
    pub(crate) points: Vec<At<PointFile>>,
}

/// A fact that registers hold.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointFile {
    /// Modbus address of the first register.
    pub(crate) at: At<u16>,
    /// Its id, unique in the profile.
    pub(crate) id: At<String>,
    /// Its name, as a person reads it.
    pub(crate) name: String,
    /// How its registers are to be read.
    #[serde(rename = "type")]
    pub(crate) data_type: At<DataType>,
    /// What may be done with it; `r` unless said otherwise.
    pub(crate) access: Option<Access>,
    /// The register holds the value times this.
    pub(crate) coeff: Option<At<Decimal>>,
    /// The value is the register times this.
    pub(crate) ratio: Option<At<Decimal>>,
    /// What is added to the scaled register.
    pub(crate) offset: Option<At<Decimal>>,
    /// Unit of the number.
    pub(crate) unit: Option<At<String>>,
    /// Id in the shared vocabulary.
    pub(crate) signal: Option<At<String>>,
    /// Name of a list under `[choices]`.
    pub(crate) choices: Option<At<String>>,
    /// Name of a list under `[bits]`.
    pub(crate) bits: Option<At<String>>,
    /// Class of its bits, unless a bit has its own.
    pub(crate) class: Option<At<Class>>,
    /// Size in bits, of bits, bits2, bytes and image.
    pub(crate) size: Option<At<u16>>,
    /// Number of samples of a trace.
    pub(crate) count: Option<At<u16>>,
    /// Highest and lowest bit of a field of one register.
    pub(crate) mask: Option<At<(u8, u8)>>,
    /// Raw words that mean "no value".
    pub(crate) sentinels: Option<At<Vec<u32>>>,
    /// Id of the point that shows the delay of this state.
    pub(crate) timer: Option<At<String>>,
    /// Whether people read the number in hexadecimal.
    pub(crate) hex: Option<At<bool>>,
    /// What the manual leaves open.
    pub(crate) doubt: Option<String>,
    /// Where real hardware confirmed it.
    pub(crate) verified: Option<String>,
    /// Page of the manual, where it differs from the group's.
    pub(crate) page: Option<u16>,
    /// How often it deserves to be read, where it differs from the group's.
    pub(crate) rate: Option<Rate>,
}

/// A coil that function 5 writes.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CoilFile {
    /// Modbus address.
    pub(crate) at: u16,
    /// Its id.
    pub(crate) id: At<String>,
    /// Its name.
    pub(crate) name: String,
    /// Page of the manual.
    pub(crate) page: Option<u16>,
}

/// A remote command.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CommandFile {
    /// Its id.
    pub(crate) id: At<String>,
    /// Its name.
    pub(crate) name: String,
    /// What it may do.
    pub(crate) risk: Risk,
    /// Who may give it.
    pub(crate) role: Role,
    /// How it is to be confirmed, beyond the ordinary question.
    pub(crate) confirm: Option<Confirm>,
    /// Page of the manual.
    pub(crate) page: Option<u16>,
    /// Its arguments.
    #[serde(default)]
    pub(crate) args: Vec<At<ArgFile>>,
    /// What must hold, or the command is refused.
    #[serde(default)]
    pub(crate) require: Vec<At<ConditionFile>>,
    /// If all of this holds, the state is there already and nothing is sent.
    #[serde(default)]
    pub(crate) already: Vec<At<ConditionFile>>,
    /// What is waited for before the first write.
    pub(crate) hold: Option<At<HoldFile>>,
    /// The write, sent once; this or `steps`.
    pub(crate) write: Option<At<WriteFile>>,
    /// The writes of a procedure in their order, each sent once; this or `write`.
    pub(crate) steps: Option<At<Vec<At<StepFile>>>>,
    /// What shows the effect, step by step; this or `no_proof`.
    pub(crate) proof: Option<At<Vec<At<ProofFile>>>>,
    /// Why nothing shows the effect; this or `proof`.
    pub(crate) no_proof: Option<At<String>>,
}

/// One write of a procedure.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct StepFile {
    /// What must hold, also while `hold` is waited for, or the procedure ends before this step.
    #[serde(default)]
    pub(crate) require: Vec<At<ConditionFile>>,
    /// If all of this holds, the step is left out.
    #[serde(default)]
    pub(crate) already: Vec<At<ConditionFile>>,
    /// What is waited for before the write.
    pub(crate) hold: Option<At<HoldFile>>,
    /// The write, sent once.
    pub(crate) write: At<WriteFile>,
    /// What must show before the next step.
    #[serde(default)]
    pub(crate) proof: Vec<At<ProofFile>>,
}

/// What is waited for before a write: `all` at once, or `any`, within a time.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct HoldFile {
    /// All of this at once.
    #[serde(default)]
    pub(crate) all: Vec<At<HoldConditionFile>>,
    /// One of this.
    #[serde(default)]
    pub(crate) any: Vec<At<HoldConditionFile>>,
    /// How long it may take, in seconds; then the write is not sent.
    pub(crate) within_s: At<u16>,
}

/// A comparison of a point, or of an argument, with exactly one of `equals`, `not_equals`, `between`, `equals_arg`.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct HoldConditionFile {
    /// Id of the point; this or `arg`.
    pub(crate) point: Option<At<String>>,
    /// Name of the argument, `time.second` for a part of a time as it runs; this or `point`.
    pub(crate) arg: Option<At<String>>,
    /// Number of the bit, where the point is a set of them.
    pub(crate) bit: Option<At<u16>>,
    /// Raw code that it is.
    pub(crate) equals: Option<u32>,
    /// Raw code that it is not.
    pub(crate) not_equals: Option<u32>,
    /// Inclusive range of raw codes.
    pub(crate) between: Option<At<(u32, u32)>>,
    /// Name of the argument that it equals.
    pub(crate) equals_arg: Option<At<String>>,
}

/// An argument of a command: `choices`, or `min` and `max`, or `kind`.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ArgFile {
    /// Its name.
    pub(crate) name: At<String>,
    /// What it can be.
    pub(crate) choices: Option<At<Vec<At<ArgChoiceFile>>>>,
    /// Least number.
    pub(crate) min: Option<u16>,
    /// Greatest number.
    pub(crate) max: Option<u16>,
    /// `time`: a local date and time, whose parts are NAME.year (two digits), .month, .day, .hour, .minute, .second.
    pub(crate) kind: Option<At<ArgKind>>,
    /// What it is when it is not given (`now` for a time); it must be given where this is left out.
    pub(crate) default: Option<At<String>>,
}

/// One choice of an argument.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ArgChoiceFile {
    /// What a person writes.
    pub(crate) id: At<String>,
    /// What goes into the register.
    pub(crate) value: u16,
}

/// The write of a command.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct WriteFile {
    /// Function 5, 6 or 16.
    pub(crate) function: At<u8>,
    /// Coil or register address.
    pub(crate) address: At<u16>,
    /// The value.
    pub(crate) value: Option<At<u16>>,
    /// The value by what a point reads just before; not together with `value`.
    pub(crate) value_by: Option<At<ValueByFile>>,
    /// Name of the argument whose number is OR-ed onto the value; `time.year` for a part of a time.
    pub(crate) arg: Option<At<String>>,
}

/// A value that depends on a point.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ValueByFile {
    /// Id of the point.
    pub(crate) point: At<String>,
    /// Values by raw code; other codes are refused.
    pub(crate) values: Vec<At<WhenFile>>,
}

/// One value of a write.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct WhenFile {
    /// Raw code of the point.
    pub(crate) when: u32,
    /// What is written then.
    pub(crate) value: u16,
}

/// A comparison of a point with exactly one of `equals`, `not_equals`, `between`, `equals_arg`.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ConditionFile {
    /// Id of the point.
    pub(crate) point: At<String>,
    /// Number of the bit, where the point is a set of them.
    pub(crate) bit: Option<At<u16>>,
    /// Raw code that it is.
    pub(crate) equals: Option<u32>,
    /// Raw code that it is not.
    pub(crate) not_equals: Option<u32>,
    /// Inclusive range of raw codes.
    pub(crate) between: Option<At<(u32, u32)>>,
    /// Name of the argument that it equals.
    pub(crate) equals_arg: Option<At<String>>,
}

/// A step of a proof: a point and a comparison, or `device`, within a time.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ProofFile {
    /// Id of the point.
    pub(crate) point: Option<At<String>>,
    /// Number of the bit, where the point is a set of them.
    pub(crate) bit: Option<At<u16>>,
    /// Raw code that it becomes.
    pub(crate) equals: Option<u32>,
    /// Raw code that it leaves.
    pub(crate) not_equals: Option<u32>,
    /// Inclusive range of raw codes that it enters.
    pub(crate) between: Option<At<(u32, u32)>>,
    /// Name of the argument that it becomes equal to.
    pub(crate) equals_arg: Option<At<String>>,
    /// `true`: it becomes something else than it was before the write.
    pub(crate) changes: Option<At<bool>>,
    /// What the device as a whole does, in place of a point.
    pub(crate) device: Option<DeviceProof>,
    /// A joined clock, in place of a point; `equals_arg` names the time, which is compared as it runs.
    pub(crate) joined: Option<At<String>>,
    /// How far the clock may be from the time, in seconds.
    pub(crate) tolerance_s: Option<At<u16>>,
    /// How long it may take, in seconds.
    pub(crate) within_s: At<u16>,
}

/// A signal that several points make up: hours from `hours`, `minutes` and perhaps `seconds`, or a clock from the six
/// others.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JoinedFile {
    /// Id of the signal in the vocabulary: a number in h, or a clock.
    pub(crate) signal: At<String>,
    /// Id of the point of whole hours.
    pub(crate) hours: Option<At<String>>,
    /// Id of the point of minutes beside them.
    pub(crate) minutes: Option<At<String>>,
    /// Id of the point of seconds beside them.
    pub(crate) seconds: Option<At<String>>,
    /// Id of the point of the year, counted from 2000.
    pub(crate) year: Option<At<String>>,
    /// Id of the point of the month.
    pub(crate) month: Option<At<String>>,
    /// Id of the point of the day of the month.
    pub(crate) day: Option<At<String>>,
    /// Id of the point of the hour.
    pub(crate) hour: Option<At<String>>,
    /// Id of the point of the minute.
    pub(crate) minute: Option<At<String>>,
    /// Id of the point of the second.
    pub(crate) second: Option<At<String>>,
}

/// The vocabulary that all profiles share.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct VocabularyFile {
    pub(crate) format: At<u16>,
    pub(crate) signals: Vec<At<SignalFile>>,
}

/// One canonical signal.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SignalFile {
    pub(crate) id: At<String>,
    pub(crate) kind: SignalKind,
    pub(crate) unit: Option<At<String>>,
    #[serde(default)]
    pub(crate) words: Vec<String>,
    pub(crate) meaning: String,
}
