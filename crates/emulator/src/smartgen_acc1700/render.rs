//! From the unit to its registers, in the manual's order; the addresses are the manual's.

use busbar_profile::BitSet;

use crate::bank::Bank;

use super::alarms::{SHUTDOWNS, WARNINGS, bits};
use super::sequence::Status;
use super::{Acc1700, Mode, Model};

const COMMON_STATUS: u16 = 0;
const MAINTENANCE_WARNINGS: u16 = 25;

const MAINTENANCE_INDICATIONS: u16 = 34;
const COUNTDOWNS: u16 = 160;
/// Maintenance 1 to 8 warn, the others indicate.
const WARN: u16 = 8;

/// What only an ECU sends; 77 to 85 and 90 to 93.
const FROM_THE_ECU: [std::ops::RangeInclusive<u16>; 2] = [77..=85, 90..=93];

/// kPa that the discharge pressure transmitter sends as 20 mA.
const TRANSMITTER: f64 = 1600.0;

/// Stores all of them.
pub(super) fn registers(unit: &Acc1700, bank: &mut Bank) {
    counters(unit, bank);
    // These follow what the countdowns and then the alarm words show, pinned or not.
    alarms(unit, bank);
    common_status(unit, bank);
    inputs_and_outputs(unit, bank);
    indicators(unit, bank);
    sensors(unit, bank);
    match unit.model {
        Model::Acc1700 => FROM_THE_ECU.into_iter().flatten().for_each(|address| bank.absent(address)),
        Model::Acc1700Can => ecu(unit, bank),
    }
    measurements(unit, bank);
    bank.code(94, unit.sequence.status() as u16);
    bank.integer(95, unit.sequence.seconds_left() as i64);
    identity(unit, bank);
}

fn alarms(unit: &Acc1700, bank: &mut Bank) {
    let due = services_due(bank);
    for (register, word) in unit.alarms.words() {
        bank.bits(register, word);
    }
    bank.bits(MAINTENANCE_WARNINGS, due.iter().filter(|bit| *bit < WARN).collect());
    bank.bits(MAINTENANCE_INDICATIONS, due.iter().filter(|bit| *bit >= WARN).collect());
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
    status.set(15, unit.locked);
    bank.bits(COMMON_STATUS, status);
}

fn inputs_and_outputs(unit: &Acc1700, bank: &mut Bank) {
    let orders = unit.sequence.orders();
    bank.bits(35, unit.inputs.signals());
    bank.bits(45, unit.inputs.active());
    bank.bits(37, bits([orders.fuel, orders.starter].into_iter().chain(unit.outputs)));
}

fn indicators(unit: &Acc1700, bank: &mut Bank) {
    let (sequence, plant) = (&unit.sequence, &unit.plant);
    let mut indicators = BitSet::EMPTY;
    indicators.set(4, sequence.status().is_running());
    indicators.set(5, sequence.orders().load_valve);
    indicators.set(6, sequence.is_loaded());
    indicators.set(7, sequence.waits_for_pressure());
    indicators.set(8, sequence.status() == Status::WaitToOnload);
    bank.bits(43, indicators);

    let mut engine = BitSet::EMPTY;
    if unit.model == Model::Acc1700Can {
        engine.set(0, plant.filter.has_failed());
        engine.set(1, plant.filter.is_waiting());
        engine.set(3, plant.filter.is_regenerating());
        engine.set(5, plant.filter.needs_a_person());
        engine.set(7, plant.filter.is_regenerating());
    }
    engine.set(8, sequence.status() == Status::Preheat);
    engine.set(14, plant.load() > 110.0);
    bank.bits(44, engine);
}

fn sensors(unit: &Acc1700, bank: &mut Bank) {
    let plant = &unit.plant;
    let mut sensor = |register: u16, ohm: f64, value: f64| {
        bank.number(register, ohm);
        bank.number(register + 1, value.round());
    };
    let oil_pressure = plant.engine.oil_pressure * 100.0;
    sensor(61, sender(plant.tank.percent() / 100.0), plant.tank.percent());
    sensor(63, platinum(plant.air.temperature), plant.air.temperature);
    sensor(65, 4.0 + 16.0 * plant.air.pressure / TRANSMITTER, plant.air.pressure);
    match unit.model {
        Model::Acc1700 => {
            sensor(57, platinum(plant.engine.coolant), plant.engine.coolant);
            sensor(59, sender(oil_pressure / 1000.0), oil_pressure);
        }
        Model::Acc1700Can => {
            sensor(59, sender(plant.air.separator_loss / 100.0), plant.air.separator_loss);
            bank.absent(57);
            bank.absent(58);
        }
    }
}

/// Ohm of a float or pressure sender at a part of its way.
fn sender(part: f64) -> f64 {
    10.0 + 174.0 * part
}

/// Ohm of a Pt100 at degC.
fn platinum(temperature: f64) -> f64 {
    100.0 * (1.0 + 0.00385 * temperature)
}

fn ecu(unit: &Acc1700, bank: &mut Bank) {
    let plant = &unit.plant;
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
    let plant = &unit.plant;
    bank.number(50, plant.engine.speed);
    bank.numbers(51, 1, plant.voltages());
    let values = [
        plant.engine.coolant,
        plant.engine.oil_pressure * 100.0,
        plant.tank.percent(),
        plant.air.pressure,
        plant.air.temperature,
    ];
    bank.numbers(190, 1, values);
}

fn counters(unit: &Acc1700, bank: &mut Bank) {
    let total = unit.running_seconds();
    clock(101, total, bank);
    clock(128, total - unit.run_began, bank);
    for (register, due) in (COUNTDOWNS..).step_by(3).zip(unit.services_due) {
        clock(register, due.saturating_sub(total), bank);
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
            let unit = Acc1700::new(model, 1, false);
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
