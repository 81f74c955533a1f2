//! From the controller to its registers, in the manual's order; the addresses are the manual's.

mod sources;

use busbar_profile::BitSet;

use crate::bank::Bank;

use super::Hat821si;
use super::alarms::{FAULTS, FAULTS_OF_504, FAULTS_OF_511, WORDS};
use super::counters::{calendar, parts};
use super::inputs::{Input, OWN_OPENING};
use super::loads::Loads;
use super::switches::{Drive, FEEDERS, Positions, Switch};

/// Part of the rated voltage that the supply of the switches' drives needs.
const SUPPLY: f64 = 0.7;

/// The address of a word by the id of its point.
pub(super) fn word_of(point: &str) -> Option<u16> {
    let profile = busbar_profile::builtin("smartgen-hat821si")?;
    profile.point(point).map(|point| point.address)
}

/// Stores all of them.
pub(super) fn registers(unit: &Hat821si, bank: &mut Bank) {
    sources::store(unit, bank);
    sequence(unit, bank);
    state(unit, bank);
    alarms(unit, bank);
    load_switches(unit, bank);
    inputs_and_outputs(unit, bank);
    counters(unit, bank);
    // These follow what the alarm words show, pinned or not.
    common(unit, bank);
}

fn sequence(unit: &Hat821si, bank: &mut Bank) {
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
    bank.integer(1095, unit.sequence.seconds_left().into());
    bank.integer(1083, unit.sequence.seconds_to_sync_failure().into());
    bank.integer(1084, unit.sequence.seconds_to_alarm().into());
    bank.integer(1107, unit.limits.sync.loops().into());
}

fn state(unit: &Hat821si, bank: &mut Bank) {
    let [first, second] = &unit.supervision;
    for (address, source) in [(1088, first), (1090, second)] {
        bank.code(address, source.status());
        bank.integer(address + 1, source.seconds_left().into());
    }
    bank.bits(501, first.bits().collect());
    bank.bits(502, second.bits().collect());
    bank.code(1092, unit.genset.status());
    bank.integer(1093, unit.genset.seconds_left().into());

    let positions = unit.plant.positions();
    let [qs1, qtie, qs2] = unit.sequence.drives();
    let closed = |switch| positions.is_closed(switch);
    let causes = unit.genset.causes();
    bank.bits(
        507,
        set([
            (0, qs1 == Some(Drive::Close)),
            (1, qs1 == Some(Drive::Open)),
            (2, qs2 == Some(Drive::Close)),
            (3, qs2 == Some(Drive::Open)),
            (4, closed(Switch::Qs1)),
            (5, closed(Switch::Qs2)),
            (12, causes.on_load),
            (13, causes.off_load),
            (14, causes.mains_abnormal),
            (15, causes.scheduled),
        ]),
    );
    bank.bits(
        510,
        set([
            (2, qtie == Some(Drive::Close)),
            (3, qtie == Some(Drive::Open)),
            (7, closed(Switch::Qtie)),
            (10, unit.inputs.has(Input::Qs1QtieInhibit)),
            (11, unit.inputs.has(Input::Qs2QtieInhibit)),
        ]),
    );
    controls(unit, bank);
}

fn controls(unit: &Hat821si, bank: &mut Bank) {
    let waits = |switch| unit.sequence.waits_for() == Some(switch);
    let has = |input| unit.inputs.has(input);
    let mut starts = set([
        (4, unit.genset.is_not_scheduled()),
        (10, unit.genset.is_inhibited()),
        (12, has(Input::S1CloseInhibit)),
        (13, has(Input::S2CloseInhibit)),
        (14, waits(Switch::Qs1)),
        (15, waits(Switch::Qs2)),
    ]);
    if let Some(choice) = unit.genset.choice_bit() {
        starts.insert(choice);
    }
    bank.bits(508, starts);
    let shed = unit.shedding.steps();
    bank.bits(
        509,
        set([
            (0, shed >= 1),
            (1, shed >= 2),
            (2, shed >= 3),
            (5, unit.sequence.holds_elevators()),
            (6, unit.loads.iter().any(Loads::asks)),
            (8, has(Input::QtieCloseInhibit)),
            (10, waits(Switch::Qtie)),
            (11, has(Input::AutoRestore)),
            (12, has(Input::RemoteInhibit)),
            (13, has(Input::S1SupplyQtieInhibit)),
            (14, has(Input::S2SupplyQtieInhibit)),
        ]),
    );
}

