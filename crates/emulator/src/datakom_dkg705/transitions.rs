//! Every way from one operation to another: the code against this table, and the documentation's state diagram too.

use std::collections::BTreeSet;
use std::time::Duration;

use super::operation::Operation::{self, *};
use super::parameters::{Parameters, site, site_with};
use super::sequence::{Demand, Sensed, Sequence};

/// Where from, where to, and what brings it about.
const TRANSITIONS: &[(Operation, Operation, &str)] = &[
    (AtRest, WaitBeforeFuel, "engine wanted"),
    (AtRest, MainsContactor, "good mains are not connected"),
    (WaitBeforeFuel, AtRest, "no longer wanted"),
    (WaitBeforeFuel, MainsContactor, "mains are back"),
    (WaitBeforeFuel, WaitBeforeCrank, "timer over, fuel opens"),
    (WaitBeforeCrank, Cranking, "timer over"),
    (WaitBeforeCrank, Heating, "engine runs after all"),
    (WaitBeforeCrank, Stopping, "no longer wanted"),
    (Cranking, Heating, "engine runs"),
    (Cranking, WaitBeforeCrank, "timer over, attempts left"),
    (Cranking, Stopping, "fail to start, or no longer wanted"),
    (Heating, OffLoad, "warm, no load wanted"),
    (Heating, SynchronizeToGenset, "warm, load wanted, mains live"),
    (Heating, GensetContactor, "warm, load wanted, mains dead or not connected"),
    (Heating, Cooldown, "no longer wanted"),
    (OffLoad, SynchronizeToGenset, "load wanted, mains live"),
    (OffLoad, GensetContactor, "load wanted, mains dead or not connected"),
    (OffLoad, MainsContactor, "good mains are not connected"),
    (OffLoad, Cooldown, "no longer wanted"),
    (Cooldown, OffLoad, "engine wanted again"),
    (Cooldown, SynchronizeToGenset, "load wanted again, mains live"),
    (Cooldown, GensetContactor, "load wanted again, mains dead or not connected"),
    (Cooldown, MainsContactor, "good mains are not connected"),
    (Cooldown, Stopping, "timer over, fuel closes"),
    (Stopping, AtRest, "timer over, engine stands"),
    (SynchronizeToGenset, GensetContactorSynch, "in step"),
    (SynchronizeToGenset, GensetContactor, "mains fail, or synchronization fail"),
    (SynchronizeToGenset, OffLoad, "load no longer wanted, or synchronization fail in peak lopping"),
    (SynchronizeToGenset, Cooldown, "no longer wanted"),
    (GensetContactorSynch, SynchronizeToGenset, "contactor has not closed"),
    (GensetContactorSynch, SoftToGenset, "closed, soft transfer"),
    (GensetContactorSynch, LoadOnGenset, "closed, hard transfer, or mains fail"),
    (GensetContactorSynch, GensetContactor, "mains fail before it has closed, or joined out of step"),
    (GensetContactorSynch, SoftToMains, "closed, load no longer wanted"),
    (GensetContactorSynch, OffLoad, "joined out of step, load no longer wanted or peak lopping"),
    (GensetContactorSynch, Cooldown, "joined out of step, no longer wanted"),
    (SoftToGenset, LoadOnGenset, "mains unloaded and opened, or mains fail"),
    (SoftToGenset, SoftToMains, "load no longer wanted"),
    (SoftToGenset, OffLoad, "genset contactor has fallen"),
    (SoftToGenset, Cooldown, "genset contactor has fallen, no longer wanted"),
    (GensetContactor, LoadOnGenset, "closed"),
    (GensetContactor, MainsContactor, "load no longer wanted, mains good"),
    (GensetContactor, OffLoad, "load no longer wanted"),
    (GensetContactor, Cooldown, "no longer wanted"),
    (LoadOnGenset, SynchronizeToMains, "mains may take the load without a break"),
    (LoadOnGenset, MainsContactor, "genset contactor open, mains good"),
    (LoadOnGenset, GensetContactor, "mains fail, and their contactor does not open"),
    (LoadOnGenset, OffLoad, "genset contactor has fallen"),
    (LoadOnGenset, Cooldown, "genset contactor open, no longer wanted"),
    (SynchronizeToMains, MainsContactorSynch, "in step"),
    (SynchronizeToMains, LoadOnGenset, "mains fail, or load wanted again"),
    (SynchronizeToMains, MainsContactor, "synchronization fail, or genset contactor has fallen"),
    (MainsContactorSynch, SynchronizeToMains, "contactor has not closed"),
    (MainsContactorSynch, SoftToMains, "closed, soft transfer"),
    (MainsContactorSynch, SoftToGenset, "closed, load wanted again or peak lopping"),
    (MainsContactorSynch, LoadOnGenset, "mains fail, or load wanted again in hard transfer"),
    (MainsContactorSynch, Cooldown, "closed in hard transfer, or joined out of step"),
    (MainsContactorSynch, OffLoad, "the same, engine still wanted"),
    (SoftToMains, LoadOnGenset, "mains fail"),
    (SoftToMains, SoftToGenset, "load wanted again"),
    (SoftToMains, Cooldown, "genset unloaded and opened"),
    (SoftToMains, OffLoad, "genset unloaded and opened, engine still wanted"),
    (MainsContactor, AtRest, "closed or mains fail, or contactor refuses and engine wanted, engine stands"),
    (MainsContactor, OffLoad, "closed, mains fail, contactor refuses or load wanted, engine wanted"),
    (MainsContactor, Cooldown, "closed, mains fail or contactor refuses, engine no longer wanted"),
];

