//! The shapes of the API: what every answer and every body holds, with its schema.

use busbar_profile as profile;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::openapi::schema::{ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::openapi::{RefOr, schema};
use utoipa::{PartialSchema, ToSchema};

use super::plant::levers_of;
use super::site::Imitated;
use crate::device::Device;
use crate::inject::Alarm;
use crate::levers::{Lever, Position};
use crate::scenario::{Event, EventKind, Report};
use crate::server::Controller;

/// One imitated controller: what it is, how its clock runs, and what was done to it.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct ControllerView {
    /// Its id in addresses.
    #[schema(examples("genset-1"))]
    pub(super) id: String,
    /// Its name.
    #[schema(examples("Genset 1"))]
    pub(super) name: String,
    /// Key of its profile.
    #[schema(examples("datakom-d"))]
    pub(super) profile: &'static str,
    /// The maker.
    #[schema(examples("Datakom"))]
    pub(super) vendor: &'static str,
    /// Its model.
    #[schema(examples("D-500"))]
    pub(super) model: String,
    /// What kind of controller it is.
    pub(super) kind: Kind,
    /// The unit id that it answers to.
    #[schema(examples(1))]
    pub(super) unit: u8,
    /// Where it answers.
    #[schema(examples(json!(["tcp://127.0.0.1:1502"])))]
    pub(super) endpoints: Vec<String>,
    /// Its seed: the same seed, levers and times give the same registers.
    #[schema(examples(1))]
    pub(super) seed: u64,
    /// How its clock runs.
    pub(super) clock: ClockView,
    /// What can be made to happen to its plant, with what is.
    pub(super) levers: Vec<LeverView>,
    /// The alarms that are injected, in the order in which they were.
    pub(super) injected: Vec<AlarmView>,
    /// The alarms that a client reads as active now, injected or not.
    pub(super) active: Vec<AlarmView>,
    /// The scenario that is played; null where none is.
    #[schema(required)]
    pub(super) scenario: Option<ScenarioView>,
    /// Ids of the points that are pinned.
    #[schema(examples(json!(["battery_voltage"])))]
    pub(super) pinned: Vec<&'static str>,
}

/// What has become of a scenario so far.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct ScenarioView {
    /// What it is called.
    #[schema(examples("Mains failure and return"))]
    pub(super) title: String,
    /// How many steps it has.
    pub(super) steps: usize,
    /// How many of them were taken.
    pub(super) taken: usize,
    /// How many expectations have failed.
    pub(super) failed: usize,
    /// Whether everything that was expected came; null while it is played.
    #[schema(required)]
    pub(super) held: Option<bool>,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct EventView {
    /// When, in simulated seconds since power-on.
    #[schema(examples(12.5))]
    pub(super) at_s: f64,
    /// Whether somebody did it (`action`), or the panel showed it (`change`).
    #[schema(examples("action"))]
    pub(super) kind: EventKindView,
    /// What, in words.
    #[schema(examples("Mains: failed"))]
    pub(super) text: String,
}

/// What kind of event it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum EventKindView {
    /// Somebody did it.
    Action,
    /// The panel showed it.
    Change,
}

/// What kind of controller it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum Kind {
    /// A genset controller.
    Genset,
    /// A transfer switch.
    TransferSwitch,
    /// A compressor controller.
    Compressor,
}

/// How a simulated clock runs.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct ClockView {
    /// Simulated seconds since power-on, in whole steps of the plant.
    #[schema(examples(61.5))]
    pub(super) time_s: f64,
    /// Simulated seconds a second while it runs.
    #[schema(examples(1.0))]
    pub(super) speed: f64,
    /// It stands still, but for steps by hand.
    pub(super) paused: bool,
}

/// How a clock is to run; what is left out stays as it is.
#[derive(Clone, Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub(super) struct ClockChange {
    /// Simulated seconds a second: above 0 and up to 3600.
    #[serde(default, deserialize_with = "given")]
    #[schema(nullable = false, exclusive_minimum = 0, maximum = 3600, examples(60))]
    pub(super) speed: Option<f64>,
    /// Whether it is to stand still.
    #[serde(default, deserialize_with = "given")]
    #[schema(nullable = false)]
    pub(super) paused: Option<bool>,
}

