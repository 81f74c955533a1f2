//! The order in which the unit starts, loads, unloads and stops its genset: register 003Fh with timer 003Eh.
//!
//! The load goes to the genset and back without a break where the mains are there: the genset is synchronized, its
//! contactor closes, the power moves over slowly, the other contactor opens. Where the mains are dead, or the two do
//! not come into step in time, one contactor opens, a timer runs with both open, the other closes. A state that moves
//! a contactor lasts until that has moved, so that the state always says what carries the load; one that should have
//! closed in step and has not is let go, and the genset is synchronized anew.

use std::time::Duration;

use crate::plant::Controls;

use super::operation::Operation::{self, *};
use super::parameters::Parameters;

/// What the unit wants at this moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Demand {
    /// The engine runs.
    pub(super) engine: bool,
    /// The genset feeds the load, as soon as it can.
    pub(super) load: bool,
    /// It does so beside the mains, which keep their part.
    pub(super) parallel: bool,
}

impl Demand {
    pub(super) const REST: Self = Self { engine: false, load: false, parallel: false };
    pub(super) const OFF_LOAD: Self = Self { engine: true, load: false, parallel: false };
    pub(super) const ON_LOAD: Self = Self { engine: true, load: true, parallel: false };
    pub(super) const PARALLEL: Self = Self { engine: true, load: true, parallel: true };
}

/// What the sequence sees of the plant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensed {
    pub(super) running: bool,
    pub(super) turning: bool,
    /// As warm as it is to be before it takes load.
    pub(super) warm: bool,
    pub(super) genset_healthy: bool,
    pub(super) mains_healthy: bool,
    /// Healthy for long enough to be given the load.
    pub(super) mains_trusted: bool,
    pub(super) genset_contactor: bool,
    pub(super) mains_contactor: bool,
    /// Genset and mains agree in frequency, voltage and angle.
    pub(super) in_step: bool,
    /// Next to nothing flows through the contactor.
    pub(super) genset_unloaded: bool,
    pub(super) mains_unloaded: bool,
}

/// What went wrong on the way; each stays until it is taken back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Failures {
    pub(super) to_start: bool,
    pub(super) to_stop: bool,
    /// Until the two have come into step after all.
    pub(super) to_synchronize: bool,
    /// The mains failed while both contactors were closed; until they are trusted again.
    pub(super) mains_in_parallel: bool,
}

/// The state machine; time, parameters and the plant are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    operation: Operation,
    /// Since the operation began.
    elapsed: Duration,
    /// Left of the operation; zero where it waits for something else.
    timer: Duration,
    /// Of the operation as a whole.
    length: Duration,
    attempts_left: u8,
    /// From the first crank on until the engine is to stop.
    fuel: bool,
    /// The load has moved over: the contactor that it left opens.
    released: bool,
    pub(super) failures: Failures,
}

impl Sequence {
    pub(super) fn new() -> Self {
        Self {
            operation: AtRest,
            elapsed: Duration::ZERO,
            timer: Duration::ZERO,
            length: Duration::ZERO,
            attempts_left: 0,
            fuel: false,
            released: false,
            failures: Failures::default(),
        }
    }

    /// One that is in the middle of an operation.
    #[cfg(test)]
    pub(super) fn amid(operation: Operation, fuel: bool, elapsed: Duration) -> Self {
        Self { operation, fuel, elapsed, ..Self::new() }
    }

    /// What happens next in one that has some attempts left, and time left on its timer.
    #[cfg(test)]
    pub(super) fn with(self, attempts_left: u8, timer: Duration, released: bool) -> Self {
        Self { attempts_left, timer, released, ..self }
    }

    pub(super) fn operation(&self) -> Operation {
        self.operation
    }

    /// Left until the operation changes by itself.
    pub(super) fn timer(&self) -> Duration {
        self.timer
    }

    /// Whether a start has gone so far that it is finished even if its cause is gone.
    pub(super) fn is_committed(&self) -> bool {
        self.fuel
    }

    /// Whether the starter turns the engine.
    pub(super) fn is_cranking(&self) -> bool {
        self.operation == Cranking
    }

    /// Whether the engine has been brought to speed: it can take the load, and its protections are live.
    pub(super) fn is_up_to_speed(&self) -> bool {
        match self.operation {
            WaitBeforeCrank | Cranking => false,
            Heating => self.timer.is_zero(),
            _ => self.fuel,
        }
    }