const ALL: [Operation; 17] = [
    AtRest,
    WaitBeforeFuel,
    WaitBeforeCrank,
    Cranking,
    Heating,
    OffLoad,
    SynchronizeToGenset,
    GensetContactorSynch,
    GensetContactor,
    LoadOnGenset,
    SynchronizeToMains,
    MainsContactorSynch,
    MainsContactor,
    Cooldown,
    Stopping,
    SoftToMains,
    SoftToGenset,
];
const DEMANDS: [Demand; 4] = [Demand::REST, Demand::OFF_LOAD, Demand::ON_LOAD, Demand::PARALLEL];
const LONG: Duration = Duration::from_secs(1000);

/// Every plant that the sequence can tell from another.
fn plants() -> impl Iterator<Item = Sensed> {
    (0..1_u16 << 10).map(|number| {
        let bit = |n: u16| number >> n & 1 == 1;
        Sensed {
            running: bit(0),
            turning: bit(1),
            warm: bit(2),
            genset_healthy: bit(3),
            mains_healthy: bit(4),
            mains_trusted: bit(4),
            genset_contactor: bit(5),
            mains_contactor: bit(6),
            in_step: bit(7),
            genset_unloaded: bit(8),
            mains_unloaded: bit(9),
            jolting: false,
        }
    })
}

/// An operation with and without fuel, where it can be either.
fn fuels(operation: Operation) -> &'static [bool] {
    match operation {
        AtRest | WaitBeforeFuel | Stopping => &[false],
        MainsContactor => &[false, true],
        _ => &[true],
    }
}

/// Every sequence in the middle of an operation that acts unlike another.
fn sequences(operation: Operation) -> Vec<Sequence> {
    let mut all = Vec::new();
    for &fuel in fuels(operation) {
        for (elapsed, timer) in
            [(Duration::ZERO, LONG), (Duration::ZERO, Duration::ZERO), (LONG, Duration::ZERO)]
        {
            for attempts_left in [0, 1] {
                for released in [false, true] {
                    let sequence =
                        Sequence::amid(operation, fuel, elapsed).with(attempts_left, timer, released);
                    let (joined_badly, refused) =
                        (sequence.clone().troubled(true, false), sequence.clone().troubled(false, true));
                    all.extend([sequence, joined_badly, refused]);
                }
            }
        }
    }
    all
}

fn settings() -> [Parameters; 3] {
    [
        site(),
        site_with(&[("soft_transfer", "0")]),
        site_with(&[("soft_transfer", "0"), ("no_break_transfer", "0")]),
    ]
}

/// Every step that the code can take.
fn explored() -> BTreeSet<(Operation, Operation)> {
    let mut found = BTreeSet::new();
    for set in settings() {
        let demands = DEMANDS.iter().filter(|demand| set.transfer.no_break || !demand.parallel);
        for (operation, demand) in ALL.iter().flat_map(|op| demands.clone().map(move |demand| (*op, *demand)))
        {
            for sequence in sequences(operation) {
                found.extend(
                    plants()
                        .filter_map(|sensed| sequence.next(demand, sensed, &set))
                        .map(|next| (operation, next)),
                );
            }
        }
    }
    found
}

#[test]
fn the_table_has_every_step_that_the_code_can_take_and_no_other() {
    let table: BTreeSet<_> = TRANSITIONS.iter().map(|(from, to, _)| (*from, *to)).collect();
    assert_eq!(table.len(), TRANSITIONS.len(), "each stands there once");
    let explored = explored();
    let unknown: Vec<_> = explored.difference(&table).collect();
    let impossible: Vec<_> = table.difference(&explored).collect();
    assert!(unknown.is_empty() && impossible.is_empty(), "unknown {unknown:?}, impossible {impossible:?}");
}

