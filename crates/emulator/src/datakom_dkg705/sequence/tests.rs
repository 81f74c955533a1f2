//! Scripts for the state machine: what it is asked and sees, and the codes that it goes through.

use super::super::parameters::{site, site_with};
use super::*;

const TENTH: Duration = Duration::from_millis(100);
const GOOD: Sensed = Sensed {
    running: true,
    turning: true,
    warm: true,
    genset_healthy: true,
    mains_healthy: true,
    mains_trusted: true,
    genset_contactor: false,
    mains_contactor: true,
    in_step: true,
    genset_unloaded: false,
    mains_unloaded: false,
    jolting: false,
};

/// A plant whose contactors follow at once, and whose power moves over at once.
struct Bench {
    set: Parameters,
    sequence: Sequence,
    sensed: Sensed,
    codes: Vec<u16>,
}

impl Bench {
    fn new(set: Parameters) -> Self {
        Self { set, sequence: Sequence::new(), sensed: GOOD, codes: vec![0] }
    }

    fn pass(&mut self, demand: Demand, seconds: u32) {
        for _ in 0..10 * seconds {
            self.sensed.turning = self.sequence.fuel;
            // It fires as soon as the starter turns it.
            self.sensed.running = self.sequence.fuel && self.sequence.operation != WaitBeforeCrank;
            (self.sensed.genset_unloaded, self.sensed.mains_unloaded) = (true, true);
            self.sequence.step(TENTH, demand, self.sensed, &self.set);
            let controls = self.sequence.controls(demand, self.sensed, &self.set);
            (self.sensed.genset_contactor, self.sensed.mains_contactor) =
                (controls.genset_breaker, controls.mains_breaker);
            self.codes.push(self.sequence.operation().code());
            self.codes.dedup();
        }
    }
}

fn walk(set: Parameters, demands: &[(Demand, bool)]) -> Vec<u16> {
    let mut bench = Bench::new(set);
    for &(demand, mains_healthy) in demands {
        bench.sensed.mains_healthy = mains_healthy;
        bench.pass(demand, 60);
    }
    assert_eq!(bench.sequence.failures, Failures::default());
    bench.codes
}

#[test]
fn a_mains_failure_goes_out_with_a_break_and_home_without_one() {
    let codes = walk(site(), &[(Demand::ON_LOAD, false), (Demand::REST, true)]);
    assert_eq!(codes, [0, 1, 2, 3, 4, 7, 8, 9, 10, 14, 12, 13, 0]);
}

#[test]
fn a_load_test_interrupts_nothing() {
    let codes = walk(site(), &[(Demand::ON_LOAD, true), (Demand::REST, true)]);
    assert_eq!(codes, [0, 1, 2, 3, 4, 5, 6, 15, 8, 9, 10, 14, 12, 13, 0]);
}

#[test]
fn without_soft_transfer_the_contactors_overlap_and_without_no_break_they_do_not() {
    let demands = [(Demand::ON_LOAD, true), (Demand::REST, true)];
    let hard = site_with(&[("soft_transfer", "0")]);
    assert_eq!(walk(hard, &demands), [0, 1, 2, 3, 4, 5, 6, 8, 9, 10, 12, 13, 0]);
    let broken = site_with(&[("no_break_transfer", "0")]);
    // Code 0 while the mains contactor opens: it still carries the load.
    assert_eq!(walk(broken, &demands), [0, 1, 2, 3, 4, 0, 7, 8, 11, 12, 13, 0]);
}

#[test]
fn a_test_runs_beside_the_load_under_code_0() {
    let codes = walk(site(), &[(Demand::OFF_LOAD, true), (Demand::REST, true)]);
    assert_eq!(codes, [0, 1, 2, 3, 4, 0, 12, 13, 0]);
}

#[test]
fn beside_the_mains_the_power_goes_on_moving_until_it_is_no_longer_wanted() {
    let codes = walk(site(), &[(Demand::PARALLEL, true), (Demand::REST, true)]);
    assert_eq!(codes, [0, 1, 2, 3, 4, 5, 6, 15, 14, 12, 13, 0]);
}

