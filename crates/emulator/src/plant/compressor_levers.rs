//! The levers of a compressor's plant.

use crate::levers::{Lever, Position, Word};

use super::Compressor;
use super::air::Intake;
use super::compressor::Wires;
use super::engine_levers::{
    self as engine, BLOCKS, BREAKS, NORMAL, PRESSES, SENDER, held, held_or, set, shown,
};
use super::exhaust::Regeneration;
use super::load::tenth;

/// In the order in which people are shown them.
pub(crate) const COMPRESSOR_LEVERS: &[Lever] = &[
    Lever::of_numbers(
        "air.consumption",
        "Air that the site draws",
        &[Word::new("varies", "Tools come and go")],
        (0.0, 14.0),
        "m3/min",
    ),
    Lever::of_words(
        "receiver",
        "Receiver and hoses",
        &[Word::new("tight", "They hold the pressure"), Word::new("leaking", "They lose air all the time")],
    ),
    Lever::of_words(
        "load_valve",
        "Load valve",
        &[
            NORMAL,
            Word::new("stuck_open", "The screw always fills the receiver"),
            Word::new("stuck_shut", "The screw never fills the receiver"),
        ],
    ),
    Lever::of_words(
        "blow_down",
        "Blow-down valve",
        &[Word::new("clear", "It vents the receiver"), Word::new("blocked", "It vents nothing")],
    ),
    Lever::of_words(
        "air_filter",
        "Air filter",
        &[
            Word::new("clean", "Air goes through it"),
            Word::new("clogged", "Engine and screw get too little air"),
        ],
    ),
    Lever::of_words(
        "oil_separator",
        "Oil separator",
        &[Word::new("clean", "Little is lost across it"), Word::new("clogged", "Much is lost across it")],
    ),
    Lever::of_words(
        "oil_cooler",
        "Oil cooler of the screw",
        &[
            Word::new("clear", "Air goes through it"),
            Word::new("blocked", "Hardly any air goes through it: the discharge overheats"),
        ],
    ),
    Lever::of_words(
        "screw",
        "Screw",
        &[NORMAL, Word::new("binding", "Its bearings drag: it overloads the engine")],
    ),
    Lever::of_numbers("dpf.soot", "Soot in the particle filter", &[], (0.0, 150.0), "%"),
    Lever::of_words(
        "dpf.regeneration",
        "Regeneration of the particle filter",
        &[
            Word::new("automatic", "When it is full and the exhaust is hot"),
            Word::new("inhibited", "Somebody has forbidden it"),
            Word::new("by_hand", "A person asks for it: it burns clean beside the running engine"),
        ],
    ),
    engine::AMBIENT,
    engine::IGNITION,
    engine::GOVERNOR,
    engine::OIL,
    engine::COOLANT,
    engine::RADIATOR,
    engine::FUEL_SUPPLY,
    engine::FUEL_SOLENOID,
    engine::TANK,
    engine::BATTERY,
    engine::CHARGER,
    engine::CHARGE_ALTERNATOR,
    engine::OIL_PRESSURE_SENDER,
    engine::TEMPERATURE_SENDER,
    engine::FUEL_LEVEL_SENDER,
    Lever::of_words("sender.discharge_pressure", "Discharge pressure sender", &SENDER),
    Lever::of_words(
        "sender.discharge_temperature",
        "Discharge temperature sender",
        &[
            NORMAL,
            SENDER[1],
            Word::new("shorted", "Its wires touch: nothing that could be a temperature is read"),
        ],
    ),
    Lever::of_words("sender.separator", "Separator pressure sender", &SENDER),
    engine::PICKUP,
    Lever::of_words(
        "ecu",
        "Engine's own controller",
        &[NORMAL, Word::new("silent", "It says nothing on its bus")],
    ),
    Lever::of_words(
        "door",
        "Door of the canopy",
        &[Word::new("shut", "Its contact is closed"), Word::new("open", "Somebody is at the machine")],
    ),
    engine::EMERGENCY_STOP,
];

const LEAKS: [(&str, bool); 2] = [("tight", false), ("leaking", true)];
const INTAKES: [(&str, Intake); 3] =
    [("normal", Intake::Free), ("stuck_open", Intake::Open), ("stuck_shut", Intake::Shut)];
