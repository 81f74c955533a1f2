//! From the unit to its registers, in the manual's order; the addresses are the manual's.

use busbar_profile::{BitSet, Number, Value};

use crate::bank::Bank;
use crate::plant::Feed;

use super::operation::Operation;
use super::{CLOCK, DatakomDkg705, MODE_KEYS, Mode, mains};

/// kvar below which a register shows none.
const LEAST_POWER: f64 = 0.005;
/// The bit of a phase order that is wrong.
const WRONG: u16 = 7;

/// Stores all of them.
pub(super) fn registers(unit: &DatakomDkg705, bank: &mut Bank) {
    feed(&unit.measures.mains, &MAINS, bank);
    feed(&unit.measures.genset, &GENSET, bank);
    bank.numbers(CLOCK, 1, unit.clock.parts().map(f64::from));
    engine(unit, bank);
    for (address, word) in (0x0032..).zip(unit.alarms.words()) {
        bank.bits(address, word);
    }
    outputs(unit, bank);
    state(unit, bank);
    ecu(unit, bank);
    parameters(unit, bank);
}

/// Where a feed's registers stand; phases follow each other.
struct FeedRegisters {
    phase_voltage: u16,
    line_voltage: u16,
    current: u16,
    frequency: u16,
    phase_order: u16,
    active: u16,
    power_factor: u16,
    apparent: u16,
    reactive: u16,
}

const MAINS: FeedRegisters = FeedRegisters {
    phase_voltage: 0x0000,
    line_voltage: 0x000C,
    current: 0x0009,
    frequency: 0x0012,
    phase_order: 0x0015,
    active: 0x001D,
    power_factor: 0x001F,
    apparent: 0x0020,
    reactive: 0x0022,
};

const GENSET: FeedRegisters = FeedRegisters {
    phase_voltage: 0x0003,
    line_voltage: 0x000F,
    current: 0x0006,
    frequency: 0x0013,
    phase_order: 0x0014,
    active: 0x0016,
    power_factor: 0x0018,
    apparent: 0x0019,
    reactive: 0x001B,
};

fn feed(feed: &Feed, at: &FeedRegisters, bank: &mut Bank) {
    bank.numbers(at.phase_voltage, 1, feed.voltage);
    bank.numbers(at.line_voltage, 1, feed.line_voltage());
    bank.numbers(at.current, 1, feed.current());
    bank.number(at.frequency, feed.frequency);
    bank.bits(at.phase_order, set([(WRONG, mains::is_order_wrong(feed))]));
    bank.number(at.active, feed.total_active());
    bank.number(at.apparent, feed.total_apparent());
    bank.number(at.reactive, feed.total_reactive());
    // The sign tells capacitive from inductive, and not the direction.
    let factor = feed.total_power_factor().abs();
    let capacitive = feed.total_reactive() < -LEAST_POWER;
    bank.number(at.power_factor, if capacitive { -factor } else { factor });
}

fn engine(unit: &DatakomDkg705, bank: &mut Bank) {
    let measures = &unit.measures;
    bank.number(0x002A, measures.speed);
    bank.number(0x002B, measures.oil_pressure);
    bank.number(0x002C, measures.coolant);
    bank.number(0x002D, measures.fuel_level);
    bank.number(0x002E, measures.oil);
    bank.number(0x002F, measures.battery);
    bank.number(0x0030, (100.0 * measures.charge_input / measures.battery.max(1.0)).clamp(0.0, 100.0));
    bank.number(0x0031, measures.external_dc);
}

fn outputs(unit: &DatakomDkg705, bank: &mut Bank) {
    let (plant, controls, alarms) = (&unit.plant, &unit.controls, &unit.alarms);
    let stop = unit.sequence.operation() == Operation::Stopping;
    let contactor = controls.genset_breaker || controls.mains_breaker;
    let auto_ready = unit.mode == Mode::Auto && !unit.is_locked();
    let external_dc_fail = unit.measures.external_dc < unit.set.limits.low_external_dc;
    let preheats = unit.sequence.is_preheating(&unit.set);
    let exercises = unit.exerciser.is_on();
    let is_master = unit.set.options.partner && plant.engine.is_running();
    let flash = alarms.any() && plant.time.fract() < 0.5;

    let relays = [
        (1, preheats),
        (2, controls.starter),
        (3, alarms.horn()),
        (4, controls.genset_breaker),
        (5, controls.mains_breaker),
        (6, controls.fuel),
        (7, stop),
    ];
    let modules = [
        (0, controls.idle),
        (1, alarms.any()),
        (2, contactor),
        (3, auto_ready),
        (4, controls.fuel_pump),
        (5, exercises),
        (6, external_dc_fail),
        (7, flash),
        (8, unit.sheds_load),
        (9, is_master),
    ];
    let functions_1 = [
        (1, preheats),
        (2, controls.starter),
        (3, alarms.horn()),
        (4, controls.genset_breaker),
        (5, controls.mains_breaker),
        (6, controls.fuel),
        (7, stop),
        (8, unit.sheds_load),
        (9, alarms.any()),
        (10, contactor),
        (11, auto_ready),
        (12, is_master),
        (13, exercises),
        (14, controls.fuel_pump),
    ];
    let functions_2 = [(0, external_dc_fail), (1, controls.idle), (5, flash)];
    bank.bits(0x0039, set(relays));
    bank.bits(0x003A, set(modules));
    bank.bits(0x003B, set(functions_1));
    bank.bits(0x003C, set(functions_2));
}

