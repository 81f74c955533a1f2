//! The levers of a genset's plant.

use crate::levers::{Lever, Position, Word};

use super::Plant;
use super::alternator::Avr;
use super::breaker::Stuck;
use super::engine::Ignition;
use super::governor::Fault;
use super::grid::Condition;
use super::load::{Demand, tenth};
use super::sisters;
use super::supplies::Health;

const NORMAL: Word = Word::new("normal", "As it should be");
const SENDER: [Word; 2] = [NORMAL, Word::new("broken", "Its wire is broken: nothing is read")];
const BREAKER: [Word; 3] = [
    NORMAL,
    Word::new("will_not_close", "It refuses to close"),
    Word::new("will_not_open", "It refuses to open"),
];

/// In the order in which people are shown them.
pub(crate) const LEVERS: &[Lever] = &[
    Lever::of_words(
        "mains",
        "Mains",
        &[
            Word::new("normal", "All phases are there"),
            Word::new("failed", "No voltage on any phase"),
            Word::new("sagging", "All phases are far too low"),
            Word::new("swelling", "All phases are far too high"),
            Word::new("l1_lost", "No voltage on L1"),
            Word::new("l2_lost", "No voltage on L2"),
            Word::new("l3_lost", "No voltage on L3"),
            Word::new("reversed", "Two phases have changed places"),
            Word::new("flickering", "The voltage dips every few seconds"),
        ],
    ),
    Lever::of_numbers(
        "mains.voltage",
        "Mains voltage, phase to neutral",
        &[Word::new("normal", "It wanders about 231 V")],
        (0.0, 320.0),
        "V",
    ),
    Lever::of_numbers(
        "mains.frequency",
        "Mains frequency",
        &[Word::new("normal", "It wanders about 50 Hz")],
        (40.0, 65.0),
        "Hz",
    ),
    Lever::of_numbers(
        "load",
        "Load",
        &[
            Word::new("varies", "Consumers come and go"),
            Word::new("daily", "The curve of a working day, from ten in the morning on"),
        ],
        (0.0, 150.0),
        "kW",
    ),
    Lever::of_numbers(
        "load.power_factor",
        "Power factor of the load",
        &[Word::new("varies", "It wanders about 0.885, inductive")],
        (0.5, 1.0),
        "",
    ),
    Lever::of_words(
        "load.balance",
        "Balance of the load",
        &[
            Word::new("even", "About a third on each phase"),
            Word::new("uneven", "More than half of it on L1"),
        ],
    ),
    Lever::of_numbers(
        "ambient",
        "Air outside",
        &[Word::new("normal", "It follows the day")],
        (-25.0, 50.0),
        "degC",
    ),
    Lever::of_numbers(
        "ignition",
        "Ignition",
        &[
            Word::new("normal", "The engine fires after a second or two of cranking"),
            Word::new("never", "The engine does not fire"),
        ],
        (1.0, 10.0),
        "",
    ),
    Lever::of_words(
        "governor",
        "Governor",
        &[
            NORMAL,
            Word::new("hunting", "The speed swings"),
            Word::new("runaway", "Full fuel, whatever the speed"),
            Word::new("sluggish", "It answers a load late"),
        ],
    ),
    Lever::of_words(
        "avr",
        "Voltage regulator",
        &[
            NORMAL,
            Word::new("failed", "No excitation"),
            Word::new("high", "Full excitation, whatever the voltage"),
        ],
    ),
    Lever::of_words(
        "oil",
        "Engine oil",
        &[NORMAL, Word::new("leaking", "It runs out, and the pressure goes with it")],
    ),
    Lever::of_words("coolant", "Coolant", &[NORMAL, Word::new("leaking", "It runs out")]),
    Lever::of_words(
        "radiator",
        "Radiator",
        &[
            Word::new("clear", "Air goes through it"),
            Word::new("blocked", "Hardly any air goes through it: the engine overheats under load"),
        ],
    ),
    Lever::of_words(
        "fuel.supply",
        "Fuel line",
        &[Word::new("open", "Fuel flows"), Word::new("shut", "The cock is shut: the engine dies in seconds")],
    ),
    Lever::of_words(
        "fuel.solenoid",
        "Fuel solenoid",
        &[NORMAL, Word::new("stuck", "It does not close: the engine does not stop")],
    ),
    Lever::of_words(
        "fuel.pump",
        "Pump into the day tank",
        &[NORMAL, Word::new("failed", "It pumps nothing")],
    ),
    Lever::of_numbers("tank", "Day tank", &[], (0.0, 100.0), "%"),
    Lever::of_words(
        "battery",
        "Starter battery",
        &[
            NORMAL,
            Word::new("weak", "It turns the engine slowly, and not for long"),
            Word::new("flat", "It does not turn the engine"),
        ],
    ),
    Lever::of_words("charger", "Battery charger", &[NORMAL, Word::new("failed", "It gives nothing")]),
    Lever::of_words(
        "charge_alternator",
        "Charge alternator",
        &[NORMAL, Word::new("failed", "It gives nothing: the charge lamp stays on")],
    ),
    Lever::of_words("breaker.genset", "Genset breaker", &BREAKER),
    Lever::of_words("breaker.mains", "Mains breaker", &BREAKER),
    Lever::of_words("sender.oil_pressure", "Oil pressure sender", &SENDER),
    Lever::of_words("sender.temperature", "Engine temperature sender", &SENDER),
    Lever::of_words("sender.fuel_level", "Fuel level sender", &SENDER),
    Lever::of_words("pickup", "Speed pickup", &SENDER),
    Lever::of_words(
        "emergency_stop",
        "Emergency stop button",
        &[Word::new("released", "Pulled out"), Word::new("pressed", "Fuel and starter have no supply")],
    ),
    Lever::of_words(
        "remote_start",
        "Remote start contact",
        &[Word::new("off", "Open"), Word::new("on", "Closed: somebody wants the genset")],
    ),
    Lever::of_numbers(
        "busbar.gensets",
        "Other gensets on the bus bar",
        &[Word::new("none", "This one feeds it alone")],
        (1.0, sisters::MOST as f64),
        "",
    ),
];

