//! From the unit to its registers, in the manual's order; the addresses are the manual's.

use busbar_profile::{BitSet, Number, Value};

use crate::bank::Bank;
use crate::plant::Feed;

use super::operation::Operation;
use super::settings::SITE;
use super::{CLOCK, DatakomDkg705, MODE_KEYS, Mode};

/// Below this the external supply has failed, V.
const EXTERNAL_DC_FAIL: f64 = 20.0;

/// Stores all of them.
pub(super) fn registers(unit: &DatakomDkg705, bank: &mut Bank) {
    feed(&unit.plant.mains, &MAINS, bank);
    feed(&unit.plant.genset, &GENSET, bank);
    bank.numbers(CLOCK, 1, unit.clock.parts().map(f64::from));
    engine(unit, bank);
    for (address, word) in (0x0032..).zip(unit.alarms.words()) {
        bank.bits(address, word);
    }
    outputs(unit, bank);
    state(unit, bank);
    ecu(unit, bank);
    limits(bank);
    timers(bank);
    options(bank);
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
    bank.bits(at.phase_order, BitSet::EMPTY);
    bank.number(at.active, feed.total_active());
    bank.number(at.apparent, feed.total_apparent());
    bank.number(at.reactive, feed.total_reactive());
    // The sign tells capacitive from inductive, and not the direction.
    let factor = feed.total_power_factor().abs();
    bank.number(at.power_factor, if feed.total_reactive() < 0.0 { -factor } else { factor });
}

fn engine(unit: &DatakomDkg705, bank: &mut Bank) {
    let plant = &unit.plant;
    let [battery, external] = &plant.batteries;
    bank.number(0x002A, plant.engine.speed);
    bank.number(0x002B, plant.engine.oil_pressure);
    bank.number(0x002C, plant.engine.coolant);
    bank.number(0x002D, plant.tank.percent());
    bank.number(0x002E, plant.engine.oil);
    bank.number(0x002F, battery.voltage);
    bank.number(0x0030, (100.0 * battery.charge_input / battery.voltage).clamp(0.0, 100.0));
    bank.number(0x0031, external.voltage);
}

fn outputs(unit: &DatakomDkg705, bank: &mut Bank) {
    let (plant, controls, alarms) = (&unit.plant, &unit.controls, &unit.alarms);
    let stop = unit.sequence.operation() == Operation::Stopping;
    let contactor = controls.genset_breaker || controls.mains_breaker;
    let auto_ready = unit.mode == Mode::Auto && !unit.is_locked();
    let external_dc_fail = plant.batteries[1].voltage < EXTERNAL_DC_FAIL;
    let flash = alarms.any() && plant.time.fract() < 0.5;

    let relays = [
        (1, alarms.horn()),
        (2, controls.starter),
        (3, controls.idle),
        (4, controls.genset_breaker),
        (5, controls.mains_breaker),
        (6, controls.fuel),
        (7, stop),
    ];
    let module_1 = [
        (0, unit.sequence.is_preheating()),
        (1, alarms.any()),
        (2, contactor),
        (3, auto_ready),
        (4, controls.fuel_pump),
        (5, unit.scene.exerciser),
        (6, external_dc_fail),
        (7, flash),
    ];
    let functions_1 = [
        (1, unit.sequence.is_preheating()),
        (2, controls.starter),
        (3, alarms.horn()),
        (4, controls.genset_breaker),
        (5, controls.mains_breaker),
        (6, controls.fuel),
        (7, stop),
        (9, alarms.any()),
        (10, contactor),
        (11, auto_ready),
        (13, unit.scene.exerciser),
        (14, controls.fuel_pump),
    ];
    let functions_2 = [(0, external_dc_fail), (1, controls.idle), (5, flash)];
    bank.bits(0x0039, set(relays));
    bank.bits(0x003A, set(module_1));
    bank.bits(0x003B, set(functions_1));
    bank.bits(0x003C, set(functions_2));
}

