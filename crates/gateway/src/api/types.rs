//! The shapes of `/api/v1`: what every answer and every event holds, with its schema.
//!
//! These types are the contract of the API and nothing else: they are built from the live state, sent, and
//! forgotten. `openapi.json` is generated from them, and the page's own types from that file.

mod diagram;
mod event;
mod wire;

use std::borrow::Cow;

use busbar_profile::{self as profile, Number, Shown};
use serde::Serialize;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, OneOfBuilder, Schema, SchemaType, Type};
use utoipa::openapi::{RefOr, schema};
use utoipa::{PartialSchema, ToSchema};

use crate::gateway::Beside;

pub use self::diagram::{ConnectionView, DiagramView, NodeKind, NodeView};
pub use self::event::{AlarmsEvent, ResumedEvent, SnapshotEvent, StateEvent, ValuesEvent};
pub use self::wire::{
    ExceptionCount, LatencyBucket, LatencyView, PlanView, PlannedRead, PlannedRound, UnitState, UnitView,
    WireDetailView, WireState, WireStatistics, WireTime, WireView,
};

/// The site, without its devices.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SiteInfo {
    /// The name the site file gives.
    #[schema(examples("North hospital"))]
    pub name: String,
    /// Version of the gateway.
    #[schema(examples("0.1.0"))]
    pub version: String,
    /// When this gateway started.
    pub started: Time,
    /// The IANA time zone of the site; null when the site file gives none.
    #[schema(required, examples("Europe/Berlin"))]
    pub time_zone: Option<String>,
    /// Counts the site files that were accepted: 1 at start, one more after each reload.
    #[schema(examples(1))]
    pub revision: u64,
    /// Which site file runs.
    pub config: ConfigView,
    /// What else is served here that has a page of its own.
    pub beside: Vec<BesideView>,
}

/// Something that is served beside the gateway.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct BesideView {
    /// What it is called.
    #[schema(examples("Imitation"))]
    pub name: String,
    /// Its page, seen from this one.
    #[schema(examples("imitation/"))]
    pub path: String,
}

impl BesideView {
    pub(crate) fn of(beside: &Beside) -> Self {
        Self { name: beside.name.clone(), path: format!("{}/", beside.folder) }
    }
}

/// The site file that runs, and the one that was refused.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ConfigView {
    /// When the one that runs was accepted.
    pub loaded: Time,
    /// The newer one that was refused, so that the one before it goes on; null when there is none.
    #[schema(required)]
    pub refused: Option<RefusedView>,
}

/// A site file that was refused.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RefusedView {
    /// When.
    pub at: Time,
    /// What is wrong with it.
    #[schema(examples("site.toml:14:1: the wire `line` is not defined"))]
    pub reason: String,
}

/// The site, how it is connected, and every device on it.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct SiteView {
    /// The site.
    #[serde(flatten)]
    pub site: SiteInfo,
    /// The devices in the order of the site file.
    pub devices: Vec<DeviceView>,
    /// How it is connected.
    pub diagram: DiagramView,
}

/// One controller as it stands now.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct DeviceView {
    /// Its id in the site file.
    #[schema(examples("gen1"))]
    pub id: String,
    /// Its name in the site file.
    #[schema(examples("Genset 1"))]
    pub name: String,
    /// Key of its profile.
    #[schema(examples("datakom-d"))]
    pub profile: String,
    /// The maker.
    #[schema(examples("Datakom"))]
    pub vendor: String,
    /// What kind of controller it is.
    pub kind: Kind,
    /// The model it says it is; null until it has said so, or when it is one the profile does not know.
    #[schema(required, examples("D-500"))]
    pub model: Option<String>,
    /// The models that its profile is for.
    #[schema(examples(json!(["D-300", "D-500", "D-700"])))]
    pub models: Vec<String>,
    /// Id of the wire it is on.
    #[schema(examples("gen1"))]
    pub wire: String,
    /// Its unit id on that wire.
    #[schema(examples(1))]
    pub unit: u8,
    /// True while the device answers, even with an exception.
    pub online: bool,
    /// One sentence on what is wrong with reaching the device; null while nothing is.
    #[schema(
        required,
        examples(
            "Genset 1 cannot be read: unit 1 did not answer within 1s, asked 2 times: check the unit id and that the device is on; docs/connect/datakom-d.md says how to set it up and wire it"
        )
    )]
    pub fault: Option<String>,
    /// What it is doing; null when it has no such point or when that point is not good now.
    #[schema(required)]
    pub state: Option<StateView>,
    /// The mode it is in; null when it has no such point or when that point is not good now.
    #[schema(required)]
    pub mode: Option<ModeView>,
    /// How many alarms of each class are active.
    pub alarms: AlarmCounts,
    /// Why alarms and their counts are not to be relied on as they stand; null while all of them are read well.
    #[schema(required, examples("shutdown_alarms: the device answered exception 2 (illegal address)"))]
    pub alarms_fault: Option<String>,
    /// When it last answered; null before the first answer.
    #[schema(required)]
    pub last_seen: Option<Time>,
    /// Whether it is the device that the site file says.
    pub identity: IdentityView,
    /// What the site file wants of it, apart from what it is; null when the site file wants nothing.
    #[schema(required)]
    pub desired: Option<DesiredView>,
    /// What the site file says of the machine.
    pub nameplate: NameplateView,
}

