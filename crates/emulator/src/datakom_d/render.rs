//! From the unit to its registers, in the manual's order; the addresses are the manual's.

use std::f64::consts::TAU;

use crate::bank::Bank;
use crate::plant::{Feed, RATED_KVAR, RATED_KW};
use crate::waveform::{Analysis, Shape};

use super::alarms::SERVICE_1_REQUEST;
use super::status::Shown;
use super::watch::Class;
use super::{DatakomD, display, status};

pub(super) const SHUTDOWN_ALARMS: u16 = 10504;
pub(super) const LOAD_DUMP_ALARMS: u16 = 10520;
pub(super) const WARNING_ALARMS: u16 = 10536;
const OPERATION_STATUS: u16 = 10604;
const UNIT_MODE: u16 = 10605;
const ETHERNET_PACKETS: u16 = 11683;
/// What an input without a sender reads, ohm.
const OPEN_CIRCUIT: f64 = 5000.0;
/// Registers of the hours and days left of each service.
pub(super) const SERVICES: [[u16; 2]; 3] = [[10634, 10636], [10638, 10640], [10642, 10644]];

/// Stores all of them.
pub(super) fn registers(unit: &DatakomD, bank: &mut Bank) {
    feed(&unit.plant.mains, &MAINS, bank);
    feed(&unit.plant.genset, &GENSET, bank);
    engine(unit, bank);
    batteries(unit, bank);
    analogs(unit, bank);
    let analysis = selected(unit);
    harmonics(unit, &analysis, bank);
    state(unit, bank);
    counters(unit, bank);
    identity(unit, bank);
    load_share(unit, bank);
    packets(unit, bank);
    // These follow what the counters and then the alarm arrays show, pinned or not.
    let due = services_due(unit, bank);
    alarms(unit, due, bank);
    let shown = Shown::of(due, bank);
    status::registers(unit, &shown, bank);
    display::draw(unit, &shown, &analysis, bank);
}

/// Stores the Ethernet packet counter alone.
pub(super) fn packets(unit: &DatakomD, bank: &mut Bank) {
    bank.integer(ETHERNET_PACKETS, unit.packets.into());
}

/// Where a feed's registers stand; phases follow each other, 32 bits apart but for the power factors.
struct FeedRegisters {
    phase_voltage: u16,
    line_voltage: u16,
    current: u16,
    neutral_current: u16,
    active: u16,
    total_active: u16,
    reactive: u16,
    total_reactive: u16,
    apparent: u16,
    total_apparent: u16,
    power_factor: u16,
    total_power_factor: u16,
    frequency: u16,
    average_voltage: u16,
    average_current: u16,
}

const MAINS: FeedRegisters = FeedRegisters {
    phase_voltage: 10240,
    line_voltage: 10252,
    current: 10264,
    neutral_current: 10276,
    active: 10280,
    total_active: 10292,
    reactive: 10296,
    total_reactive: 10308,
    apparent: 10312,
    total_apparent: 10324,
    power_factor: 10328,
    total_power_factor: 10334,
    frequency: 10338,
    average_voltage: 10381,
    average_current: 10383,
};

const GENSET: FeedRegisters = FeedRegisters {
    phase_voltage: 10246,
    line_voltage: 10258,
    current: 10270,
    neutral_current: 10278,
    active: 10286,
    total_active: 10294,
    reactive: 10302,
    total_reactive: 10310,
    apparent: 10318,
    total_apparent: 10326,
    power_factor: 10331,
    total_power_factor: 10335,
    frequency: 10339,
    average_voltage: 10377,
    average_current: 10379,
};

fn feed(feed: &Feed, at: &FeedRegisters, bank: &mut Bank) {
    bank.numbers(at.phase_voltage, 2, feed.voltage);
    bank.numbers(at.line_voltage, 2, feed.line_voltage());
    bank.numbers(at.current, 2, feed.current());
    bank.number(at.neutral_current, feed.neutral_current());
    bank.numbers(at.active, 2, feed.active);
    bank.number(at.total_active, feed.total_active());
    bank.numbers(at.reactive, 2, feed.reactive);
    bank.number(at.total_reactive, feed.total_reactive());
    bank.numbers(at.apparent, 2, feed.apparent());
    bank.number(at.total_apparent, feed.total_apparent());
    bank.numbers(at.power_factor, 1, feed.power_factor());
    bank.number(at.total_power_factor, feed.total_power_factor());
    bank.number(at.frequency, feed.frequency);
    bank.number(at.average_voltage, feed.average_voltage());
    bank.number(at.average_current, feed.average_current());
}