fn state(unit: &DatakomDkg705, bank: &mut Bank) {
    let plant = &unit.plant;
    let mode = set([(unit.mode.bit(), true)]);
    bank.bits(0x003D, mode);
    bank.integer(0x003E, unit.timer().as_millis().div_ceil(1000) as i64);
    bank.code(0x003F, unit.sequence.operation().code());
    bank.bits(MODE_KEYS, mode);
    bank.number(0x0041, 100.0 * unit.regulation.governor());
    bank.number(0x0042, 100.0 * unit.regulation.exciter());
    let live = plant.mains.average_voltage().min(plant.genset.average_voltage()) > 100.0;
    bank.number(0x0043, if live { plant.angle() } else { 0.0 });
}

fn ecu(unit: &DatakomDkg705, bank: &mut Bank) {
    let (plant, engine, ecu) = (&unit.plant, &unit.plant.engine, &unit.ecu);
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

fn limits(bank: &mut Bank) {
    let site = &SITE;
    for (address, value) in [
        (0x1005, site.low_oil_pressure_shutdown),
        (0x1006, site.low_oil_pressure_warning),
        (0x1007, site.high_temperature_shutdown),
        (0x1008, site.high_temperature_warning),
        (0x1009, site.high_frequency_shutdown),
        (0x100A, site.high_frequency_warning),
        (0x100B, site.low_frequency_shutdown),
        (0x100C, site.low_frequency_warning),
        (0x100D, site.high_voltage_shutdown),
        (0x100E, site.low_voltage_shutdown),
        (0x100F, site.mains_voltage_high),
        (0x1010, site.mains_voltage_low),
        (0x1011, site.hysteresis_voltage),
        (0x1012, site.high_battery_shutdown),
        (0x1013, site.high_battery_warning),
        (0x1014, site.low_battery_warning),
        (0x1015, site.overcurrent),
        (0x1016, site.excess_power),
        (0x1018, site.start_attempts.into()),
        (0x1019, site.heating_temperature),
    ] {
        bank.number(address, value);
    }
}

fn timers(bank: &mut Bank) {
    let site = &SITE;
    for (address, seconds) in [
        (0x1000, site.idle),
        (0x1017, site.overload),
        (0x101A, site.stop),
        (0x101B, site.crank),
        (0x101C, site.preheat),
        (0x101D, site.wait_between_starts),
        (0x101E, site.wait_before_fuel),
        (0x101F, site.cooldown),
        (0x1020, site.mains_waiting),
        (0x1021, site.genset_contactor),
        (0x1022, site.mains_contactor),
        (0x1023, site.heating),
        (0x1024, site.horn),
    ] {
        bank.integer(address, seconds as i64);
    }
}

fn options(bank: &mut Bank) {
    let site = &SITE;
    bank.integer(0x1001, site.current_transformer.into());
    bank.bits(0x1002, BitSet::EMPTY);
    // Governor and voltage regulator are both connected.
    let transfer = [(0, site.no_break_transfer), (1, site.soft_transfer), (2, true), (3, true)];
    bank.bits(0x1025, set(transfer));
    // One register holds two points here: heated by the timer alone, and the bits above it.
    bank.put("engine_heating", &Value::Choice { code: 0 });
    bank.put("operation_mode_2", &Value::Bits(set([(2, true), (5, site.emergency_backup), (6, true)])));
    bank.number(0x1027, site.service_hours);
    bank.number(0x1028, site.service_days);
    // At ten o'clock, for three steps of ten minutes, on load, every week.
    bank.integer(0x102A, 10);
    bank.number(0x102B, 0.3);
    bank.put("exercise_period", &Value::Choice { code: 1 });
    bank.put("operation_mode_3", &Value::Bits(set([(2, true), (6, true)])));
    bank.put("ecu_engine_brand", &Value::Number(Number::integer(2)));
    bank.put("ecu_engine_model", &Value::Number(Number::integer(5)));
}

fn set(bits: impl IntoIterator<Item = (u16, bool)>) -> BitSet {
    bits.into_iter().filter(|(_, on)| *on).map(|(bit, _)| bit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What stood there before shows through wherever a point is forgotten.
    #[test]
    fn every_point_is_stored() {
        let profile = busbar_profile::builtin("datakom-dkg705").unwrap();
        let unit = DatakomDkg705::new(1, false);
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