    /// Whether the glow plugs are on: the end of the wait before fuel is theirs.
    pub(super) fn is_preheating(&self, set: &Parameters) -> bool {
        self.operation == WaitBeforeFuel && self.timer <= set.start.preheat
    }

    /// Opens the genset contactor and closes the fuel without cooling first.
    pub(super) fn stop_now(&mut self, set: &Parameters) {
        if self.fuel {
            self.enter(Stopping, set);
        }
    }

    /// Opens the genset contactor at once and cools the engine down.
    pub(super) fn dump_load(&mut self, set: &Parameters) {
        if self.operation.is_loaded() {
            self.enter(Cooldown, set);
        }
    }

    /// Forgets what went wrong; a new start is then possible.
    pub(super) fn acknowledge(&mut self) {
        self.failures =
            Failures { mains_in_parallel: self.failures.mains_in_parallel, ..Failures::default() };
    }

    pub(super) fn step(&mut self, dt: Duration, demand: Demand, sensed: Sensed, set: &Parameters) {
        self.elapsed += dt;
        self.timer = self.timer.saturating_sub(dt);
        self.failures.mains_in_parallel &= !sensed.mains_trusted;
        self.released |= match self.operation {
            SoftToGenset => sensed.mains_unloaded && demand.load && !demand.parallel,
            SoftToMains => sensed.genset_unloaded,
            _ => false,
        };
        if let Some(next) = self.next(demand, sensed, set) {
            self.judge(next, demand, sensed);
            self.enter(next, set);
        }
        self.failures.to_stop |= self.operation == Stopping && self.timer.is_zero() && sensed.turning;
    }

    /// What the way from the operation to the next says about the plant.
    fn judge(&mut self, next: Operation, demand: Demand, sensed: Sensed) {
        let failures = &mut self.failures;
        failures.to_start |= self.operation == Cranking && next == Stopping && demand.engine;
        failures.mains_in_parallel |= self.operation.is_parallel() && !sensed.mains_healthy;
        failures.to_synchronize = match (self.operation, next) {
            (SynchronizeToGenset, OffLoad) => failures.to_synchronize || demand.parallel,
            (SynchronizeToGenset, GensetContactor) => failures.to_synchronize || sensed.mains_healthy,
            (SynchronizeToMains, MainsContactor) => failures.to_synchronize || sensed.genset_contactor,
            (SynchronizeToMains, LoadOnGenset) => {
                failures.to_synchronize || demand.parallel && sensed.mains_healthy
            }
            (GensetContactorSynch, SynchronizeToGenset) | (MainsContactorSynch, SynchronizeToMains) => true,
            (GensetContactorSynch, _) if sensed.genset_contactor => false,
            (MainsContactorSynch, _) if sensed.mains_contactor => false,
            _ => failures.to_synchronize,
        };
    }

    /// What the unit's outputs do in this operation.
    pub(super) fn controls(&self, demand: Demand, sensed: Sensed, set: &Parameters) -> Controls {
        let elapsed = self.timer.is_zero();
        let genset = match self.operation {
            GensetContactor => elapsed && !sensed.mains_contactor && sensed.genset_healthy,
            GensetContactorSynch => sensed.in_step || sensed.genset_contactor,
            LoadOnGenset => demand.load || returns_without_break(sensed, set),
            SoftToMains => !self.released,
            SoftToGenset | SynchronizeToMains | MainsContactorSynch => true,
            _ => false,
        };
        // Outside the operations that close it, the mains contactor stays as it is while the mains are good.
        let kept = sensed.mains_healthy && sensed.mains_contactor;
        let mains = match self.operation {
            GensetContactor | LoadOnGenset | SynchronizeToMains => false,
            MainsContactor => sensed.mains_healthy && elapsed && !sensed.genset_contactor,
            MainsContactorSynch => sensed.mains_healthy && (sensed.in_step || sensed.mains_contactor),
            SoftToGenset => kept && !self.released,
            OffLoad => kept && !takes_load_with_a_break(demand, sensed, set),
            _ => kept,
        };
        Controls {
            fuel: self.fuel,
            starter: self.is_cranking(),
            idle: self.operation == Heating && self.elapsed < set.start.idle,
            genset_breaker: genset,
            mains_breaker: mains,
            ..Controls::default()
        }
    }