fn engine(unit: &DatakomD, bank: &mut Bank) {
    let (plant, readings) = (&unit.plant, &unit.readings);
    let engine = &plant.engine;
    let senders = [readings.oil_pressure, readings.temperature, readings.fuel_level];
    for (address, value) in (10361..).zip(senders) {
        // An open sender shows what one that is not fitted does.
        match value {
            Some(value) => bank.number(address, value),
            None => bank.absent(address),
        }
    }
    bank.number(10364, engine.oil);
    bank.number(10365, plant.canopy);
    bank.number(10366, plant.ambient);
    // No second set of senders is fitted.
    for address in 10367..=10372 {
        bank.absent(address);
    }
    bank.number(10375, readings.pickup);
    bank.number(10376, readings.speed);
    let (governor, regulator) = unit.regulation.outputs();
    bank.number(10607, governor);
    bank.number(10608, regulator);
    bank.number(11680, engine.burn);
}

fn batteries(unit: &DatakomD, bank: &mut Bank) {
    let [first, second] = &unit.plant.batteries;
    bank.number(10340, first.charge_input);
    bank.number(10341, first.voltage);
    bank.number(10343, second.charge_input);
    bank.number(10344, second.voltage);
    bank.number(10385, first.cranking_minimum);
    bank.number(11172, second.cranking_minimum);
    bank.number(11173, first.charge_current);
    bank.number(11174, second.charge_current);
}

/// Senders as they are usually fitted: 10-180 ohm for pressure and level, NTC for temperatures.
fn analogs(unit: &DatakomD, bank: &mut Bank) {
    let (plant, readings) = (&unit.plant, &unit.readings);
    let ntc = |degc: f64| 287.0 * ((40.0 - degc) / 28.0).exp();
    bank.numbers(
        10345,
        1,
        [
            readings.oil_pressure.map_or(OPEN_CIRCUIT, |bar| 10.0 + 17.4 * bar),
            readings.temperature.map_or(OPEN_CIRCUIT, ntc),
            readings.fuel_level.map_or(OPEN_CIRCUIT, |percent| 10.0 + 1.7 * percent),
            ntc(plant.engine.oil),
            ntc(plant.canopy),
            ntc(plant.ambient),
        ],
    );
    // Nothing is connected to the last two.
    bank.absent(10351);
    bank.absent(10352);
}

fn harmonics(unit: &DatakomD, analysis: &Analysis, bank: &mut Bank) {
    bank.number(10386, analysis.distortion);
    bank.number(10387, analysis.fundamental);
    bank.numbers(10388, 1, analysis.harmonics);
    bank.code(10403, unit.channel);
    bank.trace(10404, &analysis.trace);
}

/// The channels 0 to 19 of register 8194.
fn selected(unit: &DatakomD) -> Analysis {
    let (mains, genset) = (&unit.plant.mains, &unit.plant.genset);
    let phase = usize::from(unit.channel % 3);
    let (shape, feed, rms) = match unit.channel {
        0..=2 => (Shape::MainsVoltage, mains, mains.voltage[phase]),
        3..=5 => (Shape::GensetVoltage, genset, genset.voltage[phase]),
        6..=8 => (Shape::MainsVoltage, mains, mains.line_voltage()[phase]),
        9..=11 => (Shape::GensetVoltage, genset, genset.line_voltage()[phase]),
        12..=14 => (Shape::Current, mains, mains.current()[phase]),
        15..=17 => (Shape::Current, genset, genset.current()[phase]),
        18 => (Shape::NeutralCurrent, mains, mains.neutral_current()),
        _ => (Shape::NeutralCurrent, genset, genset.neutral_current()),
    };
    let line_to_line = (6..=11).contains(&unit.channel);
    // Two phases that have changed places follow each other the other way round.
    let order = if feed.phase_order_wrong { -1.0 } else { 1.0 };
    // A line voltage leads its first phase by a twelfth of a turn, a current lags by its power factor.
    let within = match shape {
        Shape::Current => feed.reactive[phase].atan2(feed.active[phase]) / TAU,
        Shape::NeutralCurrent => feed.total_reactive().atan2(feed.total_active()) / TAU,
        _ if line_to_line => -order / 12.0,
        _ => 0.0,
    };
    unit.distortion.analyse(shape, rms, order * phase as f64 / 3.0 + within, line_to_line)
}