/// Whether the device on the wire is the one that the site file says.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct IdentityView {
    /// What is known.
    pub verdict: Identity,
    /// Why, in one sentence; null while nothing is known.
    #[schema(required, examples("it says that it is a D-500"))]
    pub detail: Option<String>,
    /// When it was last asked and answered; null before that.
    #[schema(required)]
    pub checked: Option<Time>,
}

/// What is known of a device's identity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Identity {
    /// Not asked yet, or not answered since the connection was made anew.
    #[default]
    Unknown,
    /// It answers what only its profile documents, but names no model that the profile knows.
    Plausible,
    /// It names a model of its profile, and the one that the site file wants.
    Confirmed,
    /// It is another device: nothing of it is taken but its identity.
    Wrong,
}

/// What the site file wants of a device. The gateway does nothing about it; a person does.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct DesiredView {
    /// The mode that it should be in.
    #[schema(examples("auto"))]
    pub mode: String,
    /// Whether it is; null while that is not known.
    #[schema(required)]
    pub met: Option<bool>,
}

/// What stands on the machine and what belongs to it. Null where the site file does not say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, ToSchema)]
pub struct NameplateView {
    /// Power in kW.
    #[schema(required, examples(400.0))]
    pub power_kw: Option<f64>,
    /// Fuel that the tank holds in litres.
    #[schema(required, examples(900.0))]
    pub tank_l: Option<f64>,
    /// Nominal voltage of the starter battery.
    #[schema(required, examples(24.0))]
    pub battery_v: Option<f64>,
}

/// What kind of controller a device is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Runs an engine and generator.
    Genset,
    /// Chooses between two sources.
    TransferSwitch,
    /// Runs an engine-driven compressor.
    Compressor,
}

/// What a device is doing.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StateView {
    /// The code in the register.
    #[schema(examples(12))]
    pub code: u32,
    /// The maker's name of that code.
    #[schema(examples("Genset on load"))]
    pub label: String,
    /// The shared word of the vocabulary: `stopped`, `cranking`, `loaded` and so on; null where there is none.
    #[schema(required, examples("loaded"))]
    pub canonical: Option<String>,
    /// Seconds left in this state; null where the device counts none.
    #[schema(required, value_type = Option<f64>, examples(7))]
    pub timer_s: Option<Number>,
}

/// The mode a device is in.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ModeView {
    /// The code in the register, or the number of the bit that tells the mode.
    #[schema(examples(4))]
    pub code: u32,
    /// The maker's name of that mode.
    #[schema(examples("AUTO"))]
    pub label: String,
    /// The shared word of the vocabulary: `off`, `manual`, `auto` and so on; null where there is none.
    #[schema(required, examples("auto"))]
    pub canonical: Option<String>,
}

/// Active alarms, counted by class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, ToSchema)]
pub struct AlarmCounts {
    /// The machine is stopped at once.
    pub shutdown: u32,
    /// The load is dropped, then the machine stops.
    pub load_dump: u32,
    /// A breaker is opened.
    pub trip: u32,
    /// Somebody should look.
    pub warning: u32,
    /// For information.
    pub indication: u32,
}