fn state(unit: &DatakomDkg705, bank: &mut Bank) {
    let plant = &unit.plant;
    bank.bits(0x003D, set([(unit.mode.bit(), true)]));
    bank.integer(0x003E, unit.timer().as_millis().div_ceil(1000) as i64);
    bank.code(0x003F, unit.sequence.operation().code());
    bank.bits(MODE_KEYS, set([(unit.last_key.bit(), true)]));
    bank.number(0x0041, 100.0 * unit.regulation.governor());
    bank.number(0x0042, 100.0 * unit.regulation.exciter());
    let stands = plant.synchronism();
    bank.number(0x0043, if stands.live { stands.angle } else { 0.0 });
}

/// The J1939 block: 0 where the engine is not heard.
const ECU: std::ops::RangeInclusive<u16> = 0x0060..=0x007F;
const SECOND_OF_ENGINE_HOURS: u16 = 0x0064;

fn ecu(unit: &DatakomDkg705, bank: &mut Bank) {
    let (plant, engine, ecu) = (&unit.plant, &unit.plant.engine, &unit.ecu);
    if ecu.cut || !unit.set.options.ecu {
        ECU.filter(|address| *address != SECOND_OF_ENGINE_HOURS).for_each(|address| bank.absent(address));
        return;
    }
    bank.number(0x0060, engine.speed);
    bank.number(0x0061, engine.coolant);
    bank.number(0x0062, engine.oil_pressure);
    bank.number(0x0063, engine.hours);
    bank.number(0x0065, ecu.air_filter);
    bank.number(0x0066, ecu.boost);
    bank.number(0x0067, ecu.fuel_pressure);
    bank.number(0x0068, ecu.fuel);
    bank.number(0x0069, engine.burn);
    bank.number(0x006A, ecu.economy(plant));
    bank.number(0x006B, engine.oil);
    bank.number(0x006C, plant.ambient);
    bank.number(0x006D, plant.canopy);
    bank.number(0x006E, ecu.manifold);
    bank.number(0x006F, ecu.exhaust);
    for (row, fault) in (0x0070..).step_by(2).zip(ecu.faults()) {
        bank.integer(row, fault.fmi.into());
        bank.integer(row + 1, fault.spn.into());
    }
}

fn parameters(unit: &DatakomDkg705, bank: &mut Bank) {
    for (point, value) in &unit.set.numbers {
        match (point.field, Number::from_f64(*value, 6)) {
            // Two of them share a register.
            (Some(_), Some(number)) => bank.put(&point.id, &Value::Number(number)),
            _ => bank.number(point.address, *value),
        }
    }
    let words = &unit.set.words;
    bank.bits(0x1002, words.multi_genset);
    bank.bits(0x1025, words.mode_1);
    // A choice and a word share a register, twice.
    bank.put("engine_heating", &Value::Choice { code: words.heating.into() });
    bank.put("operation_mode_2", &Value::Bits(words.mode_2));
    bank.put("exercise_period", &Value::Choice { code: words.exercise_period.into() });
    bank.put("operation_mode_3", &Value::Bits(words.mode_3));
}

fn set(bits: impl IntoIterator<Item = (u16, bool)>) -> BitSet {
    bits.into_iter().filter(|(_, on)| *on).map(|(bit, _)| bit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    /// What stood there before shows through wherever a point is forgotten.
    #[test]
    fn every_point_is_stored() {
        let profile = busbar_profile::builtin("datakom-dkg705").unwrap();
        let unit = DatakomDkg705::new(1, false, &Settings::of(profile));
        let images = [0x0000, 0xFFFF].map(|word| {
            let mut bank = Bank::new(profile);
            bank.fill(word);
            registers(&unit, &mut bank);
            assert_eq!(bank.refused(), 0);
            bank
        });
        for point in profile.points.iter().filter(|point| point.access.is_readable()) {
            let [zeros, ones] = images.each_ref().map(|bank| {
                point.decode(bank.read(point.address, point.registers).unwrap(), profile.wire.word_order)
            });
            assert_eq!(zeros, ones, "{} is not stored", point.id);
        }
    }
}
