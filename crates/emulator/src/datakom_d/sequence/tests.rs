//! The sequence as a script: demands, breakers and time.

use super::super::settings::Settings;
use super::*;

const TENTH: Duration = Duration::from_millis(100);
const ALL: [Operation; 26] = [
    AtRest,
    WaitBeforeFuel,
    Preheat,
    WaitOilFlashOff,
    CrankRest,
    Cranking,
    IdleSpeed,
    Heating,
    OffLoad,
    Synchronizing,
    TransferToGenset,
    GensetBreakerActivation,
    GensetBreakerTimer,
    OnLoad,
    PeakLopping,
    Exporting,
    SlaveOnLoad,
    SynchronizingBack,
    TransferToMains,
    MainsBreakerActivation,
    MainsBreakerTimer,
    StopWithCooldown,
    CoolingDown,
    IdleBeforeStop,
    ImmediateStop,
    Stopping,
];
const SOURCES: [Source; 5] =
    [Source::Mains, Source::Genset, Source::PeakLopping, Source::Exporting, Source::Nothing];

fn sequence(settings: &Settings) -> Sequence {
    let mut sequence = Sequence::new(100);
    sequence.configure(settings);
    sequence
}

/// A sequence with a plant that obeys at once.
struct Site {
    sequence: Sequence,
    sensed: Sensed,
    seen: Vec<u8>,
}

impl Site {
    fn new(settings: &Settings) -> Self {
        let sensed = Sensed {
            mains_healthy: true,
            mains_breaker: true,
            genset_healthy: true,
            in_step: true,
            genset_unloaded: true,
            mains_unloaded: true,
            ..Sensed::default()
        };
        Self { sequence: sequence(settings), sensed, seen: vec![0] }
    }

    fn step(&mut self, demand: Demand) {
        let turns = self.sequence.may_turn();
        (self.sensed.running, self.sensed.turning) = (turns, turns);
        self.sequence.step(TENTH, demand, self.sensed);
        let controls = self.sequence.controls(demand, self.sensed);
        (self.sensed.genset_breaker, self.sensed.mains_breaker) =
            (controls.genset_breaker, controls.mains_breaker);
        let code = self.sequence.operation() as u8;
        if self.seen.last() != Some(&code) {
            self.seen.push(code);
        }
    }

    fn pass(mut self, demand: Demand, seconds: u32) -> Self {
        for _ in 0..seconds * 10 {
            self.step(demand);
        }
        self
    }
}

fn without_break() -> Settings {
    Settings { no_break_transfer: true, ..Settings::usual() }
}

fn soft() -> Settings {
    Settings { soft_transfer: true, ..without_break() }
}

const START: [u8; 8] = [0, 1, 2, 3, 5, 6, 7, 8];
const STOP: [u8; 5] = [21, 22, 23, 25, 0];

#[test]
fn the_load_moves_with_a_break_without_one_or_softly() {
    for (settings, out, home) in [
        (Settings::usual(), &[12, 11, 13][..], &[20, 19][..]),
        (without_break(), &[9, 11, 13], &[17]),
        (soft(), &[9, 11, 10, 13], &[17, 18]),
        (Settings { slave: true, ..soft() }, &[9, 11, 10, 16], &[17, 18]),
    ] {
        let site = Site::new(&settings).pass(Demand::ON_LOAD, 60).pass(Demand::REST, 90);
        assert_eq!(site.seen, [&START[..], out, home, &STOP].concat(), "{settings:?}");
        assert_eq!(site.sequence.failures, Failures::default());
        assert_eq!((site.sequence.runs, site.sequence.loads), (101, 76));
    }
}

#[test]
fn a_genset_beside_the_mains_lops_peaks_or_exports_and_keeps_the_load_when_they_fail() {
    for (demand, code) in [(Demand::PEAK_LOPPING, 14), (Demand::EXPORTING, 15)] {
        let site = Site::new(&Settings::usual()).pass(demand, 60).pass(Demand::REST, 90);
        assert_eq!(site.seen, [&START[..], &[9, 11, code, 18], &STOP].concat());

        let mut site = Site::new(&Settings::usual()).pass(demand, 60);
        site.sensed.mains_healthy = false;
        let mut site = site.pass(Demand::ON_LOAD, 10);
        assert_eq!(site.sequence.operation(), OnLoad);
        assert!(site.sensed.genset_breaker && !site.sensed.mains_breaker);
        site.sensed.mains_healthy = true;
        let site = site.pass(demand, 10);
        assert_eq!(site.seen[site.seen.len() - 3..], [13, 17, code]);
    }
}