#[test]
fn out_of_step_the_load_moves_with_a_break_when_the_time_is_over() {
    let mut bench = Bench::new(site());
    bench.sensed.in_step = false;
    bench.pass(Demand::ON_LOAD, 60);
    assert!(bench.sequence.failures.to_synchronize);
    bench.pass(Demand::REST, 120);
    assert_eq!(bench.codes, [0, 1, 2, 3, 4, 5, 7, 8, 9, 11, 12, 13, 0]);
    bench.sequence.acknowledge();
    assert!(!bench.sequence.failures.to_synchronize);
}

#[test]
fn a_contactor_that_does_not_close_in_step_is_tried_again() {
    let (demand, set) = (Demand::ON_LOAD, site());
    let mut sequence = Sequence::new();
    sequence.fuel = true;
    sequence.enter(SynchronizeToGenset, &set);
    let mut codes = Vec::new();
    for _ in 0..100 {
        sequence.step(TENTH, demand, GOOD, &set);
        assert!(sequence.controls(demand, GOOD, &set).mains_breaker, "the mains keep the load");
        codes.push(sequence.operation().code());
        codes.dedup();
    }
    assert_eq!(codes[..4], [6, 5, 6, 5]);
    assert!(sequence.failures.to_synchronize);
}

#[test]
fn a_short_dip_starts_nothing() {
    let (mut sequence, set) = (Sequence::new(), site());
    let dead = Sensed { mains_healthy: false, mains_contactor: false, ..Sensed::default() };
    sequence.step(TENTH, Demand::ON_LOAD, dead, &set);
    assert_eq!(sequence.operation(), WaitBeforeFuel);
    assert!(!sequence.is_committed());
    sequence.step(TENTH, Demand::REST, Sensed { mains_healthy: true, ..dead }, &set);
    assert_eq!(sequence.operation(), MainsContactor);
}

#[test]
fn all_attempts_then_fail_to_start() {
    for (attempts, expected) in [
        ("1", &[1, 2, 3, 13][..]),
        ("3", &[1, 2, 3, 2, 3, 2, 3, 13]),
        ("4", &[1, 2, 3, 2, 3, 2, 3, 2, 3, 13]),
    ] {
        let (mut sequence, set) = (Sequence::new(), site_with(&[("start_attempts", attempts)]));
        let mut codes = Vec::new();
        while !sequence.failures.to_start {
            assert!(codes.len() < 20, "{codes:?}");
            sequence.step(TENTH, Demand::OFF_LOAD, Sensed::default(), &set);
            codes.push(sequence.operation().code());
            codes.dedup();
        }
        assert_eq!(codes, expected);
        assert!(!sequence.controls(Demand::OFF_LOAD, Sensed::default(), &set).fuel);
    }
}

#[test]
fn an_engine_that_turns_on_after_the_stop_timer_has_failed_to_stop() {
    let (mut sequence, set) = (Sequence::new(), site());
    sequence.enter(Stopping, &set);
    for _ in 0..set.timers.stop.as_secs() * 10 {
        assert!(!sequence.failures.to_stop);
        sequence.step(TENTH, Demand::REST, GOOD, &set);
    }
    assert!(sequence.failures.to_stop);
    assert_eq!(sequence.operation(), Stopping);
}

