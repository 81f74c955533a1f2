//! From the controller to its registers, in the manual's order; the addresses are the manual's.

use busbar_profile::BitSet;

use crate::bank::Bank;

use super::Hat821si;
use super::counters::{calendar, parts};
use super::loads::Loads;
use super::plant::{Drive, FEEDERS, RATED_CURRENT, Source, Switch};

/// Words whose bits are all faults.
const FAULTS: [u16; 7] = [503, 523, 524, 525, 526, 527, 528];
/// Bits of word 504 that are faults; its others are warnings.
const FAULTS_OF_504: [u16; 5] = [9, 12, 13, 14, 15];
/// Bits of word 511 that are faults; its others are warnings.
const FAULTS_OF_511: [u16; 4] = [12, 13, 14, 15];

/// Stores all of them.
pub(super) fn registers(unit: &Hat821si, bank: &mut Bank) {
    let [first, second] = &unit.plant.sources;
    source(first, &S1, bank);
    source(second, &S2, bank);
    between(bank);
    state(unit, bank);
    alarms(unit, bank);
    load_switches(unit, bank);
    inputs_and_outputs(unit, bank);
    counters(unit, bank);
    // These follow what the alarm words show, pinned or not.
    common(unit, bank);
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

fn source(source: &Source, at: &SourceRegisters, bank: &mut Bank) {
    let feed = &source.feed;
    bank.numbers(at.line_voltage, 1, feed.line_voltage());
    bank.numbers(at.phase_voltage, 1, feed.voltage);
    for ((phase, address), degrees) in (0..).zip(at.angle..).zip(source.angles()) {
        match source.has_phase(phase) {
            true => bank.number(address, degrees),
            false => bank.absent(address),
        }
    }
    bank.number(at.frequency, feed.frequency);
    bank.number(at.unbalance, 1000.0 * unbalance(feed.line_voltage()));

    let (residual, residual_angle) = source.residual();
    bank.numbers(at.current, 1, feed.current());
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
    bank.number(at.zero_sequence_share, 1000.0 * residual / RATED_CURRENT);
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
    // Nothing is synchronized: every transfer is open.
    bank.integer(1083, 0);
    bank.integer(1107, 0);
}

fn state(unit: &Hat821si, bank: &mut Bank) {
    let [first, second] = &unit.supervision;
    for (address, source) in [(1088, first), (1090, second)] {
        bank.code(address, source.status());
        bank.integer(address + 1, source.seconds_left() as i64);
    }
    bank.bits(501, first.bits().collect());
    bank.bits(502, second.bits().collect());
    bank.code(1092, unit.genset.status());
    bank.integer(1093, unit.genset.seconds_left() as i64);

    let positions = unit.plant.positions();
    let steps = unit.loads.each_ref().map(Loads::steps);
    let status = match (unit.sequence.is_still(), steps) {
        (true, [Some(Drive::Close), _]) => 26,
        (true, [Some(Drive::Open), _]) => 27,
        (true, [None, Some(Drive::Close)]) => 28,
        (true, [None, Some(Drive::Open)]) => 29,
        _ => unit.sequence.status(positions),
    };
    bank.code(1094, status);
    bank.integer(1095, unit.sequence.seconds_left() as i64);
    bank.integer(1084, unit.sequence.seconds_to_alarm() as i64);

    let [qs1, qtie, qs2] = unit.sequence.drives();
    let closed = |switch| positions.is_closed(switch);
    bank.bits(
        507,
        set([
            (0, qs1 == Some(Drive::Close)),
            (1, qs1 == Some(Drive::Open)),
            (2, qs2 == Some(Drive::Close)),
            (3, qs2 == Some(Drive::Open)),
            (4, closed(Switch::Qs1)),
            (5, closed(Switch::Qs2)),
            (13, unit.remote_start),
            (14, unit.mains_abnormal),
        ]),
    );
    bank.bits(508, BitSet::EMPTY);
    bank.bits(509, set([(6, unit.loads.iter().any(Loads::asks))]));
    bank.bits(
        510,
        set([(2, qtie == Some(Drive::Close)), (3, qtie == Some(Drive::Open)), (7, closed(Switch::Qtie))]),
    );
}

fn alarms(unit: &Hat821si, bank: &mut Bank) {
    let failed = |switch, drive| unit.sequence.failed_to(switch, drive);
    let of_sources = [
        (1, failed(Switch::Qs1, Drive::Close)),
        (2, failed(Switch::Qs1, Drive::Open)),
        (4, failed(Switch::Qs2, Drive::Close)),
        (5, failed(Switch::Qs2, Drive::Open)),
    ];
    let any = of_sources.iter().any(|(_, failed)| *failed);
    bank.bits(503, set(of_sources.into_iter().chain([(0, any)])));
    bank.bits(504, set([(12, failed(Switch::Qtie, Drive::Close)), (13, failed(Switch::Qtie, Drive::Open))]));
    // Every expansion module answers, and nothing feeds back.
    bank.bits(511, BitSet::EMPTY);
    bank.bits(512, set([(6, unit.loads.iter().any(|loads| !loads.tripped().is_empty()))]));
}

fn load_switches(unit: &Hat821si, bank: &mut Bank) {
    // Nothing is unloaded, and no load switch has failed to move or been drawn out.
    bank.bits(513, BitSet::EMPTY);
    for (side, loads) in (0..).zip(&unit.loads) {
        for word in [523, 525, 537, 539, 541] {
            bank.bits(word + side, BitSet::EMPTY);
        }
        bank.bits(527 + side, loads.tripped());
        bank.bits(529 + side, loads.driven(true));
        bank.bits(531 + side, loads.driven(false));
        bank.bits(533 + side, loads.closed());
        bank.bits(535 + side, every_feeder());
        bank.integer(1086 + side, loads.trip_number().into());
        bank.integer(1096 + side, loads.acted().into());
        bank.integer(1098 + side, 0);
    }
}

fn inputs_and_outputs(unit: &Hat821si, bank: &mut Bank) {
    let positions = unit.plant.positions();
    let feedback = [Switch::Qs1, Switch::Qs2, Switch::Qtie].map(|switch| positions.is_closed(switch));
    bank.bits(505, set((0..).zip(feedback).chain([(3, unit.genset.is_running())])));
    let supplied = unit.plant.sources.iter().any(Source::is_present);
    bank.bits(
        506,
        set([
            (0, unit.genset.start_output()),
            (1, !unit.horn.is_zero()),
            (2, unit.alarms > 0),
            (3, unit.auto),
            (12, supplied),
            (13, supplied),
        ]),
    );
    for (side, loads) in (0..).zip(&unit.loads) {
        bank.bits(514 + side, loads.closed());
        bank.bits(516 + side, loads.tripped());
        bank.bits(518 + side, every_feeder());
        bank.bits(521 + side, loads.driven(true));
    }
    bank.bits(520, set((0..).zip(unit.remote_outputs)));
    bank.bits(543, BitSet::EMPTY);
}

fn counters(unit: &Hat821si, bank: &mut Bank) {
    for (address, part) in (1100..).zip(calendar(unit.epoch.plus(unit.passed))) {
        bank.integer(address, part);
    }
    let [load_1, load_2] = &unit.load_supply;
    for (address, time) in
        [(1108, load_2.present), (1111, load_1.present), (1114, load_1.last), (1155, load_2.last)]
    {
        for (register, part) in (address..).zip(parts(time)) {
            bank.integer(register, part);
        }
    }
    // Here the hours have two registers.
    let [source_1, source_2] = unit.source_supply;
    for (address, time) in [(1117, source_1), (1121, source_2), (1158, load_1.total), (1162, load_2.total)] {
        let [hours, minutes, seconds] = parts(time);
        bank.integer(address, hours);
        bank.integer(address + 2, minutes);
        bank.integer(address + 3, seconds);
    }
    let [qs1, qtie, qs2] = &unit.plant.switches;
    for (address, switch) in [(1133, qs1), (1135, qs2), (1137, qtie)] {
        bank.integer(address, switch.closings.into());
    }
}

fn common(unit: &Hat821si, bank: &mut Bank) {
    let fault = FAULTS.iter().any(|word| !bank.bits_shown(*word).is_empty())
        || FAULTS_OF_504.iter().any(|bit| bank.bits_shown(504).contains(*bit))
        || FAULTS_OF_511.iter().any(|bit| bank.bits_shown(511).contains(*bit));
    let warning = !bank.bits_shown(512).is_empty()
        || bank.bits_shown(504).iter().any(|bit| !FAULTS_OF_504.contains(&bit))
        || bank.bits_shown(511).iter().any(|bit| !FAULTS_OF_511.contains(&bit));
    let [s1_master, s2_master] = unit.masters;
    bank.bits(
        500,
        set([
            (0, fault || warning),
            (1, warning),
            (2, fault),
            (6, !unit.horn.is_zero()),
            (8, unit.auto),
            (9, unit.local),
            (10, s1_master),
            (11, s2_master),
            (13, !unit.local),
            (15, unit.genset.start_output()),
        ]),
    );
}

fn every_feeder() -> BitSet {
    (0..FEEDERS as u16).collect()
}

fn set(bits: impl IntoIterator<Item = (u16, bool)>) -> BitSet {
    bits.into_iter().filter(|(_, on)| *on).map(|(bit, _)| bit).collect()
}