    pub(super) fn next(&self, demand: Demand, sensed: Sensed, set: &Parameters) -> Option<Operation> {
        let elapsed = self.timer.is_zero();
        let after = |next: Operation| elapsed.then_some(next);
        match self.operation {
            AtRest if demand.engine => Some(WaitBeforeFuel),
            AtRest => mains_back(sensed),
            WaitBeforeFuel if !demand.engine => Some(mains_back(sensed).unwrap_or(AtRest)),
            WaitBeforeFuel => after(WaitBeforeCrank),
            Cranking if sensed.running => Some(Heating),
            WaitBeforeCrank | Cranking if !demand.engine => Some(Stopping),
            WaitBeforeCrank => after(Cranking),
            Cranking if self.attempts_left > 0 => after(WaitBeforeCrank),
            Cranking => after(Stopping),
            Heating if !demand.engine => Some(Cooldown),
            // Who is to take the load goes on heating until its voltage is there.
            Heating if !sensed.warm || demand.load && !sensed.genset_healthy => None,
            Heating => after(take_load(demand, sensed, set).unwrap_or(OffLoad)),
            OffLoad if !demand.engine => Some(Cooldown),
            OffLoad if demand.load => take_load(demand, sensed, set),
            OffLoad => mains_back(sensed),
            Cooldown if demand.engine => Some(take_load(demand, sensed, set).unwrap_or(OffLoad)),
            Cooldown => mains_back(sensed).or(after(Stopping)),
            Stopping => (elapsed && !sensed.turning).then_some(AtRest),
            SynchronizeToGenset | GensetContactorSynch | SoftToGenset | GensetContactor => {
                self.next_to_genset(demand, sensed, set)
            }
            LoadOnGenset | SynchronizeToMains | MainsContactorSynch | SoftToMains | MainsContactor => {
                self.next_to_mains(demand, sensed, set)
            }
        }
    }

    fn next_to_genset(&self, demand: Demand, sensed: Sensed, set: &Parameters) -> Option<Operation> {
        let elapsed = self.timer.is_zero();
        match self.operation {
            SynchronizeToGenset if !demand.load => Some(unloaded(demand)),
            SynchronizeToGenset if !sensed.mains_healthy => Some(GensetContactor),
            SynchronizeToGenset if sensed.in_step => Some(GensetContactorSynch),
            // Mains that only want help keep the load; elsewhere it moves with a break.
            SynchronizeToGenset => elapsed.then_some(if demand.parallel { OffLoad } else { GensetContactor }),
            GensetContactorSynch if !sensed.mains_healthy => {
                Some(if sensed.genset_contactor { LoadOnGenset } else { GensetContactor })
            }
            GensetContactorSynch if !sensed.genset_contactor => {
                self.is_overdue(set).then_some(SynchronizeToGenset)
            }
            GensetContactorSynch if !elapsed => None,
            GensetContactorSynch if !demand.load => Some(SoftToMains),
            GensetContactorSynch if set.transfer.soft || demand.parallel => Some(SoftToGenset),
            GensetContactorSynch => Some(LoadOnGenset),
            SoftToGenset if !sensed.mains_contactor || !sensed.mains_healthy => Some(LoadOnGenset),
            SoftToGenset if !sensed.genset_contactor => Some(unloaded(demand)),
            SoftToGenset => (!demand.load && !self.released).then_some(SoftToMains),
            GensetContactor if sensed.genset_contactor => Some(LoadOnGenset),
            GensetContactor if !demand.load => Some(mains_back(sensed).unwrap_or(unloaded(demand))),
            _ => None,
        }
    }