/// How far a clock is to go on at once.
#[derive(Clone, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub(super) struct Step {
    /// Simulated seconds, up to an hour.
    #[schema(exclusive_minimum = 0, maximum = 3600, examples(10))]
    pub(super) seconds: f64,
}

/// One thing that can be made to happen to a plant: by the grid, by wear, by a person on site.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct LeverView {
    /// Its id.
    #[schema(examples("mains"))]
    pub(super) id: &'static str,
    /// What people call it.
    #[schema(examples("Mains"))]
    pub(super) name: &'static str,
    /// Words that it can be set to; the first is how a healthy plant has it.
    pub(super) words: Vec<WordView>,
    /// Numbers that it can be set to; null where it takes words alone.
    #[schema(required)]
    pub(super) numbers: Option<NumbersView>,
    /// Where it stands.
    pub(super) position: Given,
    /// Where it was before somebody pulled it; null where there is nothing to put back.
    #[schema(required)]
    pub(super) back: Option<Given>,
}

/// A word that a lever can be set to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub(super) struct WordView {
    /// The word.
    #[schema(examples("failed"))]
    pub(super) id: &'static str,
    /// What it does.
    #[schema(examples("No voltage on any phase"))]
    pub(super) meaning: &'static str,
}

/// Numbers that a lever can be set to.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct NumbersView {
    /// Least.
    pub(super) min: f64,
    /// Greatest.
    pub(super) max: f64,
    /// Unit of both; empty for a count.
    #[schema(examples("kW"))]
    pub(super) unit: &'static str,
}

/// Where a lever is to stand.
#[derive(Clone, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub(super) struct Pull {
    /// One of its words, or a number in its range.
    pub(super) position: Given,
}

/// An alarm of a controller.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub(super) struct AlarmView {
    /// Its name: the id of its point and of its bit. The latter alone will do where only one point has it.
    #[schema(examples("shutdown_alarms.genset_low_frequency"))]
    pub(super) id: String,
    /// What people call it.
    #[schema(examples("Genset low frequency"))]
    pub(super) label: &'static str,
    /// How serious it is.
    #[schema(examples("shutdown"))]
    pub(super) class: &'static str,
    /// Whether it is injected: the panel takes it for active, whatever the plant says.
    pub(super) injected: bool,
}

/// A point that is kept at a value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub(super) struct PinView {
    /// Its id.
    #[schema(examples("battery_voltage"))]
    pub(super) point: &'static str,
    /// What it is kept at, as people read it; null where that means that it is absent.
    #[schema(required, examples("11.5"))]
    pub(super) value: Option<String>,
    /// The registers that hold it.
    #[schema(examples(json!([115])))]
    pub(super) registers: Vec<u16>,
}

/// A point that a client can read, and that can be pinned.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, ToSchema)]
pub(super) struct PointView {
    /// Its id.
    #[schema(examples("battery_voltage"))]
    pub(super) id: &'static str,
    /// Its name.
    #[schema(examples("Battery voltage"))]
    pub(super) name: &'static str,
    /// Unit of a number; null where it has none or the manual gives none.
    #[schema(required, examples("V"))]
    pub(super) unit: Option<&'static str>,
    /// Its signal in the vocabulary; null where it has none.
    #[schema(required, examples("battery.voltage"))]
    pub(super) signal: Option<&'static str>,
}

/// What a point is to be kept at.
#[derive(Clone, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub(super) struct Pin {
    /// As `--set` takes it: a number, the id of a choice, ids of bits with commas between them, `none`, or `absent`.
    pub(super) value: Given,
}

/// A timer, threshold or number of attempts of the panel.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(super) struct SettingView {
    /// Its id.
    #[schema(examples("start_attempts"))]
    pub(super) id: &'static str,
    /// What people call it.
    #[schema(examples("Start attempts"))]
    pub(super) name: &'static str,
    /// What it is set to.
    #[schema(examples(3.0))]
    pub(super) value: f64,
    /// Least.
    pub(super) min: f64,
    /// Greatest.
    pub(super) max: f64,
    /// Its unit; null for a count, or for yes (1) and no (0).
    #[schema(required, examples("s"))]
    pub(super) unit: Option<&'static str>,
}

