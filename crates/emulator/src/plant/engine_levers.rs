//! The levers that every diesel engine has with its tank and battery, and how words become states.

use crate::levers::{Lever, Position, Word};

use super::engine::Ignition;
use super::governor::Fault;
use super::load::tenth;
use super::senders::Senders;
use super::supplies::Health;
use super::{Battery, Engine, Tank};

pub(super) const NORMAL: Word = Word::new("normal", "As it should be");
pub(super) const SENDER: [Word; 2] = [NORMAL, Word::new("broken", "Its wire is broken: nothing is read")];

pub(super) const AMBIENT: Lever = Lever::of_numbers(
    "ambient",
    "Air outside",
    &[Word::new("normal", "It follows the day")],
    (-25.0, 50.0),
    "degC",
);
pub(super) const IGNITION: Lever = Lever::of_numbers(
    "ignition",
    "Ignition",
    &[
        Word::new("normal", "The engine fires after a second or two of cranking"),
        Word::new("never", "The engine does not fire"),
    ],
    (1.0, 10.0),
    "",
);
pub(super) const GOVERNOR: Lever = Lever::of_words(
    "governor",
    "Governor",
    &[
        NORMAL,
        Word::new("hunting", "The speed swings"),
        Word::new("runaway", "Full fuel, whatever the speed"),
        Word::new("sluggish", "It answers a load late"),
    ],
);
pub(super) const OIL: Lever = Lever::of_words(
    "oil",
    "Engine oil",
    &[NORMAL, Word::new("leaking", "It runs out, and the pressure goes with it")],
);
pub(super) const COOLANT: Lever =
    Lever::of_words("coolant", "Coolant", &[NORMAL, Word::new("leaking", "It runs out")]);
pub(super) const RADIATOR: Lever = Lever::of_words(
    "radiator",
    "Radiator",
    &[
        Word::new("clear", "Air goes through it"),
        Word::new("blocked", "Hardly any air goes through it: the engine overheats under load"),
    ],
);
pub(super) const FUEL_SUPPLY: Lever = Lever::of_words(
    "fuel.supply",
    "Fuel line",
    &[Word::new("open", "Fuel flows"), Word::new("shut", "The cock is shut: the engine dies in seconds")],
);
pub(super) const TANK: Lever = Lever::of_numbers("tank", "Fuel tank", &[], (0.0, 100.0), "%");
pub(super) const BATTERY: Lever = Lever::of_words(
    "battery",
    "Starter battery",
    &[
        NORMAL,
        Word::new("weak", "It turns the engine slowly, and not for long"),
        Word::new("flat", "It does not turn the engine"),
    ],
);
pub(super) const CHARGER: Lever =
    Lever::of_words("charger", "Battery charger", &[NORMAL, Word::new("failed", "It gives nothing")]);
pub(super) const CHARGE_ALTERNATOR: Lever = Lever::of_words(
    "charge_alternator",
    "Charge alternator",
    &[NORMAL, Word::new("failed", "It gives nothing: the charge lamp stays on")],
);
pub(super) const FUEL_SOLENOID: Lever = Lever::of_words(
    "fuel.solenoid",
    "Fuel solenoid",
    &[NORMAL, Word::new("stuck", "It does not close: the engine does not stop")],
);
pub(super) const OIL_PRESSURE_SENDER: Lever =
    Lever::of_words("sender.oil_pressure", "Oil pressure sender", &SENDER);
pub(super) const TEMPERATURE_SENDER: Lever =
    Lever::of_words("sender.temperature", "Engine temperature sender", &SENDER);
pub(super) const FUEL_LEVEL_SENDER: Lever =
    Lever::of_words("sender.fuel_level", "Fuel level sender", &SENDER);
pub(super) const PICKUP: Lever = Lever::of_words("pickup", "Speed pickup", &SENDER);
pub(super) const EMERGENCY_STOP: Lever = Lever::of_words(
    "emergency_stop",
    "Emergency stop button",
    &[Word::new("released", "Pulled out"), Word::new("pressed", "Fuel and starter have no supply")],
);