/// A word for each state of a part; the plant says which state it is in, and so which word.
pub(super) type Words<State> = [(&'static str, State)];

const CONDITIONS: [(&str, Condition); 9] = [
    ("normal", Condition::Normal),
    ("failed", Condition::Failed),
    ("sagging", Condition::Sagging),
    ("swelling", Condition::Swelling),
    ("l1_lost", Condition::Lost(0)),
    ("l2_lost", Condition::Lost(1)),
    ("l3_lost", Condition::Lost(2)),
    ("reversed", Condition::Reversed),
    ("flickering", Condition::Flickering),
];
const GOVERNORS: [(&str, Fault); 4] = [
    ("normal", Fault::None),
    ("hunting", Fault::Hunting),
    ("runaway", Fault::RunningAway),
    ("sluggish", Fault::Sluggish),
];
const AVRS: [(&str, Avr); 3] = [("normal", Avr::Normal), ("failed", Avr::Failed), ("high", Avr::High)];
const BREAKERS: [(&str, Stuck); 3] =
    [("normal", Stuck::Nowhere), ("will_not_close", Stuck::Open), ("will_not_open", Stuck::Closed)];
pub(super) const HEALTHS: [(&str, Health); 3] =
    [("normal", Health::Normal), ("weak", Health::Weak), ("flat", Health::Flat)];
pub(super) const LEAKS: [(&str, bool); 2] = [("normal", false), ("leaking", true)];
pub(super) const FAILS: [(&str, bool); 2] = [("normal", false), ("failed", true)];
pub(super) const BREAKS: [(&str, bool); 2] = [("normal", false), ("broken", true)];
pub(super) const STICKS: [(&str, bool); 2] = [("normal", false), ("stuck", true)];
pub(super) const BLOCKS: [(&str, bool); 2] = [("clear", false), ("blocked", true)];
pub(super) const SHUTS: [(&str, bool); 2] = [("open", false), ("shut", true)];
pub(super) const PRESSES: [(&str, bool); 2] = [("released", false), ("pressed", true)];
const CLOSES: [(&str, bool); 2] = [("off", false), ("on", true)];
const BALANCES: [(&str, bool); 2] = [("even", false), ("uneven", true)];

impl Plant {
    /// Where a lever stands; none where there is no such lever.
    pub(crate) fn lever(&self, id: &str) -> Option<Position> {
        let (engine, [battery, _]) = (&self.engine, &self.batteries);
        match id {
            "mains" => shown(&CONDITIONS, self.grid.condition),
            "mains.voltage" => held_or("normal", self.grid.held_voltage),
            "mains.frequency" => held_or("normal", self.grid.held_frequency),
            "load" => Some(match self.load.demand {
                Demand::Varies => Position::Word("varies"),
                Demand::Daily => Position::Word("daily"),
                Demand::Held(kw) => Position::Number(kw),
            }),
            "load.power_factor" => held_or("varies", self.load.power_factor),
            "load.balance" => shown(&BALANCES, self.load.uneven),
            "ambient" => held_or("normal", self.climate.held),
            "ignition" => Some(ignition_shown(engine.wear.ignition)),
            "governor" => shown(&GOVERNORS, engine.governor.fault),
            "avr" => shown(&AVRS, self.alternator.avr),
            "oil" => shown(&LEAKS, engine.wear.oil_leaks),
            "coolant" => shown(&LEAKS, engine.wear.coolant_leaks),
            "radiator" => shown(&BLOCKS, engine.wear.radiator_blocked),
            "fuel.supply" => shown(&SHUTS, self.tank.shut),
            "fuel.solenoid" => shown(&STICKS, self.solenoid_stuck),
            "fuel.pump" => shown(&FAILS, self.tank.pump_failed),
            "tank" => Some(Position::Number(tenth(self.tank.percent()))),
            "battery" => shown(&HEALTHS, battery.health()),
            "charger" => shown(&FAILS, battery.charger_failed),
            "charge_alternator" => shown(&FAILS, battery.alternator_failed),
            "breaker.genset" => shown(&BREAKERS, self.genset_breaker.stuck),
            "breaker.mains" => shown(&BREAKERS, self.mains_breaker.stuck),
            "sender.oil_pressure" => shown(&BREAKS, self.senders.oil_pressure),
            "sender.temperature" => shown(&BREAKS, self.senders.temperature),
            "sender.fuel_level" => shown(&BREAKS, self.senders.fuel_level),
            "pickup" => shown(&BREAKS, self.senders.pickup),
            "emergency_stop" => shown(&PRESSES, self.emergency_stop),
            "remote_start" => shown(&CLOSES, self.remote_start),
            "busbar.gensets" => {
                let sisters = self.sisters.wanted;
                held_or("none", (sisters > 0).then_some(f64::from(sisters)))
            }
            _ => None,
        }
    }

    /// Pulls one of [`LEVERS`] to a position that it has.
    pub(crate) fn pull(&mut self, id: &str, to: Position) {
        let engine = &mut self.engine;
        match id {
            "mains" => set(&CONDITIONS, to, |condition| self.grid.condition = condition),
            "mains.voltage" => self.grid.held_voltage = held(to),
            "mains.frequency" => self.grid.held_frequency = held(to),
            "load" => {
                self.load.demand = match to {
                    Position::Number(kw) => Demand::Held(kw),
                    Position::Word("daily") => Demand::Daily,
                    Position::Word(_) => Demand::Varies,
                }
            }
            "load.power_factor" => self.load.power_factor = held(to),
            "load.balance" => set(&BALANCES, to, |uneven| self.load.uneven = uneven),
            "ambient" => self.climate.held = held(to),
            "ignition" => engine.set_ignition(ignition(to)),
            "governor" => set(&GOVERNORS, to, |fault| engine.governor.fault = fault),
            "avr" => set(&AVRS, to, |avr| self.alternator.avr = avr),
            "oil" => set(&LEAKS, to, |leaks| engine.set_oil_leaks(leaks)),
            "coolant" => set(&LEAKS, to, |leaks| engine.set_coolant_leaks(leaks)),
            "radiator" => set(&BLOCKS, to, |blocked| engine.wear.radiator_blocked = blocked),
            "fuel.supply" => set(&SHUTS, to, |shut| self.tank.shut = shut),
            "fuel.solenoid" => set(&STICKS, to, |stuck| self.solenoid_stuck = stuck),
            "fuel.pump" => set(&FAILS, to, |failed| self.tank.pump_failed = failed),
            "tank" => held(to).into_iter().for_each(|percent| self.tank.fill_to(percent)),
            "battery" => set(&HEALTHS, to, |health| self.batteries[0].set_health(health)),
            "charger" => set(&FAILS, to, |failed| {
                self.batteries.iter_mut().for_each(|battery| battery.charger_failed = failed);
            }),
            "charge_alternator" => set(&FAILS, to, |failed| {
                self.batteries.iter_mut().for_each(|battery| battery.alternator_failed = failed);
            }),
            "breaker.genset" => set(&BREAKERS, to, |stuck| self.genset_breaker.stuck = stuck),
            "breaker.mains" => set(&BREAKERS, to, |stuck| self.mains_breaker.stuck = stuck),
            "sender.oil_pressure" => set(&BREAKS, to, |broken| self.senders.oil_pressure = broken),
            "sender.temperature" => set(&BREAKS, to, |broken| self.senders.temperature = broken),
            "sender.fuel_level" => set(&BREAKS, to, |broken| self.senders.fuel_level = broken),
            "pickup" => set(&BREAKS, to, |broken| self.senders.pickup = broken),
            "emergency_stop" => set(&PRESSES, to, |pressed| self.emergency_stop = pressed),
            "remote_start" => set(&CLOSES, to, |closed| self.remote_start = closed),
            "busbar.gensets" => self.sisters.wanted = held(to).map_or(0, whole),
            _ => {}
        }
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

pub(super) fn ignition_shown(ignition: Ignition) -> Position {
    match ignition {
        Ignition::Normal => Position::Word("normal"),
        Ignition::Never => Position::Word("never"),
        Ignition::Attempt(attempt) => Position::Number(f64::from(attempt)),
    }
}

pub(super) fn ignition(to: Position) -> Ignition {
    match to {
        Position::Word("never") => Ignition::Never,
        Position::Word(_) => Ignition::Normal,
        Position::Number(attempt) => Ignition::Attempt(whole(attempt)),
    }
}

/// A number of things, none of a lever being beyond 255.
fn whole(number: f64) -> u8 {
    number.round().clamp(0.0, f64::from(u8::MAX)) as u8
}

#[cfg(test)]
mod tests {
    use super::super::tests::positions;
    use super::*;

    #[test]
    fn every_lever_stands_where_it_was_pulled_and_first_as_a_healthy_plant_has_it() {
        let mut plant = Plant::new(1);
        for lever in LEVERS {
            if let Some(healthy) = lever.words.first() {
                assert_eq!(plant.lever(lever.id), Some(Position::Word(healthy.id)), "{}", lever.id);
            }
            for position in positions(lever) {
                plant.pull(lever.id, position);
                assert_eq!(plant.lever(lever.id), Some(position), "{}", lever.id);
            }
        }
        assert_eq!(plant.lever("no_such"), None);
    }

    #[test]
    fn ids_are_distinct_and_words_written_as_all_are() {
        for (number, lever) in LEVERS.iter().enumerate() {
            assert!(LEVERS[..number].iter().all(|other| other.id != lever.id), "{}", lever.id);
            for word in lever.words {
                let lawful = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
                assert!(word.id.chars().all(lawful), "{} {}", lever.id, word.id);
            }
        }
    }
}