#[test]
fn a_shutdown_stops_whoever_has_fuel_and_a_load_dump_cools_whoever_is_loaded() {
    let set = site();
    for operation in ALL {
        for sequence in sequences(operation) {
            let (mut stopped, mut dumped) = (sequence.clone(), sequence.clone());
            stopped.stop_now(&set);
            let fuelled = sequence.is_committed();
            assert_eq!(stopped.operation(), if fuelled { Stopping } else { operation });
            dumped.dump_load(&set);
            assert_eq!(dumped.operation(), if operation.is_loaded() { Cooldown } else { operation });
        }
    }
}

#[test]
fn both_contactors_close_together_only_where_the_two_are_in_step() {
    for set in settings() {
        for (operation, demand) in ALL.iter().flat_map(|op| DEMANDS.iter().map(move |demand| (*op, *demand)))
        {
            for sequence in sequences(operation) {
                for sensed in plants() {
                    let controls = sequence.controls(demand, sensed, &set);
                    let both = controls.genset_breaker && controls.mains_breaker;
                    assert!(!both || operation.is_parallel(), "{operation:?} {sensed:?}");
                    // A contactor that closes on a source under voltage does so in step or on nothing.
                    let closes_mains = controls.mains_breaker && !sensed.mains_contactor;
                    let closes_genset = controls.genset_breaker && !sensed.genset_contactor;
                    let synchronized = sensed.in_step && operation.is_parallel();
                    assert!(
                        !closes_mains || !sensed.genset_contactor || synchronized,
                        "{operation:?} {sensed:?}"
                    );
                    assert!(!closes_mains || sensed.mains_healthy, "{operation:?} {sensed:?}");
                    // The load is on the genset: its contactor is closed already.
                    let loaded = operation.is_loaded() && operation != GensetContactor;
                    let allowed = !sensed.mains_contactor || synchronized || loaded;
                    assert!(!closes_genset || allowed, "{operation:?} {sensed:?}");
                }
            }
        }
    }
}

/// The page of the documentation that draws all this.
fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/imitation/datakom-dkg705.md");
    std::fs::read_to_string(path).unwrap()
}

/// The lines of its state diagrams.
fn diagrams(page: &str) -> impl Iterator<Item = &str> {
    page.split("```mermaid\n")
        .skip(1)
        .flat_map(|rest| rest.split("```").take(1))
        .flat_map(str::lines)
        .map(str::trim)
}

#[test]
fn the_documentation_draws_the_table() {
    let page = page();
    let drawn: Vec<_> = diagrams(&page).filter(|line| line.contains("-->")).collect();
    let steps = TRANSITIONS.iter().map(|(from, to, cause)| format!("{from:?} --> {to:?}: {cause}"));
    let table: Vec<_> = std::iter::once("[*] --> AtRest".to_owned()).chain(steps).collect();
    assert_eq!(drawn, table);
}

#[test]
fn the_documentation_names_every_operation_by_its_code() {
    let page = page();
    let drawn: BTreeSet<_> = diagrams(&page)
        .filter_map(|line| line.strip_prefix("state \"")?.split_once("\" as "))
        .map(|(label, name)| (name.to_owned(), label.split(' ').next().unwrap().parse().unwrap()))
        .collect();
    let codes = ALL.iter().map(|operation| (format!("{operation:?}"), operation.code())).collect();
    assert_eq!(drawn, codes);
}

#[test]
fn the_documentation_says_whom_a_shutdown_and_a_load_dump_reach() {
    let page = page();
    let rows: BTreeSet<_> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `"))
        .filter_map(|row| {
            let cells: Vec<_> = row.split('|').map(|cell| cell.trim().trim_end_matches('`')).collect();
            let [name, code, shutdown, load_dump, ""] = cells[..] else { return None };
            Some((name.to_owned(), code.parse::<u16>().ok()?, shutdown.to_owned(), load_dump.to_owned()))
        })
        .collect();
    let expected = ALL.iter().map(|operation| {
        let shutdown = match fuels(*operation) {
            [true] => "13",
            [false] => "-",
            _ => "13 if the engine runs",
        };
        let load_dump = if operation.is_loaded() { "12" } else { "-" };
        (format!("{operation:?}"), operation.code(), shutdown.to_owned(), load_dump.to_owned())
    });
    assert_eq!(rows, expected.collect());
}

#[test]
fn the_documentation_says_of_every_setting_what_it_steers() {
    let page = page();
    let profile = busbar_profile::builtin("datakom-dkg705").unwrap();
    let (_, settings) = page.split_once("## Settings").unwrap();
    for setting in &profile.settings {
        let named = format!("`{}`", setting.id);
        assert!(settings.contains(&named), "{named} is not there");
    }
    for named in settings.split('`').skip(1).step_by(2).filter(|name| name.contains('_')) {
        assert!(profile.setting(named).is_some(), "{named} is no setting");
    }
}
