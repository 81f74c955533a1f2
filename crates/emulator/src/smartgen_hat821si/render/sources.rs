//! What the meters of both sources show, and what lies between them.

use crate::bank::Bank;

use super::super::Hat821si;
use super::super::plant::{Meter, Source};

/// Stores it.
pub(super) fn store(unit: &Hat821si, bank: &mut Bank) {
    let rated = unit.limits.protection.rated_current().max(1.0);
    for ((from, meter), at) in unit.plant.sources.iter().zip(&unit.meters).zip([&S1, &S2]) {
        source(from, meter, rated, at, bank);
    }
    between(bank);
}

/// Where the registers of a source stand.
struct SourceRegisters {
    line_voltage: u16,
    phase_voltage: u16,
    angle: u16,
    frequency: u16,
    unbalance: u16,
    current: u16,
    neutral_current: u16,
    current_angle: u16,
    neutral_angle: u16,
    active: u16,
    total_active: u16,
    reactive: u16,
    total_reactive: u16,
    apparent: u16,
    total_apparent: u16,
    power_factor: u16,
    average_power_factor: u16,
    zero_sequence: u16,
    zero_sequence_share: u16,
    active_energy: u16,
    reactive_energy: u16,
}

const S1: SourceRegisters = SourceRegisters {
    line_voltage: 1000,
    phase_voltage: 1003,
    angle: 1006,
    frequency: 1009,
    unbalance: 1033,
    current: 1040,
    neutral_current: 1043,
    current_angle: 1044,
    neutral_angle: 1047,
    active: 1048,
    total_active: 1054,
    reactive: 1056,
    total_reactive: 1062,
    apparent: 1064,
    total_apparent: 1070,
    power_factor: 1072,
    average_power_factor: 1075,
    zero_sequence: 1079,
    zero_sequence_share: 1080,
    active_energy: 1125,
    reactive_energy: 1127,
};

const S2: SourceRegisters = SourceRegisters {
    line_voltage: 1020,
    phase_voltage: 1023,
    angle: 1026,
    frequency: 1029,
    unbalance: 1034,
    current: 1166,
    neutral_current: 1169,
    current_angle: 1170,
    neutral_angle: 1173,
    active: 1174,
    total_active: 1180,
    reactive: 1182,
    total_reactive: 1188,
    apparent: 1190,
    total_apparent: 1196,
    power_factor: 1198,
    average_power_factor: 1201,
    zero_sequence: 1202,
    zero_sequence_share: 1203,
    active_energy: 1129,
    reactive_energy: 1131,
};

fn source(source: &Source, meter: &Meter, rated: f64, at: &SourceRegisters, bank: &mut Bank) {
    let feed = &meter.feed;
    bank.numbers(at.line_voltage, 1, feed.line_voltage());
    bank.numbers(at.phase_voltage, 1, feed.voltage);
    for (address, degrees) in (at.angle..).zip(meter.angles) {
        match degrees {
            Some(degrees) => bank.number(address, degrees),
            None => bank.absent(address),
        }
    }
    bank.number(at.frequency, feed.frequency);
    bank.number(at.unbalance, 1000.0 * unbalance(feed.line_voltage()));

    let (residual, residual_angle) = meter.residual;
    bank.numbers(at.current, 1, meter.current);
    bank.number(at.neutral_current, residual);
    bank.numbers(at.current_angle, 1, source.current_angles().map(|degrees| 10.0 * degrees));
    bank.number(at.neutral_angle, 10.0 * residual_angle);
    bank.numbers(at.active, 2, feed.active);
    bank.number(at.total_active, feed.total_active());
    bank.numbers(at.reactive, 2, feed.reactive);
    bank.number(at.total_reactive, feed.total_reactive());
    bank.numbers(at.apparent, 2, feed.apparent());
    bank.number(at.total_apparent, feed.total_apparent());
    bank.numbers(at.power_factor, 1, feed.power_factor().map(|factor| 100.0 * factor));
    bank.number(at.average_power_factor, 100.0 * feed.total_power_factor());
    bank.number(at.zero_sequence, residual);
    bank.number(at.zero_sequence_share, 1000.0 * residual / rated);
    bank.number(at.active_energy, source.energy.active);
    bank.number(at.reactive_energy, source.energy.inductive);
}

/// The largest distance from the mean, as a part of the mean; 0 where there is no voltage.
fn unbalance(volts: [f64; 3]) -> f64 {
    let mean = volts.iter().sum::<f64>() / 3.0;
    let farthest = volts.iter().map(|volts| (volts - mean).abs()).fold(0.0, f64::max);
    if mean > 1.0 { farthest / mean } else { 0.0 }
}

/// Differences of what the two meters show, pinned or not; 0 between angles that are not there.
fn between(bank: &mut Bank) {
    let difference = |bank: &Bank, first, second| {
        bank.number_shown(first).zip(bank.number_shown(second)).map(|(first, second)| first - second)
    };
    let volts = difference(bank, S1.line_voltage, S2.line_voltage);
    let hertz = difference(bank, S1.frequency, S2.frequency);
    let degrees = difference(bank, S1.angle, S2.angle);
    bank.number(1030, volts.unwrap_or(0.0).clamp(-32_768.0, 32_767.0));
    bank.number(1031, hertz.unwrap_or(0.0).clamp(-100.0, 100.0));
    bank.number(1032, degrees.map_or(0.0, |degrees| (degrees + 180.0).rem_euclid(360.0) - 180.0));
}