/// The points of a device, in the groups of its profile.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PointsView {
    /// The maker's manual that says so: its title and its revision, as far as it has one.
    #[schema(examples("D-300 / 500 / 700 Modbus Application Manual, V5.6 (25.04.2016)"))]
    pub manual: String,
    /// The groups in the order of the profile.
    pub groups: Vec<GroupView>,
    /// What several of its points make up, in the order of the profile.
    pub joined: Vec<JoinedPointView>,
}

impl PointsView {
    /// The part of it that carries one of these signals: points that are it, bits that are it, joined signals.
    pub(crate) fn carrying(&self, signals: &[&str]) -> Self {
        let wanted = |signal: &Option<String>| signal.as_deref().is_some_and(|id| signals.contains(&id));
        let point = |point: &PointView| {
            let bits: Vec<BitView> = point.bits.iter().filter(|bit| wanted(&bit.signal)).cloned().collect();
            (wanted(&point.signal) || !bits.is_empty()).then(|| PointView { bits, ..point.clone() })
        };
        let groups = self.groups.iter().map(|group| GroupView {
            points: group.points.iter().filter_map(point).collect(),
            ..group.clone()
        });
        Self {
            manual: self.manual.clone(),
            groups: groups.filter(|group| !group.points.is_empty()).collect(),
            joined: self
                .joined
                .iter()
                .filter(|joined| signals.contains(&joined.signal.as_str()))
                .cloned()
                .collect(),
        }
    }
}

/// What a joined signal is: one value out of several points, such as hours out of hours, minutes and seconds.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct JoinedPointView {
    /// Its id in the shared vocabulary.
    #[schema(examples("engine.hours"))]
    pub signal: String,
    /// What it means.
    #[schema(examples("Hours the engine has run"))]
    pub meaning: String,
    /// Its unit; null for a clock.
    #[schema(required, examples("h"))]
    pub unit: Option<String>,
    /// How often its points are read.
    pub rate: Rate,
    /// Ids of its points.
    pub points: Vec<String>,
}

/// One group of points.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct GroupView {
    /// Its id, unique in the profile.
    #[schema(examples("genset"))]
    pub id: String,
    /// Its heading.
    #[schema(examples("Genset"))]
    pub title: String,
    /// How often its points are read, unless a point says otherwise.
    pub rate: Rate,
    /// Its readable points in the order of the profile.
    pub points: Vec<PointView>,
}

/// How often a point is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rate {
    /// Every second unless the site file says otherwise.
    Fast,
    /// Every ten seconds unless the site file says otherwise.
    Slow,
    /// Once, and again after the device was away.
    Once,
    /// Only while somebody looks.
    OnDemand,
}

/// What a point is. It does not change while the gateway runs.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PointView {
    /// Its id, unique in the profile.
    #[schema(examples("genset_l1_voltage"))]
    pub id: String,
    /// Its name.
    #[schema(examples("Genset phase L1 voltage"))]
    pub name: String,
    /// Its first register, as the manual prints it (and as it stands on the wire).
    #[schema(examples(10246))]
    pub address: u16,
    /// The same register in the 4xxxx numbers of PLCs: 40001 + address up to address 9998, 400001 + address above.
    #[schema(examples(410_247))]
    pub plc: u32,
    /// How many registers it takes.
    #[schema(examples(2))]
    pub registers: u16,
    /// Its unit; null where it has none or the manual gives none.
    #[schema(required, examples("V"))]
    pub unit: Option<String>,
    /// How its registers are read.
    #[serde(rename = "type")]
    pub data_type: PointType,
    /// How often it is read: its own rate, where that is not its group's.
    pub rate: Rate,
    /// Its id in the shared vocabulary.
    #[schema(required, examples("genset.l1.voltage"))]
    pub signal: Option<String>,
    /// What is uncertain about it, where the manual is.
    #[schema(required, examples("sign"))]
    pub doubt: Option<String>,
    /// Page of the manual where it stands.
    #[schema(required, examples(11))]
    pub page: Option<u16>,
    /// The named values of a choice; empty for everything else.
    pub choices: Vec<ChoiceView>,
    /// The named bits of a bit array; empty for everything else.
    pub bits: Vec<BitView>,
}

