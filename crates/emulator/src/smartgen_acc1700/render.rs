//! From the unit to its registers, in the manual's order; the addresses are the manual's.

use busbar_profile::BitSet;

use crate::bank::Bank;

use super::alarms::{ECU_SHUTDOWN, ECU_WARNING, FILTER_FAULT, INDICATIONS, SHUTDOWNS, WARNINGS};
use super::ecu::Ecu;
use super::inputs::bits;
use super::readings::Reading;
use super::sequence::Status;
use super::setup::Action;
use super::{Acc1700, Mode, Model};

const COMMON_STATUS: u16 = 0;
const COUNTDOWNS: u16 = 160;

/// What only an ECU sends; 77 to 85 and 90 to 93.
const FROM_THE_ECU: [std::ops::RangeInclusive<u16>; 2] = [77..=85, 90..=93];

/// kPa that the discharge pressure transmitter sends as 20 mA.
const TRANSMITTER: f64 = 1600.0;
/// What an ohmmeter without a sensor shows: the end of its range.
const OPEN_CIRCUIT: f64 = 6553.5;

/// Stores all of them.
pub(super) fn registers(unit: &Acc1700, bank: &mut Bank) {
    counters(unit, bank);
    // These and the engine's fault follow what the countdowns and then the alarm words show, pinned or not.
    alarms(unit, bank);
    common_status(unit, bank);
    inputs_and_outputs(unit, bank);
    indicators(unit, bank);
    engine_indicators(unit, bank);
    sensors(unit, bank);
    match &unit.ecu {
        Some(ecu) if ecu.talks() => sent_by_the_ecu(unit, bank),
        _ => FROM_THE_ECU.into_iter().flatten().for_each(|address| bank.absent(address)),
    }
    measurements(unit, bank);
    bank.code(94, unit.sequence.status() as u16);
    bank.integer(95, unit.sequence.seconds_left() as i64);
    identity(unit, bank);
}

fn alarms(unit: &Acc1700, bank: &mut Bank) {
    let due = services_due(bank);
    for register in SHUTDOWNS.chain(WARNINGS).chain(INDICATIONS) {
        let action = match register {
            6 => Action::Shutdown,
            25 => Action::Warning,
            34 => Action::Indication,
            _ => Action::Nothing,
        };
        let mut word = unit.alarms.word(register);
        if action != Action::Nothing {
            let services = (0..).zip(&unit.setup.services).filter(|(_, service)| service.due == action);
            services.filter(|(bit, _)| due.contains(*bit)).for_each(|(bit, _)| word.insert(bit));
        }
        bank.bits(register, word);
    }
}

/// Maintenance numbers less one whose countdown shows nothing left.
fn services_due(bank: &Bank) -> BitSet {
    bits((0..10).map(|service| {
        let first = COUNTDOWNS + 3 * service;
        (first..first + 3).all(|register| bank.number_shown(register) == Some(0.0))
    }))
}

fn common_status(unit: &Acc1700, bank: &mut Bank) {
    let shown = |registers: std::ops::RangeInclusive<u16>| {
        registers.into_iter().any(|at| !bank.bits_shown(at).is_empty())
    };
    let (shutdown, warning) = (shown(SHUTDOWNS), shown(WARNINGS));
    let mut status = bits([shutdown || warning, shutdown, warning]);
    status.set(10, unit.mode == Mode::Manual);
    status.set(11, unit.mode == Mode::Stop);
    status.set(14, unit.is_heating());
    status.set(15, unit.locked);
    bank.bits(COMMON_STATUS, status);
}

fn inputs_and_outputs(unit: &Acc1700, bank: &mut Bank) {
    let orders = unit.orders();
    bank.bits(35, unit.inputs.signals());
    bank.bits(45, unit.inputs.active());
    bank.bits(37, bits([orders.fuel, orders.starter].into_iter().chain(unit.outputs)));
}

fn indicators(unit: &Acc1700, bank: &mut Bank) {
    let sequence = &unit.sequence;
    let mut indicators = BitSet::EMPTY;
    indicators.set(4, sequence.status().is_running());
    indicators.set(5, unit.valve.is_open());
    indicators.set(6, sequence.is_loaded());
    indicators.set(7, sequence.waits_for_pressure());
    indicators.set(8, sequence.status() == Status::WaitToOnload);
    bank.bits(43, indicators);
}

fn engine_indicators(unit: &Acc1700, bank: &mut Bank) {
    let filter = unit.ecu.as_ref().map(Ecu::filter).unwrap_or_default();
    let said = |(register, bit): (u16, u16)| bank.bits_shown(register).contains(bit);
    let engine_fault = said(ECU_SHUTDOWN) || said(ECU_WARNING);
    let mut engine = unit.alarms.word(FILTER_FAULT.0);
    engine.set(1, filter.waits);
    engine.set(2, filter.inhibited);
    engine.set(3, filter.burns);
    engine.set(4, filter.by_hand);
    engine.set(5, filter.needs_a_person);
    engine.set(7, filter.burns);
    engine.set(8, unit.sequence.status() == Status::Preheat);
    engine.set(9, engine_fault);
    engine.set(14, unit.valve.protects());
    bank.bits(44, engine);
}