#[test]
fn sources_that_never_agree_are_given_up_and_the_load_moves_with_a_break() {
    let mut site = Site::new(&without_break());
    site.sensed.in_step = false;
    let site = site.pass(Demand::ON_LOAD, 120);
    assert_eq!(site.seen, [&START[..], &[9, 8, 12, 11, 13]].concat());
    let failures = site.sequence.failures;
    assert!(failures.to_synchronize && !failures.to_parallel);
    let site = site.pass(Demand::REST, 10);
    assert_eq!(site.seen[12..], [13, 20, 19, 21, 22][..], "it goes home as it came");

    let mut site = Site::new(&Settings::usual());
    site.sensed.in_step = false;
    let site = site.pass(Demand::PEAK_LOPPING, 120);
    assert_eq!(site.seen, [&START[..], &[9, 8]].concat());
    assert!(site.sequence.failures.to_parallel);
}

#[test]
fn three_attempts_then_fail_to_start_until_acknowledged() {
    let mut sequence = sequence(&Settings::usual());
    let dead = Sensed::default();
    let mut walk = Vec::new();
    while !sequence.failures.to_start {
        walk.push(until_change(&mut sequence, Demand::OFF_LOAD, dead));
    }
    assert_eq!(
        walk,
        [
            WaitBeforeFuel,
            Preheat,
            WaitOilFlashOff,
            Cranking,
            CrankRest,
            Cranking,
            CrankRest,
            Cranking,
            Stopping
        ]
    );
    assert_eq!((sequence.runs, sequence.cranks), (100, 114));
    assert_eq!(until_change(&mut sequence, Demand::REST, dead), AtRest);
    sequence.step(TENTH, Demand::REST, dead);
    assert!(sequence.failures.to_start, "whoever reports it has not acknowledged it");
    sequence.acknowledge();
    assert_eq!(sequence.failures, Failures::default());
}

/// Steps until the status changes.
fn until_change(sequence: &mut Sequence, demand: Demand, sensed: Sensed) -> Operation {
    let before = sequence.operation();
    for _ in 1..1000 {
        sequence.step(TENTH, demand, sensed);
        if sequence.operation() != before {
            return sequence.operation();
        }
    }
    panic!("{before:?} never ended");
}

#[test]
fn an_engine_that_dies_while_it_warms_up_is_cranked_again() {
    let mut sequence = sequence(&Settings::usual());
    let (dead, fired) = (Sensed::default(), Sensed { running: true, turning: true, ..Sensed::default() });
    while sequence.operation() != Cranking {
        until_change(&mut sequence, Demand::ON_LOAD, dead);
    }
    for last in [false, false, true] {
        assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, fired), IdleSpeed);
        assert!(!sequence.failures.to_start);
        let next = until_change(&mut sequence, Demand::ON_LOAD, dead);
        assert_eq!(next, if last { Stopping } else { CrankRest });
        if !last {
            assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, dead), Cranking);
        }
    }
    assert!(sequence.failures.to_start);
}

#[test]
fn the_starter_meets_no_engine_that_turns() {
    let mut sequence = sequence(&Settings::usual());
    let (dead, rolling) = (Sensed::default(), Sensed { turning: true, ..Sensed::default() });
    // After a hard reset, or with a fuel valve that does not close.
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, rolling), Stopping);
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, dead), AtRest);
    while sequence.operation() != CrankRest {
        until_change(&mut sequence, Demand::ON_LOAD, dead);
    }
    for _ in 0..1000 {
        sequence.step(TENTH, Demand::ON_LOAD, rolling);
        assert_eq!(sequence.operation(), CrankRest, "it rolls");
    }
    let fired = Sensed { running: true, ..rolling };
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, fired), IdleSpeed, "it needs no starter");
}

#[test]
fn a_genset_that_has_left_its_limits_takes_no_load() {
    let mut sequence = sequence(&Settings::usual());
    sequence.enter(GensetBreakerTimer);
    let turning = Sensed { running: true, turning: true, mains_healthy: false, ..Sensed::default() };
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, turning), OffLoad);
    let good = Sensed { genset_healthy: true, ..turning };
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, good), GensetBreakerTimer);
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, good), GensetBreakerActivation);
}

#[test]
fn an_engine_that_stands_carries_nothing_whatever_its_protections_say() {
    let mut sequence = sequence(&Settings::usual());
    sequence.enter(OnLoad);
    let loaded = Sensed { genset_breaker: true, ..Sensed::default() };
    sequence.step(TENTH, Demand::ON_LOAD, loaded);
    assert!(!sequence.controls(Demand::ON_LOAD, loaded).genset_breaker);
    let dead = Sensed::default();
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, dead), OffLoad);
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, dead), Stopping);
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, dead), AtRest, "and is started anew");
    assert_eq!(until_change(&mut sequence, Demand::ON_LOAD, dead), WaitBeforeFuel);
}