/// How a point's registers are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum PointType {
    /// 8 bits, unsigned.
    U8,
    /// 8 bits, two's complement.
    I8,
    /// 16 bits, unsigned.
    U16,
    /// 16 bits, two's complement.
    I16,
    /// 32 bits, unsigned.
    U32,
    /// 32 bits, two's complement.
    I32,
    /// 16 bits, sign and magnitude.
    Sm16,
    /// 24 bits of magnitude and a sign byte.
    Sm24,
    /// An array of single bits.
    Bits,
    /// An array of two-bit fields.
    Bits2,
    /// One of a list of named values.
    Choice,
    /// An 8-bit share of full scale.
    Fraction8,
    /// A 16-bit share of full scale.
    Fraction16,
    /// An array of samples.
    Trace,
    /// A picture.
    Image,
    /// Opaque bytes.
    Bytes,
}

/// One named value of a choice.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ChoiceView {
    /// The code in the register.
    #[schema(examples(12))]
    pub value: u32,
    /// Its name.
    #[schema(examples("Genset on load"))]
    pub label: String,
}

/// One named bit of a bit array.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct BitView {
    /// Its number, counted from bit 0 of the first register.
    #[schema(examples(48))]
    pub bit: u16,
    /// Its id, unique in its point.
    #[schema(examples("genset_low_frequency"))]
    pub id: String,
    /// Its name.
    #[schema(examples("Genset low frequency"))]
    pub label: String,
    /// The class of alarm it is; null when it is none.
    #[schema(required)]
    pub class: Option<Class>,
    /// Its id in the shared vocabulary.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, examples("breaker.genset.closed"))]
    pub signal: Option<String>,
}

/// The class of a bit, the gravest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The machine is stopped at once.
    Shutdown,
    /// The load is dropped, then the machine stops.
    LoadDump,
    /// A breaker is opened.
    Trip,
    /// Somebody should look.
    Warning,
    /// For information.
    Indication,
    /// Not an alarm: something that is so or not so.
    Status,
}

/// What a point reads now.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ValueView {
    /// Id of the point.
    #[schema(examples("genset_l1_voltage"))]
    pub id: String,
    /// The last good value; null when there is none or when the device says that it has none.
    pub value: PointValue,
    /// The code behind the label of a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, examples(12))]
    pub code: Option<u32>,
    /// The numbers of the set bits behind the labels of a bit array.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub set: Option<Vec<u16>>,
    /// Its unit.
    #[schema(required, examples("V"))]
    pub unit: Option<String>,
    /// How far the value is to be trusted.
    pub quality: Quality,
    /// When the value was last read well; null before that.
    #[schema(required)]
    pub ts: Option<Time>,
    /// Why the quality is `bad`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, examples("the device answered exception 2 (illegal address)"))]
    pub error: Option<String>,
    /// The registers behind the value; null before the first good read.
    #[schema(required)]
    pub raw: Option<Vec<u16>>,
}

/// What several points of a device make up now.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct JoinedView {
    /// Its id in the shared vocabulary.
    #[schema(examples("engine.hours"))]
    pub signal: String,
    /// Hours as a number, a clock as local date and time; null when there is none or when its points make none.
    pub value: PointValue,
    /// Its unit; null for a clock.
    #[schema(required, examples("h"))]
    pub unit: Option<String>,
    /// As good as the worst of its points.
    pub quality: Quality,
    /// When its points were last all read well in one round; null before that.
    #[schema(required)]
    pub ts: Option<Time>,
}

/// How far a value is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum Quality {
    /// Read, and not long ago.
    Good,
    /// Not read for longer than three times its rate (five seconds at least), or not read yet.
    Stale,
    /// The device says that it has no value.
    Invalid,
    /// The device answered with an exception, or not at all.
    Bad,
}

/// One active alarm.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct AlarmView {
    /// Id of the device.
    #[schema(examples("gen1"))]
    pub device: String,
    /// Id of the point that holds the bit.
    #[schema(examples("shutdown_alarms"))]
    pub point: String,
    /// Number of the bit in its point.
    #[schema(examples(48))]
    pub bit: u16,
    /// Id of the bit; `bit_N` where the profile names none.
    #[schema(examples("genset_low_frequency"))]
    pub id: String,
    /// Its name.
    #[schema(examples("Genset low frequency"))]
    pub label: String,
    /// How grave it is.
    pub class: Class,
    /// When the gateway first saw it set.
    pub since: Time,
}