fn sensors(unit: &Acc1700, bank: &mut Bank) {
    let sensors = &unit.readings.sensors;
    // The model decides what hangs on the first two.
    let of_a_tank = |percent: f64| sender(percent / 100.0);
    let (first, second): (Curve, Curve) = match unit.model {
        Model::Acc1700 => (platinum, |kilopascal| sender(kilopascal / 1000.0)),
        Model::Acc1700Can => (platinum, |kilopascal| sender(kilopascal / 100.0)),
    };
    let curves: [(Curve, f64); 5] = [
        (first, OPEN_CIRCUIT),
        (second, OPEN_CIRCUIT),
        (of_a_tank, OPEN_CIRCUIT),
        (platinum, OPEN_CIRCUIT),
        (current, 0.0),
    ];
    for ((register, sensor), (curve, open)) in (57..).step_by(2).zip(sensors).zip(curves) {
        match *sensor {
            Reading::Value(value) => bank.number(register, curve(value)),
            Reading::Broken => bank.number(register, open),
            Reading::Shorted => bank.number(register, 0.0),
            // An open terminal, too.
            Reading::Absent => bank.number(register, open),
        }
        // Whole units, as the register has them.
        measured(register + 1, *sensor, bank);
    }
}

/// From the value of a sensor to what is measured at its terminal.
type Curve = fn(f64) -> f64;

/// Ohm of a float or pressure sender at a part of its way.
fn sender(part: f64) -> f64 {
    10.0 + 174.0 * part
}

/// Ohm of a Pt100 at degC.
fn platinum(temperature: f64) -> f64 {
    100.0 * (1.0 + 0.00385 * temperature)
}

/// mA of the transmitter at kPa.
fn current(pressure: f64) -> f64 {
    4.0 + 16.0 * pressure / TRANSMITTER
}

fn measured(register: u16, reading: Reading, bank: &mut Bank) {
    match reading {
        Reading::Value(value) => bank.number(register, value.round()),
        Reading::Absent => bank.absent(register),
        Reading::Broken | Reading::Shorted => bank.broken(register),
    }
}

fn sent_by_the_ecu(unit: &Acc1700, bank: &mut Bank) {
    let plant = &unit.plant;
    // No ECU here measures the coolant's pressure.
    bank.absent(77);
    let values = [
        plant.coolant_level(),
        plant.fuel_pressure,
        plant.fuel_temperature,
        plant.engine.oil,
        plant.intake,
        plant.exhaust.boost,
        plant.exhaust.temperature,
        plant.engine.burn,
    ];
    bank.numbers(78, 1, values);
    bank.number(90, plant.load());
    bank.number(91, plant.torque());
    // No water; and ash, which no regeneration burns, from the oil of all the hours.
    bank.integer(92, 0);
    bank.number(93, 3.0 + plant.engine.hours / 180.0);
}

fn measurements(unit: &Acc1700, bank: &mut Bank) {
    let readings = &unit.readings;
    measured(50, readings.speed, bank);
    bank.numbers(51, 1, [readings.battery, readings.charger]);
    let engine = [readings.coolant, readings.oil_pressure, readings.fuel_level];
    let discharge = [readings.discharge_pressure, readings.discharge_temperature];
    for (register, reading) in (190..).zip(engine.into_iter().chain(discharge)) {
        measured(register, reading, bank);
    }
}

fn counters(unit: &Acc1700, bank: &mut Bank) {
    let total = unit.running_seconds();
    clock(101, total, bank);
    clock(128, total - unit.run_began, bank);
    for (register, left) in (COUNTDOWNS..).step_by(3).zip(unit.services.left(total)) {
        clock(register, left, bank);
    }
    bank.integer(104, unit.sequence.starts.into());
    // Without an ECU nobody counts litres.
    let burned = if unit.model == Model::Acc1700Can { unit.plant.engine.burned } else { 0.0 };
    bank.integer(86, burned as i64);
    bank.integer(120, unit.events.into());
}

/// Hours, minutes and seconds in three registers.
fn clock(register: u16, seconds: u64, bank: &mut Bank) {
    let parts = [seconds / 3600, seconds / 60 % 60, seconds % 60];
    for (register, part) in (register..).zip(parts) {
        bank.integer(register, part as i64);
    }
}

fn identity(unit: &Acc1700, bank: &mut Bank) {
    // The manual gives no format; these are the model's number and versions 1.2 and 1.0.
    let versions = if unit.model == Model::Acc1700Can { [1700, 12, 10] } else { [1700, 11, 10] };
    for (register, version) in (113..).zip(versions) {
        bank.integer(register, version);
    }
    for (register, part) in (116..).zip([24, 6, 18, 103]) {
        bank.integer(register, part);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panel::Panel;

    #[test]
    fn every_readable_point_is_stored() {
        let profile = busbar_profile::builtin("smartgen-acc1700").unwrap();
        for model in [Model::Acc1700, Model::Acc1700Can] {
            let unit = Acc1700::new(profile, model, 1, false);
            let mut clean = Bank::new(profile);
            unit.render(&mut clean);
            for point in profile.points.iter().filter(|point| point.access.is_readable()) {
                let mut spoiled = clean.clone();
                spoiled.spoil(point);
                unit.render(&mut spoiled);
                // A set of bits is stored around the reserved ones.
                let reserved = (0..16).filter(|bit| !point.bits.is_empty() && point.bit(*bit).is_none());
                let reserved = reserved.fold(0, |mask, bit| mask | 1 << bit);
                let stored = |bank: &Bank| -> Vec<u16> {
                    let registers = bank.read(point.address, point.registers).unwrap();
                    registers.iter().map(|register| register & !reserved).collect()
                };
                assert_eq!(stored(&clean), stored(&spoiled), "{model:?} {}", point.id);
                assert_eq!(spoiled.refused(), 0, "{model:?} {}", point.id);
            }
        }
    }
}