fn state(unit: &DatakomD, bank: &mut Bank) {
    bank.code(OPERATION_STATUS, unit.sequence.operation() as u16);
    bank.code(UNIT_MODE, unit.mode as u16);
    bank.integer(10606, unit.seconds_left() as i64);
}

fn counters(unit: &DatakomD, bank: &mut Bank) {
    let plant = &unit.plant;
    bank.integer(10616, unit.sequence.runs.into());
    bank.integer(10618, unit.sequence.cranks.into());
    bank.integer(10620, unit.sequence.loads.into());

    bank.number(10622, plant.engine.hours);
    let since = unit.service.since(plant.engine.hours, plant.time);
    bank.numbers(10624, 2, since);
    let energy = &plant.genset_energy;
    bank.numbers(10628, 2, [energy.active, energy.inductive, energy.capacitive]);
    for (left, interval) in SERVICES.into_iter().zip(unit.settings.services) {
        for ((address, interval), since) in left.into_iter().zip(interval).zip(since) {
            bank.number(address, interval - since);
        }
    }

    let energy = &plant.mains_energy;
    bank.numbers(11569, 2, [energy.active, energy.inductive, energy.capacitive, energy.exported]);
    bank.number(11577, plant.engine.burned);
}

fn identity(unit: &DatakomD, bank: &mut Bank) {
    let identity = &unit.identity;
    for (address, value) in [10594, 10596, 10598].into_iter().zip(unit.gps.fix()) {
        bank.integer(address, value);
    }
    bank.code(10609, identity.code);
    bank.integer(10610, 0x0103);
    bank.integer(10611, 0x0506);
    bank.bytes(10646, vec![10, 64, 12, identity.unique[0]]);
    bank.integer(11682, unit.ethernet_resets.into());
    bank.bytes(11684, identity.mac.to_vec());
    bank.bytes(11687, identity.unique.to_vec());
    bank.bytes(11693, identity.imei.to_vec());
}

/// What all gensets on the bus bar carry together, and by how much this one is behind.
fn load_share(unit: &DatakomD, bank: &mut Bank) {
    let (genset, sisters) = (&unit.plant.genset, &unit.plant.sisters);
    let (own_active, own_reactive) = (genset.total_active(), genset.total_reactive());
    let (active, reactive) = (own_active + sisters.active(), own_reactive + sisters.reactive());
    let apparent = active.hypot(reactive);
    let sets = sisters.sets();
    bank.number(11175, active);
    bank.number(11177, reactive);
    bank.number(11374, 100.0 * active / (sets * RATED_KW));
    bank.number(11375, 100.0 * reactive / (sets * RATED_KVAR));
    bank.number(11376, if apparent > 0.0 { active / apparent } else { 0.0 });
    bank.number(11377, sisters.behind(own_active));
    bank.number(11378, 100.0 * sisters.short(own_reactive, sisters.reactive()) / RATED_KVAR);
}

/// Whose hours or days are used up, and those that somebody has injected.
fn services_due(unit: &DatakomD, bank: &Bank) -> [bool; SERVICES.len()] {
    let used_up = |register: u16| bank.number_shown(register).is_some_and(|left| left <= 0.0);
    let injected = unit.alarms.of(Class::Warning);
    std::array::from_fn(|service| {
        SERVICES[service].into_iter().any(used_up) || injected.contains(SERVICE_1_REQUEST + service as u16)
    })
}

fn alarms(unit: &DatakomD, due: [bool; SERVICES.len()], bank: &mut Bank) {
    let mut warning = unit.alarms.of(Class::Warning);
    for (bit, _) in (SERVICE_1_REQUEST..).zip(due).filter(|(_, due)| *due) {
        warning.insert(bit);
    }
    bank.bits(SHUTDOWN_ALARMS, unit.alarms.of(Class::Shutdown));
    bank.bits(LOAD_DUMP_ALARMS, unit.alarms.of(Class::LoadDump));
    bank.bits(WARNING_ALARMS, warning);
}