/// A value as JSON has it: a number, a label, an array of labels or codes, or null.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[serde(untagged)]
pub enum PointValue {
    /// No value.
    #[default]
    None,
    /// A number, exact.
    Number(Number),
    /// The label of a choice, or hexadecimal bytes.
    Text(String),
    /// Labels of the bits that are set.
    Labels(Vec<String>),
    /// Codes of two-bit fields, or samples of a trace.
    Numbers(Vec<Number>),
}

impl From<Shown<'_>> for PointValue {
    fn from(shown: Shown<'_>) -> Self {
        match shown {
            Shown::Number(number) => Self::Number(number),
            Shown::Label(label) => Self::Text(label.into_owned()),
            Shown::Labels(labels) => Self::Labels(labels.into_iter().map(Cow::into_owned).collect()),
            Shown::Codes(codes) => {
                Self::Numbers(codes.into_iter().map(|code| i64::from(code).into()).collect())
            }
            Shown::Numbers(numbers) => Self::Numbers(numbers),
            Shown::Hex(hex) => Self::Text(hex),
            _ => Self::None,
        }
    }
}

impl PartialSchema for PointValue {
    fn schema() -> RefOr<Schema> {
        let of = |kind| ObjectBuilder::new().schema_type(kind);
        let elements = SchemaType::from_iter([Type::String, Type::Number]);
        RefOr::T(Schema::OneOf(
            OneOfBuilder::new()
                .description(Some(
                    "A number, the label of a choice (or hexadecimal bytes), an array of labels of set bits or of \
                     codes, or null.",
                ))
                .item(of(Type::Number))
                .item(of(Type::String))
                .item(ArrayBuilder::new().items(ObjectBuilder::new().schema_type(elements)))
                .item(of(Type::Null))
                .examples([serde_json::json!(230.2)])
                .build(),
        ))
    }
}

impl ToSchema for PointValue {}

/// The API spells the closed word lists itself: its contract must not move with the profile format.
macro_rules! same_words {
    ($($name:ident { $($variant:ident),+ $(,)? })+) => {
        $(impl From<profile::$name> for same_words!(@target $name) {
            fn from(word: profile::$name) -> Self {
                match word {
                    $(profile::$name::$variant => Self::$variant,)+
                }
            }
        })+
    };
    (@target DataType) => { PointType };
    (@target $name:ident) => { $name };
}

same_words! {
    Kind { Genset, TransferSwitch, Compressor }
    Rate { Fast, Slow, Once, OnDemand }
    Class { Shutdown, LoadDump, Trip, Warning, Indication, Status }
    Quality { Good, Stale, Invalid, Bad }
    DataType { U8, I8, U16, I16, U32, I32, Sm16, Sm24, Bits, Bits2, Choice, Fraction8, Fraction16, Trace, Image, Bytes }
}

/// An instant, printed as RFC 3339 in UTC with milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Time(jiff::Timestamp);

impl Time {
    /// The instant a clock gave.
    pub const fn new(timestamp: jiff::Timestamp) -> Self {
        Self(timestamp)
    }

    /// How long ago it was; nothing when a clock that was set back has it in the future.
    pub(crate) fn age(self) -> std::time::Duration {
        jiff::Timestamp::now().duration_since(self.0).try_into().unwrap_or_default()
    }
}

impl std::fmt::Display for Time {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.3}", self.0)
    }
}

impl Serialize for Time {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl PartialSchema for Time {
    fn schema() -> RefOr<Schema> {
        RefOr::T(Schema::Object(
            ObjectBuilder::new()
                .schema_type(Type::String)
                .format(Some(schema::SchemaFormat::KnownFormat(schema::KnownFormat::DateTime)))
                .description(Some("An instant: RFC 3339, UTC, milliseconds."))
                .examples([serde_json::json!("2026-11-23T10:15:30.123Z")])
                .build(),
        ))
    }
}

impl ToSchema for Time {}