const CLOGS: [(&str, bool); 2] = [("clean", false), ("clogged", true)];
const BINDS: [(&str, bool); 2] = [("normal", false), ("binding", true)];
const REGENERATIONS: [(&str, Regeneration); 3] = [
    ("automatic", Regeneration::Automatic),
    ("inhibited", Regeneration::Inhibited),
    ("by_hand", Regeneration::ByHand),
];
const WIRES: [(&str, Wires); 3] =
    [("normal", Wires::Whole), ("broken", Wires::Broken), ("shorted", Wires::Shorted)];
const SILENT: [(&str, bool); 2] = [("normal", false), ("silent", true)];
const DOORS: [(&str, bool); 2] = [("shut", false), ("open", true)];

impl Compressor {
    /// Where a lever stands; none where there is no such lever.
    pub(crate) fn lever(&self, id: &str) -> Option<Position> {
        let (wear, discharge) = (self.air.wear, self.discharge_senders);
        match id {
            "air.consumption" => held_or("varies", self.air.consumers.held),
            "receiver" => shown(&LEAKS, wear.receiver_leaks),
            "load_valve" => shown(&INTAKES, wear.intake),
            "blow_down" => shown(&BLOCKS, wear.blow_down_blocked),
            "air_filter" => shown(&CLOGS, wear.filter_clogged),
            "oil_separator" => shown(&CLOGS, wear.separator_clogged),
            "oil_cooler" => shown(&BLOCKS, wear.cooler_blocked),
            "screw" => shown(&BINDS, wear.screw_binds),
            "dpf.soot" => Some(Position::Number(tenth(self.filter.soot))),
            "dpf.regeneration" => shown(&REGENERATIONS, self.filter.regeneration),
            "ambient" => held_or("normal", self.climate.held),
            "sender.discharge_pressure" => shown(&BREAKS, discharge.pressure),
            "sender.discharge_temperature" => shown(&WIRES, discharge.temperature),
            "sender.separator" => shown(&BREAKS, discharge.separator),
            "ecu" => shown(&SILENT, self.ecu_silent),
            "door" => shown(&DOORS, self.door_open),
            "emergency_stop" => shown(&PRESSES, self.emergency_stop),
            _ => engine::lever(id, &self.engine, &self.tank, &self.battery, self.senders),
        }
    }

    /// Pulls one of [`COMPRESSOR_LEVERS`] to a position that it has.
    pub(crate) fn pull(&mut self, id: &str, to: Position) {
        let (wear, discharge) = (&mut self.air.wear, &mut self.discharge_senders);
        match id {
            "air.consumption" => self.air.consumers.held = held(to),
            "receiver" => set(&LEAKS, to, |leaks| wear.receiver_leaks = leaks),
            "load_valve" => set(&INTAKES, to, |stuck| wear.intake = stuck),
            "blow_down" => set(&BLOCKS, to, |blocked| wear.blow_down_blocked = blocked),
            "air_filter" => set(&CLOGS, to, |clogged| wear.filter_clogged = clogged),
            "oil_separator" => set(&CLOGS, to, |clogged| wear.separator_clogged = clogged),
            "oil_cooler" => set(&BLOCKS, to, |blocked| wear.cooler_blocked = blocked),
            "screw" => set(&BINDS, to, |binds| wear.screw_binds = binds),
            "dpf.soot" => self.filter.soot = held(to).unwrap_or(self.filter.soot),
            "dpf.regeneration" => set(&REGENERATIONS, to, |how| self.filter.regeneration = how),
            "ambient" => self.climate.held = held(to),
            "sender.discharge_pressure" => set(&BREAKS, to, |broken| discharge.pressure = broken),
            "sender.discharge_temperature" => set(&WIRES, to, |wires| discharge.temperature = wires),
            "sender.separator" => set(&BREAKS, to, |broken| discharge.separator = broken),
            "ecu" => set(&SILENT, to, |silent| self.ecu_silent = silent),
            "door" => set(&DOORS, to, |open| self.door_open = open),
            "emergency_stop" => set(&PRESSES, to, |pressed| self.emergency_stop = pressed),
            _ => {
                let batteries = std::slice::from_mut(&mut self.battery);
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
        let mut plant = Compressor::new(1);
        are_lawful(COMPRESSOR_LEVERS);
        for lever in COMPRESSOR_LEVERS {
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