#[test]
fn mains_lost_in_parallel_leave_the_load_to_the_genset() {
    for operation in [GensetContactorSynch, MainsContactorSynch, SoftToMains, SoftToGenset] {
        let (mut sequence, set) = (Sequence::new(), site());
        sequence.fuel = true;
        sequence.enter(operation, &set);
        let lost = Sensed { mains_healthy: false, mains_trusted: false, genset_contactor: true, ..GOOD };
        sequence.step(TENTH, Demand::ON_LOAD, lost, &set);
        assert_eq!(sequence.operation(), LoadOnGenset, "{operation:?}");
        assert!(sequence.failures.mains_in_parallel);
        assert!(!sequence.controls(Demand::ON_LOAD, lost, &set).mains_breaker);
        sequence.acknowledge();
        assert!(sequence.failures.mains_in_parallel, "it is still so");
        sequence.step(TENTH, Demand::ON_LOAD, GOOD, &set);
        assert!(!sequence.failures.mains_in_parallel);
    }
}

#[test]
fn an_engine_that_fires_with_the_last_turn_of_the_starter_is_not_cranked_again() {
    let (mut sequence, set) = (Sequence::new(), site());
    sequence.enter(WaitBeforeFuel, &set);
    sequence.enter(WaitBeforeCrank, &set);
    sequence.enter(Cranking, &set);
    sequence.enter(WaitBeforeCrank, &set);
    sequence.step(TENTH, Demand::OFF_LOAD, GOOD, &set);
    assert_eq!(sequence.operation(), Heating);
}

#[test]
fn who_was_joined_out_of_step_is_not_joined_again_before_a_key_is_pressed() {
    for (demand, next) in
        [(Demand::ON_LOAD, GensetContactor), (Demand::PARALLEL, OffLoad), (Demand::REST, Cooldown)]
    {
        let (mut sequence, set) = (Sequence::new(), site());
        sequence.fuel = true;
        sequence.enter(GensetContactorSynch, &set);
        let jolting = Sensed { genset_contactor: true, jolting: true, ..GOOD };
        sequence.step(TENTH, demand, jolting, &set);
        assert_eq!(sequence.operation(), next, "{demand:?}");
        assert!(!sequence.controls(demand, jolting, &set).genset_breaker, "{demand:?}");
        let mut bench = Bench { sequence, ..Bench::new(set) };
        bench.pass(demand, 60);
        assert!(!bench.codes.contains(&5) && bench.sequence.failures.out_of_step, "{:?}", bench.codes);
        bench.sequence.acknowledge();
        bench.pass(Demand::REST, 60);
        bench.pass(Demand::PARALLEL, 60);
        assert!(bench.codes.contains(&5), "{demand:?}: {:?}", bench.codes);
    }
}

#[test]
fn mains_that_come_onto_a_running_genset_out_of_step_take_the_load() {
    let (mut sequence, set) = (Sequence::new(), site());
    sequence.fuel = true;
    sequence.enter(MainsContactorSynch, &set);
    let jolting = Sensed { genset_contactor: true, jolting: true, ..GOOD };
    sequence.step(TENTH, Demand::REST, jolting, &set);
    assert_eq!(sequence.operation(), Cooldown);
    let controls = sequence.controls(Demand::REST, jolting, &set);
    assert!(controls.mains_breaker && !controls.genset_breaker);
}

#[test]
fn a_mains_contactor_that_refuses_keeps_neither_the_engine_running_nor_the_load_waiting() {
    let refusing = Sensed { mains_contactor: false, ..GOOD };
    let pass = |sequence: &mut Sequence, demand, seconds: u32| {
        let mut codes = Vec::new();
        for _ in 0..10 * seconds {
            let sensed = Sensed { turning: sequence.fuel, running: sequence.fuel, ..refusing };
            sequence.step(TENTH, demand, sensed, &site());
            codes.push(sequence.operation().code());
            codes.dedup();
        }
        codes
    };
    let mut sequence = Sequence::new();
    sequence.fuel = true;
    sequence.enter(MainsContactor, &site());
    assert_eq!(pass(&mut sequence, Demand::REST, 120), [11, 12, 13, 0, 11]);
    let controls = sequence.controls(Demand::REST, refusing, &site());
    assert!(controls.mains_breaker && !controls.fuel, "it is still told to close");
    assert_eq!(pass(&mut sequence, Demand::ON_LOAD, 10)[..2], [0, 1]);
}