/// What a setting is to be.
#[derive(Clone, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, expecting = "an object")]
pub(super) struct Set {
    /// A number in its range.
    pub(super) value: Given,
}

/// A word or a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a text or a number is needed")]
pub(super) enum Given {
    /// A word, or a number as text.
    Text(String),
    /// A number.
    Number(f64),
}

/// What may be left out, and is no null where it is given.
fn given<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

impl Given {
    /// As a person would write it.
    pub(super) fn text(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number(number) => number.to_string(),
        }
    }
}

impl PartialSchema for Given {
    fn schema() -> RefOr<Schema> {
        let one = |kind| schema::Schema::Object(ObjectBuilder::new().schema_type(kind).build());
        OneOfBuilder::new()
            .description(Some("A word or a number."))
            .item(one(Type::String))
            .item(one(Type::Number))
            .into()
    }
}

impl ToSchema for Given {}

impl From<Position> for Given {
    fn from(position: Position) -> Self {
        match position {
            Position::Word(word) => Self::Text(word.to_owned()),
            Position::Number(number) => Self::Number(number),
        }
    }
}

impl From<profile::Kind> for Kind {
    fn from(kind: profile::Kind) -> Self {
        match kind {
            profile::Kind::Genset => Self::Genset,
            profile::Kind::TransferSwitch => Self::TransferSwitch,
            profile::Kind::Compressor => Self::Compressor,
        }
    }
}

impl ControllerView {
    pub(super) fn of(imitated: &Imitated) -> Self {
        let Imitated { id, name, controller } = imitated;
        let clock = ClockView::of(controller);
        controller.with(|device| {
            let profile = device.profile();
            Self {
                id: id.clone(),
                name: name.clone(),
                profile: &profile.key,
                vendor: &profile.vendor,
                model: device.model().to_owned(),
                kind: profile.kind.into(),
                unit: device.unit(),
                endpoints: controller.endpoints().iter().map(ToString::to_string).collect(),
                seed: device.seed(),
                clock,
                levers: levers_of(device),
                injected: device.injected().iter().map(|alarm| AlarmView::of(alarm, true)).collect(),
                active: active_of(device),
                scenario: device.report().map(ScenarioView::of),
                pinned: device.pinned().filter_map(|index| Some(&*profile.points.get(index)?.id)).collect(),
            }
        })
    }
}

fn active_of(device: &Device) -> Vec<AlarmView> {
    let injected = device.injected();
    device.active().iter().map(|alarm| AlarmView::of(alarm, injected.contains(alarm))).collect()
}

impl ScenarioView {
    fn of(report: &Report) -> Self {
        Self {
            title: report.title.clone(),
            steps: report.steps,
            taken: report.taken,
            failed: report.failures().count(),
            held: report.held,
        }
    }
}

impl EventView {
    pub(super) fn of(event: &Event) -> Self {
        let kind = match event.kind {
            EventKind::Action => EventKindView::Action,
            _ => EventKindView::Change,
        };
        Self { at_s: event.at.as_secs_f64(), kind, text: event.text.clone() }
    }
}

impl ClockView {
    pub(super) fn of(controller: &Controller) -> Self {
        let pace = controller.pace();
        let time_s = controller.with(|device| device.time().as_secs_f64());
        Self { time_s, speed: pace.speed, paused: pace.paused }
    }
}

impl LeverView {
    pub(super) fn of(lever: &Lever, position: Position, back: Option<Position>) -> Self {
        Self {
            id: lever.id,
            name: lever.name,
            words: lever.words.iter().map(|word| WordView { id: word.id, meaning: word.meaning }).collect(),
            numbers: lever.numbers.map(|numbers| NumbersView {
                min: numbers.min,
                max: numbers.max,
                unit: numbers.unit,
            }),
            position: position.into(),
            back: back.map(Given::from),
        }
    }
}

impl AlarmView {
    pub(super) fn of(alarm: &Alarm, injected: bool) -> Self {
        Self {
            id: format!("{}.{}", alarm.point, alarm.id),
            label: alarm.label,
            class: alarm.class.as_str(),
            injected,
        }
    }
}