#[test]
fn a_load_that_cannot_be_moved_whole_moves_when_the_timer_ends() {
    let mut site = Site::new(&soft());
    site.sensed.mains_unloaded = false;
    let mut site = site.pass(Demand::ON_LOAD, 30);
    assert_eq!(site.sequence.operation(), TransferToGenset);
    assert!(!site.sequence.timer().is_zero());
    site = site.pass(Demand::ON_LOAD, 60);
    assert_eq!(site.sequence.operation(), OnLoad);
    site.sensed.genset_unloaded = false;
    let site = site.pass(Demand::REST, 90);
    assert_eq!(site.seen, [&START[..], &[9, 11, 10, 13, 17, 18, 21, 22]].concat());
}

#[test]
fn the_timer_counts_down_to_the_change() {
    let mut sequence = sequence(&Settings::usual());
    sequence.step(TENTH, Demand::OFF_LOAD, Sensed::default());
    let mut left = sequence.timer();
    assert_eq!(left, Settings::usual().start_delay);
    while sequence.operation() == WaitBeforeFuel {
        assert_eq!(sequence.timer(), left);
        left = left.saturating_sub(TENTH);
        sequence.step(TENTH, Demand::OFF_LOAD, Sensed::default());
    }
    assert_eq!(left, Duration::ZERO);
}

#[test]
fn a_start_that_is_no_longer_wanted_ends_before_cranking() {
    let mut sequence = sequence(&Settings::usual());
    sequence.step(TENTH, Demand::ON_LOAD, Sensed::default());
    sequence.step(TENTH, Demand::REST, Sensed::default());
    assert_eq!(sequence.operation(), AtRest);
    assert!(!sequence.failures.to_start);
}

#[test]
fn a_load_dump_opens_cools_and_stops_and_a_shutdown_does_not_cool() {
    for (settings, dumped) in [(Settings::usual(), [20, 19].as_slice()), (soft(), &[20, 19])] {
        let mut site = Site::new(&settings).pass(Demand::ON_LOAD, 60);
        site.seen.clear();
        for _ in 0..900 {
            site.sequence.trip(Trip::LoadDump);
            site.step(Demand::REST);
        }
        assert_eq!(site.seen, [&[13][..], dumped, &STOP].concat());

        let mut site = Site::new(&settings).pass(Demand::ON_LOAD, 60);
        site.seen.clear();
        for _ in 0..300 {
            site.sequence.trip(Trip::Shutdown);
            site.step(Demand::REST);
        }
        assert_eq!(site.seen, [13, 24, 25, 0]);
    }
}

#[test]
fn a_load_dump_beside_the_mains_leaves_the_load_to_them() {
    let mut site = Site::new(&Settings::usual()).pass(Demand::EXPORTING, 60);
    site.seen.clear();
    for _ in 0..900 {
        site.sequence.trip(Trip::LoadDump);
        site.step(Demand::REST);
        assert!(site.sensed.mains_breaker);
    }
    assert_eq!(site.seen, [&[15][..], &STOP].concat());
}

#[test]
fn a_shutdown_waits_for_no_breaker() {
    let mut sequence = sequence(&Settings::usual());
    sequence.enter(OnLoad);
    let stuck = Sensed { running: true, turning: true, genset_breaker: true, ..Sensed::default() };
    sequence.trip(Trip::Shutdown);
    for _ in 0..6 {
        sequence.step(TENTH, Demand::REST, stuck);
    }
    assert_eq!(sequence.operation(), ImmediateStop);
    let controls = sequence.controls(Demand::REST, stuck);
    assert!(!controls.fuel && !controls.genset_breaker && !controls.mains_breaker);
}

#[test]
fn an_engine_that_turns_on_after_the_stop_timer_has_failed_to_stop() {
    let mut sequence = sequence(&Settings::usual());
    sequence.enter(Stopping);
    let turning = Sensed { turning: true, ..Sensed::default() };
    for _ in 1..Settings::usual().stop.as_millis() / 100 {
        sequence.step(TENTH, Demand::REST, turning);
        assert!(!sequence.failures.to_stop);
    }
    sequence.step(TENTH, Demand::REST, turning);
    assert!(sequence.failures.to_stop);
    assert_eq!(sequence.operation(), Stopping);
}

#[test]
fn the_breakers_are_never_commanded_closed_together() {
    for operation in [AtRest, OffLoad, GensetBreakerActivation, OnLoad, MainsBreakerActivation, ImmediateStop]
    {
        for (genset_breaker, mains_breaker) in [(false, false), (false, true), (true, false), (true, true)] {
            let mut sequence = sequence(&Settings::usual());
            sequence.enter(operation);
            let sensed = Sensed {
                genset_breaker,
                mains_breaker,
                genset_healthy: true,
                mains_healthy: true,
                ..Sensed::default()
            };
            for demand in [Demand::REST, Demand::OFF_LOAD, Demand::ON_LOAD] {
                let controls = sequence.controls(demand, sensed);
                assert!(!(controls.genset_breaker && controls.mains_breaker));
                assert!(!(controls.genset_breaker && mains_breaker), "{operation:?} {demand:?}");
                assert!(!(controls.mains_breaker && genset_breaker), "{operation:?} {demand:?}");
            }
        }
    }
}