    fn next_to_mains(&self, demand: Demand, sensed: Sensed, set: &Parameters) -> Option<Operation> {
        let elapsed = self.timer.is_zero();
        let stays = demand.load && !demand.parallel;
        match self.operation {
            // Tripped, or opened because the load goes back with a break.
            LoadOnGenset if !sensed.genset_contactor => Some(mains_back(sensed).unwrap_or(unloaded(demand))),
            LoadOnGenset => (!stays && returns_without_break(sensed, set) && !sensed.mains_contactor)
                .then_some(SynchronizeToMains),
            SynchronizeToMains if !sensed.genset_contactor => Some(MainsContactor),
            SynchronizeToMains if stays || !sensed.mains_healthy => Some(LoadOnGenset),
            SynchronizeToMains if sensed.in_step => Some(MainsContactorSynch),
            SynchronizeToMains => {
                elapsed.then_some(if demand.parallel { LoadOnGenset } else { MainsContactor })
            }
            MainsContactorSynch | SoftToMains if !sensed.mains_healthy => Some(LoadOnGenset),
            MainsContactorSynch if !sensed.mains_contactor => {
                self.is_overdue(set).then_some(SynchronizeToMains)
            }
            MainsContactorSynch if !elapsed => None,
            MainsContactorSynch if demand.load => {
                Some(if set.transfer.soft || demand.parallel { SoftToGenset } else { LoadOnGenset })
            }
            MainsContactorSynch if set.transfer.soft => Some(SoftToMains),
            MainsContactorSynch => Some(unloaded(demand)),
            SoftToMains if !sensed.genset_contactor => Some(unloaded(demand)),
            SoftToMains => (demand.load && !self.released).then_some(SoftToGenset),
            MainsContactor if sensed.mains_contactor || !sensed.mains_healthy => {
                Some(if self.fuel { unloaded(demand) } else { AtRest })
            }
            MainsContactor => (self.fuel && demand.load).then_some(OffLoad),
            _ => None,
        }
    }

    /// The contactor that was to move has had its timer, and the time that it may take.
    fn is_overdue(&self, set: &Parameters) -> bool {
        self.elapsed >= self.length + set.timers.contactor_wait
    }

    pub(super) fn enter(&mut self, next: Operation, set: &Parameters) {
        let first_wait = next == WaitBeforeCrank && self.operation == WaitBeforeFuel;
        match next {
            WaitBeforeFuel => self.attempts_left = set.start.attempts,
            WaitBeforeCrank => self.fuel = true,
            Cranking => self.attempts_left = self.attempts_left.saturating_sub(1),
            AtRest | Stopping => self.fuel = false,
            _ => {}
        }
        let start = &set.start;
        self.length = match next {
            AtRest | OffLoad | LoadOnGenset | SoftToMains | SoftToGenset => Duration::ZERO,
            SynchronizeToGenset | SynchronizeToMains => set.transfer.timeout,
            WaitBeforeFuel => start.wait_before_fuel + start.preheat,
            WaitBeforeCrank if first_wait => FUEL_FIRST,
            WaitBeforeCrank => start.wait_between_starts,
            Cranking => start.crank,
            Heating => start.heating.max(start.idle),
            GensetContactorSynch | GensetContactor => set.timers.genset_contactor,
            MainsContactorSynch | MainsContactor => set.timers.mains_contactor,
            Cooldown => set.timers.cooldown,
            Stopping => set.timers.stop,
        };
        self.timer = self.length;
        self.operation = next;
        self.elapsed = Duration::ZERO;
        self.released = false;
    }
}

/// The fuel solenoid opens this much before the starter turns.
const FUEL_FIRST: Duration = Duration::from_secs(1);

/// How the running genset takes the load that it is to have.
fn take_load(demand: Demand, sensed: Sensed, set: &Parameters) -> Option<Operation> {
    match (demand.load && sensed.genset_healthy, sensed.mains_contactor) {
        (false, _) => None,
        (true, false) => Some(GensetContactor),
        (true, true) if !sensed.mains_healthy => Some(GensetContactor),
        (true, true) if set.transfer.no_break => Some(SynchronizeToGenset),
        // The mains contactor opens first.
        (true, true) => None,
    }
}

fn takes_load_with_a_break(demand: Demand, sensed: Sensed, set: &Parameters) -> bool {
    demand.load && sensed.genset_healthy && !set.transfer.no_break
}

fn returns_without_break(sensed: Sensed, set: &Parameters) -> bool {
    set.transfer.no_break && sensed.mains_healthy
}

/// Good mains that are not connected take the load after their timer.
fn mains_back(sensed: Sensed) -> Option<Operation> {
    (sensed.mains_healthy && !sensed.mains_contactor).then_some(MainsContactor)
}

/// What a running engine does without load.
fn unloaded(demand: Demand) -> Operation {
    if demand.engine { OffLoad } else { Cooldown }
}

#[cfg(test)]
mod tests {
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
                self.sensed.running = self.sequence.fuel;
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
}