/// A word for each state of a part.
type Words<State> = [(&'static str, State)];

const GOVERNORS: [(&str, Fault); 4] = [
    ("normal", Fault::None),
    ("hunting", Fault::Hunting),
    ("runaway", Fault::RunningAway),
    ("sluggish", Fault::Sluggish),
];
const HEALTHS: [(&str, Health); 3] =
    [("normal", Health::Normal), ("weak", Health::Weak), ("flat", Health::Flat)];
const LEAKS: [(&str, bool); 2] = [("normal", false), ("leaking", true)];
pub(super) const FAILS: [(&str, bool); 2] = [("normal", false), ("failed", true)];
pub(super) const BREAKS: [(&str, bool); 2] = [("normal", false), ("broken", true)];
const STICKS: [(&str, bool); 2] = [("normal", false), ("stuck", true)];
pub(super) const BLOCKS: [(&str, bool); 2] = [("clear", false), ("blocked", true)];
pub(super) const PRESSES: [(&str, bool); 2] = [("released", false), ("pressed", true)];
const SHUTS: [(&str, bool); 2] = [("open", false), ("shut", true)];

/// Where a lever of an engine stands; none where there is no such lever.
pub(super) fn lever(
    id: &str,
    engine: &Engine,
    tank: &Tank,
    battery: &Battery,
    senders: Senders,
) -> Option<Position> {
    match id {
        "ignition" => Some(match engine.ignition() {
            Ignition::Normal => Position::Word("normal"),
            Ignition::Never => Position::Word("never"),
            Ignition::Attempt(attempt) => Position::Number(f64::from(attempt)),
        }),
        "governor" => shown(&GOVERNORS, engine.governor.fault),
        "oil" => shown(&LEAKS, engine.wear.oil_leaks),
        "coolant" => shown(&LEAKS, engine.wear.coolant_leaks),
        "radiator" => shown(&BLOCKS, engine.wear.radiator_blocked),
        "fuel.supply" => shown(&SHUTS, tank.shut),
        "fuel.solenoid" => shown(&STICKS, engine.wear.solenoid_stuck),
        "tank" => Some(Position::Number(tenth(tank.percent()))),
        "battery" => shown(&HEALTHS, battery.health()),
        "charger" => shown(&FAILS, battery.charger_failed),
        "charge_alternator" => shown(&FAILS, battery.alternator_failed),
        "sender.oil_pressure" => shown(&BREAKS, senders.oil_pressure),
        "sender.temperature" => shown(&BREAKS, senders.temperature),
        "sender.fuel_level" => shown(&BREAKS, senders.fuel_level),
        "pickup" => shown(&BREAKS, senders.pickup),
        _ => None,
    }
}

/// Pulls a lever of an engine. The first of the batteries turns its starter.
pub(super) fn pull(
    id: &str,
    to: Position,
    engine: &mut Engine,
    tank: &mut Tank,
    batteries: &mut [Battery],
    senders: &mut Senders,
) {
    match id {
        "ignition" => engine.set_ignition(match to {
            Position::Word("never") => Ignition::Never,
            Position::Word(_) => Ignition::Normal,
            Position::Number(attempt) => Ignition::Attempt(whole(attempt)),
        }),
        "governor" => set(&GOVERNORS, to, |fault| engine.governor.fault = fault),
        "oil" => set(&LEAKS, to, |leaks| engine.set_oil_leaks(leaks)),
        "coolant" => set(&LEAKS, to, |leaks| engine.set_coolant_leaks(leaks)),
        "radiator" => set(&BLOCKS, to, |blocked| engine.wear.radiator_blocked = blocked),
        "fuel.supply" => set(&SHUTS, to, |shut| tank.shut = shut),
        "fuel.solenoid" => set(&STICKS, to, |stuck| engine.wear.solenoid_stuck = stuck),
        "tank" => tank.fill_to(held(to).unwrap_or(tank.percent())),
        "battery" => set(&HEALTHS, to, |health| {
            batteries.iter_mut().take(1).for_each(|battery| battery.set_health(health));
        }),
        "charger" => set(&FAILS, to, |failed| {
            batteries.iter_mut().for_each(|battery| battery.charger_failed = failed);
        }),
        "charge_alternator" => set(&FAILS, to, |failed| {
            batteries.iter_mut().for_each(|battery| battery.alternator_failed = failed);
        }),
        "sender.oil_pressure" => set(&BREAKS, to, |broken| senders.oil_pressure = broken),
        "sender.temperature" => set(&BREAKS, to, |broken| senders.temperature = broken),
        "sender.fuel_level" => set(&BREAKS, to, |broken| senders.fuel_level = broken),
        "pickup" => set(&BREAKS, to, |broken| senders.pickup = broken),
        _ => {}
    }
}

/// The word of a state.
pub(super) fn shown<State: Copy + PartialEq>(words: &Words<State>, state: State) -> Option<Position> {
    words.iter().find(|(_, known)| *known == state).map(|(word, _)| Position::Word(word))
}

/// Brings a part into the state of a word.
pub(super) fn set<State: Copy>(words: &Words<State>, to: Position, put: impl FnOnce(State)) {
    let Position::Word(to) = to else { return };
    if let Some((_, state)) = words.iter().find(|(word, _)| *word == to) {
        put(*state);
    }
}

/// The number at which something is held; none at a word.
pub(super) fn held(to: Position) -> Option<f64> {
    match to {
        Position::Number(number) => Some(number),
        Position::Word(_) => None,
    }
}

/// Where something stands that is held at a number, or free.
pub(super) fn held_or(word: &'static str, held: Option<f64>) -> Option<Position> {
    Some(held.map_or(Position::Word(word), Position::Number))
}

/// A number of things, none of a lever being beyond 255.
pub(super) fn whole(number: f64) -> u8 {
    number.round().clamp(0.0, f64::from(u8::MAX)) as u8
}