/// Chance drives the sequence: demands, a plant that obeys or not, trips.
mod chance {
    use std::collections::BTreeSet;

    use crate::random::Random;

    use super::super::super::transitions::TRANSITIONS;
    use super::*;

    fn is_listed(from: Operation, to: Operation) -> bool {
        let stopped_at_once = to == ImmediateStop && !matches!(from, AtRest | Stopping);
        stopped_at_once || TRANSITIONS.iter().any(|(a, b, _)| (*a, *b) == (from, to))
    }

    fn walk(seed: u64, seen: &mut BTreeSet<(Operation, Operation)>) {
        let mut random = Random::new(seed);
        let mut chance = |part: f64| random.between(0.0, 1.0) < part;
        let usual = Settings::usual();
        let settings = Settings {
            no_break_transfer: chance(0.6),
            soft_transfer: chance(0.5),
            slave: chance(0.3),
            start_attempts: if chance(0.5) { 1 } else { 3 },
            synchronizing: Duration::from_secs(3),
            cooldown: Duration::from_secs(3),
            stop: Duration::from_secs(2),
            ..usual
        };
        let mut sequence = sequence(&settings);
        let mut sensed = Sensed { mains_healthy: true, mains_breaker: true, ..Sensed::default() };
        let mut demand = Demand::REST;
        let mut before = AtRest;
        for _ in 0..6000 {
            if chance(0.02) {
                let source = SOURCES[(0..4).filter(|_| chance(0.5)).count()];
                demand = Demand { engine: chance(0.85), source };
            }
            if chance(0.05) {
                sensed.mains_healthy = chance(0.7);
            }
            if chance(0.05) {
                (sensed.in_step, sensed.genset_healthy) = (chance(0.7), chance(0.9));
                (sensed.genset_unloaded, sensed.mains_unloaded) = (chance(0.5), chance(0.5));
            }
            if chance(0.003) {
                sequence.trip(if chance(0.7) { Trip::LoadDump } else { Trip::Shutdown });
                demand = Demand::REST;
            }
            if matches!(sequence.operation(), Cranking | CrankRest) {
                sensed.running |= chance(0.05);
            } else if !sequence.may_turn() || chance(0.004) {
                sensed.running = false;
            }
            sensed.turning = sensed.running || chance(0.01);
            sequence.step(TENTH, demand, sensed);
            let now = sequence.operation();
            if now != before {
                seen.insert((before, now));
                before = now;
            }
            let controls = sequence.controls(demand, sensed);
            closes_lawfully(now, sensed, &controls, &sequence);
            if chance(0.6) {
                sensed.genset_breaker = controls.genset_breaker && !chance(0.02);
            }
            if chance(0.6) {
                sensed.mains_breaker = controls.mains_breaker;
            }
        }
    }

    /// A breaker closes on nothing, or in step.
    fn closes_lawfully(operation: Operation, sensed: Sensed, controls: &Controls, sequence: &Sequence) {
        let closes_genset = controls.genset_breaker && !sensed.genset_breaker;
        if closes_genset && sensed.mains_breaker {
            assert!(sequence.in_parallel, "{operation:?} {sensed:?}");
        }
        let closes_mains = controls.mains_breaker && !sensed.mains_breaker;
        if closes_mains && sensed.genset_breaker {
            assert!(
                operation.carries_load() || operation == GensetBreakerActivation,
                "{operation:?} {sensed:?}"
            );
        }
        assert!(!controls.mains_breaker || sensed.mains_healthy);
        assert!(!controls.starter || controls.fuel);
    }

    #[test]
    fn the_table_of_transitions_holds_what_happens_and_nothing_else() {
        let mut seen = BTreeSet::new();
        for seed in 0..300 {
            walk(seed, &mut seen);
        }
        let unlisted: Vec<_> = seen.iter().filter(|(from, to)| !is_listed(*from, *to)).collect();
        assert!(unlisted.is_empty(), "not in the table: {unlisted:?}");
        let missing: Vec<_> = TRANSITIONS.iter().filter(|(a, b, _)| !seen.contains(&(*a, *b))).collect();
        assert!(missing.is_empty(), "never seen: {missing:?}");
        let statuses: BTreeSet<_> = seen.iter().map(|(_, to)| *to).collect();
        assert_eq!(statuses.len(), ALL.len());
    }
}
