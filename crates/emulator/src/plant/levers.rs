//! The levers of a genset's plant.

use crate::levers::{Lever, Position, Word};

use super::alternator::Avr;
use super::breaker::Stuck;
use super::engine_levers::{self as engine, FAILS, NORMAL, PRESSES, held, held_or, set, shown, whole};
use super::grid::Condition;
use super::load::Demand;
use super::{Plant, sisters};

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
        (0.0, 200.0),
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
    engine::AMBIENT,
    engine::IGNITION,
    engine::GOVERNOR,
    Lever::of_words(
        "avr",
        "Voltage regulator",
        &[
            NORMAL,
            Word::new("failed", "No excitation"),
            Word::new("high", "Full excitation, whatever the voltage"),
        ],
    ),
    engine::OIL,
    engine::COOLANT,
    engine::RADIATOR,
    engine::FUEL_SUPPLY,
    engine::FUEL_SOLENOID,
    Lever::of_words(
        "fuel.pump",
        "Pump into the fuel tank",
        &[NORMAL, Word::new("failed", "It pumps nothing")],
    ),
    engine::TANK,
    engine::BATTERY,
    engine::CHARGER,
    engine::CHARGE_ALTERNATOR,
    Lever::of_words("breaker.genset", "Genset breaker", &BREAKER),
    Lever::of_words("breaker.mains", "Mains breaker", &BREAKER),
    engine::OIL_PRESSURE_SENDER,
    engine::TEMPERATURE_SENDER,
    engine::FUEL_LEVEL_SENDER,
    engine::PICKUP,
    engine::EMERGENCY_STOP,
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
const AVRS: [(&str, Avr); 3] = [("normal", Avr::Normal), ("failed", Avr::Failed), ("high", Avr::High)];
const BREAKERS: [(&str, Stuck); 3] =
    [("normal", Stuck::Nowhere), ("will_not_close", Stuck::Open), ("will_not_open", Stuck::Closed)];
const CLOSES: [(&str, bool); 2] = [("off", false), ("on", true)];
const BALANCES: [(&str, bool); 2] = [("even", false), ("uneven", true)];

impl Plant {
    /// Where a lever stands; none where there is no such lever.
    pub(crate) fn lever(&self, id: &str) -> Option<Position> {
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
            "avr" => shown(&AVRS, self.alternator.avr),
            "fuel.pump" => shown(&FAILS, self.tank.pump_failed),
            "breaker.genset" => shown(&BREAKERS, self.genset_breaker.stuck),
            "breaker.mains" => shown(&BREAKERS, self.mains_breaker.stuck),
            "emergency_stop" => shown(&PRESSES, self.emergency_stop),
            "remote_start" => shown(&CLOSES, self.remote_start),
            "busbar.gensets" => {
                let sisters = self.sisters.wanted;
                held_or("none", (sisters > 0).then_some(f64::from(sisters)))
            }
            _ => engine::lever(id, &self.engine, &self.tank, &self.batteries[0], self.senders),
        }
    }

    /// Pulls one of [`LEVERS`] to a position that it has.
    pub(crate) fn pull(&mut self, id: &str, to: Position) {
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
            "avr" => set(&AVRS, to, |avr| self.alternator.avr = avr),
            "fuel.pump" => set(&FAILS, to, |failed| self.tank.pump_failed = failed),
            "breaker.genset" => set(&BREAKERS, to, |stuck| self.genset_breaker.stuck = stuck),
            "breaker.mains" => set(&BREAKERS, to, |stuck| self.mains_breaker.stuck = stuck),
            "emergency_stop" => set(&PRESSES, to, |pressed| self.emergency_stop = pressed),
            "remote_start" => set(&CLOSES, to, |closed| self.remote_start = closed),
            "busbar.gensets" => self.sisters.wanted = held(to).map_or(0, whole),
            _ => {
                let batteries = &mut self.batteries;
                engine::pull(id, to, &mut self.engine, &mut self.tank, batteries, &mut self.senders);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{are_lawful, positions};
    use super::*;

    #[test]
    fn every_lever_stands_where_it_was_pulled_and_first_as_a_healthy_plant_has_it() {
        let mut plant = Plant::new(1);
        are_lawful(LEVERS);
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
}