fn alarms(unit: &Hat821si, bank: &mut Bank) {
    for word in WORDS {
        bank.bits(word, unit.board.word(word));
    }
}

fn load_switches(unit: &Hat821si, bank: &mut Bank) {
    let any = |those: fn(&Loads, Option<usize>) -> BitSet, source| {
        unit.loads.iter().any(|loads| !those(loads, Some(source)).is_empty())
    };
    bank.bits(
        513,
        set([
            (0, any(Loads::unloaded, 0)),
            (1, any(Loads::unloaded, 1)),
            (2, any(Loads::recovering, 0)),
            (3, any(Loads::recovering, 1)),
        ]),
    );
    for (side, loads) in (0..).zip(&unit.loads) {
        let heard = unit.inputs.feeders(usize::from(side));
        let those = |which: [bool; FEEDERS]| set((0..).zip(which));
        bank.bits(529 + side, loads.driven(Drive::Close));
        bank.bits(531 + side, loads.driven(Drive::Open));
        bank.bits(533 + side, those(heard.closed));
        bank.bits(535 + side, those(heard.in_work));
        bank.bits(537 + side, those(heard.in_work.map(|in_work| !in_work)));
        bank.bits(539 + side, loads.unloaded(None));
        bank.bits(541 + side, loads.recovering(None));
        bank.integer(1086 + side, loads.trip_number().into());
        bank.integer(1096 + side, loads.acted().into());
        bank.integer(1098 + side, loads.failure_number().into());
    }
}

fn inputs_and_outputs(unit: &Hat821si, bank: &mut Bank) {
    bank.bits(505, unit.inputs.own());
    let volts = |source: usize| unit.meters[source].feed.average_voltage();
    let supplied = (0..2).any(|source| volts(source) > SUPPLY * unit.limits.supervision.rated());
    let [first, second] = unit.genset.signals();
    bank.bits(
        506,
        set([
            (0, first || second),
            (1, !unit.horn.is_zero()),
            (2, !unit.alarms.is_empty()),
            (3, unit.auto),
            (4, first),
            (5, second),
            (6, unit.sequence.holds_elevators()),
            (12, supplied),
            (13, supplied),
        ]),
    );
    for (word, module) in (514..).zip(unit.inputs.modules()) {
        bank.bits(word, module);
    }
    output_modules(unit, bank);
}

/// The remote outputs on module 1; on 2 and 3 the closing outputs of a side and the opening outputs of its first four
/// load switches; on 4 the opening outputs of all others. What is silent is off.
fn output_modules(unit: &Hat821si, bank: &mut Bank) {
    let [first, _, _, last] = unit.inputs.output_modules_cut;
    bank.bits(520, set((0..).zip(unit.remote_outputs).filter(|_| !first)));
    let mut rest = BitSet::EMPTY;
    for (side, loads) in (0..).zip(&unit.loads) {
        let cut = unit.inputs.output_modules_cut[1 + usize::from(side)];
        let mut own = loads.driven(Drive::Close);
        for bit in loads.driven(Drive::Open).iter() {
            let (own_opening, feeders) = (OWN_OPENING as u16, FEEDERS as u16);
            match bit.checked_sub(own_opening) {
                None => own.insert(feeders + bit),
                Some(place) => rest.insert(side * (feeders - own_opening) + place),
            }
        }
        bank.bits(521 + side, if cut { BitSet::EMPTY } else { own });
    }
    bank.bits(543, if last { BitSet::EMPTY } else { rest });
}

fn counters(unit: &Hat821si, bank: &mut Bank) {
    for (address, part) in (1100..).zip(calendar(unit.now())) {
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
        bank.integer(address, switch.closings().into());
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
            (12, unit.sequence.loops() || unit.plant.positions() == Positions::ALL_CLOSED),
            (13, !unit.local),
            (15, unit.genset.start_output()),
        ]),
    );
}

fn set(bits: impl IntoIterator<Item = (u16, bool)>) -> BitSet {
    bits.into_iter().filter(|(_, on)| *on).map(|(bit, _)| bit).collect()
}
