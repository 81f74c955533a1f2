//! The order in which the unit starts, loads, unloads and stops its genset: register 003Fh with timer 003Eh.
//!
//! The load goes to the genset and back without a break where the mains are there: the genset is synchronized, its
//! contactor closes, the power moves over slowly, the other contactor opens. Where the mains are dead one contactor
//! opens, a timer runs with both open, the other closes. A state that moves a contactor lasts until that has moved,
//! so that the state always says what carries the load.

use std::time::Duration;

use crate::plant::Controls;

use super::operation::Operation::{self, *};
use super::settings::Settings;

/// What the unit wants at this moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Demand {
    /// The engine runs.
    pub(super) engine: bool,
    /// The genset feeds the load, as soon as it can.
    pub(super) load: bool,
}

impl Demand {
    pub(super) const REST: Self = Self { engine: false, load: false };
    pub(super) const OFF_LOAD: Self = Self { engine: true, load: false };
    pub(super) const ON_LOAD: Self = Self { engine: true, load: true };
}

/// What the sequence sees of the plant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensed {
    pub(super) running: bool,
    pub(super) turning: bool,
    pub(super) genset_healthy: bool,
    pub(super) mains_healthy: bool,
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
    /// The mains failed while both contactors were closed.
    pub(super) mains_in_parallel: bool,
}

/// The state machine; time and the plant are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    settings: Settings,
    operation: Operation,
    /// Since the operation began.
    elapsed: Duration,
    /// Of the operation; zero where it waits for something else.
    timer: Duration,
    attempts_left: u8,
    /// From the first crank on until the engine is to stop.
    fuel: bool,
    /// The load has moved over: the contactor that it left opens.
    released: bool,
    pub(super) failures: Failures,
}

impl Sequence {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            settings,
            operation: AtRest,
            elapsed: Duration::ZERO,
            timer: Duration::ZERO,
            attempts_left: 0,
            fuel: false,
            released: false,
            failures: Failures::default(),
        }
    }

    pub(super) fn operation(&self) -> Operation {
        self.operation
    }

    /// Since the operation began.
    pub(super) fn elapsed(&self) -> Duration {
        self.elapsed
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
    pub(super) fn is_preheating(&self) -> bool {
        self.operation == WaitBeforeFuel && self.timer <= Duration::from_secs(self.settings.preheat)
    }

    /// Opens the genset contactor and closes the fuel without cooling first.
    pub(super) fn stop_now(&mut self) {
        if self.fuel {
            self.enter(Stopping);
        }
    }

    /// Opens the genset contactor at once and cools the engine down.
    pub(super) fn dump_load(&mut self) {
        let loaded = matches!(self.operation, GensetContactor | LoadOnGenset | SynchronizeToMains);
        if loaded || self.operation.is_parallel() {
            self.enter(Cooldown);
        }
    }

    /// Forgets that the engine did not start or stop; a new start is then possible.
    pub(super) fn acknowledge(&mut self) {
        self.failures.to_start = false;
        self.failures.to_stop = false;
    }

    pub(super) fn step(&mut self, dt: Duration, demand: Demand, sensed: Sensed) {
        self.elapsed += dt;
        self.timer = self.timer.saturating_sub(dt);
        self.failures.mains_in_parallel &= !sensed.mains_healthy;
        self.released |= match self.operation {
            SoftToGenset => sensed.mains_unloaded,
            SoftToMains => sensed.genset_unloaded,
            _ => false,
        };
        if let Some(next) = self.next(demand, sensed) {
            self.failures.to_start |= self.operation == Cranking && next == Stopping && demand.engine;
            self.failures.mains_in_parallel |= self.operation.is_parallel() && !sensed.mains_healthy;
            self.enter(next);
        }
        self.failures.to_stop |= self.operation == Stopping && self.timer.is_zero() && sensed.turning;
    }

    /// What the unit's outputs do in this operation.
    pub(super) fn controls(&self, demand: Demand, sensed: Sensed) -> Controls {
        let elapsed = self.timer.is_zero();
        let genset = match self.operation {
            GensetContactor => elapsed && !sensed.mains_contactor,
            LoadOnGenset => demand.load || self.returns_without_break(sensed),
            SoftToMains => !self.released,
            GensetContactorSynch | SoftToGenset | SynchronizeToMains | MainsContactorSynch => true,
            _ => false,
        };
        // Outside the operations that close it, the mains contactor stays as it is while the mains are good.
        let kept = sensed.mains_healthy && sensed.mains_contactor;
        let mains = match self.operation {
            GensetContactor | LoadOnGenset | SynchronizeToMains => false,
            MainsContactor => sensed.mains_healthy && elapsed && !sensed.genset_contactor,
            MainsContactorSynch => sensed.mains_healthy,
            SoftToGenset => kept && !self.released,
            OffLoad => kept && !self.takes_load_with_a_break(demand, sensed),
            _ => kept,
        };
        Controls {
            fuel: self.fuel,
            starter: self.is_cranking(),
            idle: self.operation == Heating && self.elapsed < Duration::from_secs(self.settings.idle),
            genset_breaker: genset,
            mains_breaker: mains,
            ..Controls::default()
        }
    }

    fn next(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        let elapsed = self.timer.is_zero();
        let after = |next: Operation| elapsed.then_some(next);
        match self.operation {
            AtRest if demand.engine => Some(WaitBeforeFuel),
            AtRest => self.mains_back(sensed),
            WaitBeforeFuel if !demand.engine => Some(self.mains_back(sensed).unwrap_or(AtRest)),
            WaitBeforeFuel => after(WaitBeforeCrank),
            Cranking if sensed.running => Some(Heating),
            WaitBeforeCrank | Cranking if !demand.engine => Some(Stopping),
            WaitBeforeCrank => after(Cranking),
            Cranking if self.attempts_left > 0 => after(WaitBeforeCrank),
            Cranking => after(Stopping),
            Heating if !demand.engine => Some(Cooldown),
            // Who is to take the load goes on heating until its voltage is there.
            Heating if demand.load && !sensed.genset_healthy => None,
            Heating => after(self.take_load(demand, sensed).unwrap_or(OffLoad)),
            OffLoad if !demand.engine => Some(Cooldown),
            OffLoad if demand.load => self.take_load(demand, sensed),
            OffLoad => self.mains_back(sensed),
            Cooldown if demand.engine => Some(self.take_load(demand, sensed).unwrap_or(OffLoad)),
            Cooldown => self.mains_back(sensed).or(after(Stopping)),
            Stopping => (elapsed && !sensed.turning).then_some(AtRest),
            SynchronizeToGenset | GensetContactorSynch | SoftToGenset | GensetContactor => {
                self.next_to_genset(demand, sensed)
            }
            LoadOnGenset | SynchronizeToMains | MainsContactorSynch | SoftToMains | MainsContactor => {
                self.next_to_mains(demand, sensed)
            }
        }
    }

    fn next_to_genset(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        let elapsed = self.timer.is_zero();
        match self.operation {
            SynchronizeToGenset if !demand.load => Some(unloaded(demand)),
            SynchronizeToGenset if !sensed.mains_healthy => Some(GensetContactor),
            SynchronizeToGenset => sensed.in_step.then_some(GensetContactorSynch),
            GensetContactorSynch if !sensed.mains_healthy => {
                Some(if sensed.genset_contactor { LoadOnGenset } else { GensetContactor })
            }
            GensetContactorSynch if !(elapsed && sensed.genset_contactor) => None,
            GensetContactorSynch if !demand.load => Some(SoftToMains),
            GensetContactorSynch => {
                Some(if self.settings.soft_transfer { SoftToGenset } else { LoadOnGenset })
            }
            SoftToGenset if !sensed.mains_contactor || !sensed.mains_healthy => Some(LoadOnGenset),
            SoftToGenset => (!demand.load && !self.released).then_some(SoftToMains),
            GensetContactor if sensed.genset_contactor => Some(LoadOnGenset),
            GensetContactor if !demand.load => Some(self.mains_back(sensed).unwrap_or(unloaded(demand))),
            _ => None,
        }
    }

    fn next_to_mains(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        let elapsed = self.timer.is_zero();
        match self.operation {
            // Tripped, or opened because the load goes back with a break.
            LoadOnGenset if !sensed.genset_contactor => {
                Some(self.mains_back(sensed).unwrap_or(unloaded(demand)))
            }
            LoadOnGenset => (!demand.load && self.returns_without_break(sensed) && !sensed.mains_contactor)
                .then_some(SynchronizeToMains),
            SynchronizeToMains if demand.load || !sensed.mains_healthy => Some(LoadOnGenset),
            SynchronizeToMains => sensed.in_step.then_some(MainsContactorSynch),
            MainsContactorSynch | SoftToMains if !sensed.mains_healthy => Some(LoadOnGenset),
            MainsContactorSynch if !(elapsed && sensed.mains_contactor) => None,
            MainsContactorSynch if demand.load => Some(SoftToGenset),
            MainsContactorSynch if self.settings.soft_transfer => Some(SoftToMains),
            MainsContactorSynch => Some(unloaded(demand)),
            SoftToMains if !sensed.genset_contactor => Some(unloaded(demand)),
            SoftToMains => (demand.load && !self.released).then_some(SoftToGenset),
            MainsContactor if sensed.mains_contactor || !sensed.mains_healthy => {
                Some(if self.fuel { unloaded(demand) } else { AtRest })
            }
            _ => None,
        }
    }

    /// How the running genset takes the load that it is to have.
    fn take_load(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match (demand.load && sensed.genset_healthy, sensed.mains_contactor) {
            (false, _) => None,
            (true, false) => Some(GensetContactor),
            (true, true) if self.settings.no_break_transfer && sensed.mains_healthy => {
                Some(SynchronizeToGenset)
            }
            // The mains contactor opens first.
            (true, true) => None,
        }
    }

    fn takes_load_with_a_break(&self, demand: Demand, sensed: Sensed) -> bool {
        demand.load && sensed.genset_healthy && !self.settings.no_break_transfer
    }

    fn returns_without_break(&self, sensed: Sensed) -> bool {
        self.settings.no_break_transfer && sensed.mains_healthy
    }

    /// Good mains that are not connected take the load after their timer.
    fn mains_back(&self, sensed: Sensed) -> Option<Operation> {
        (sensed.mains_healthy && !sensed.mains_contactor).then_some(MainsContactor)
    }

    fn enter(&mut self, next: Operation) {
        let first_wait = next == WaitBeforeCrank && self.operation == WaitBeforeFuel;
        match next {
            WaitBeforeFuel => self.attempts_left = self.settings.start_attempts,
            WaitBeforeCrank => self.fuel = true,
            Cranking => self.attempts_left = self.attempts_left.saturating_sub(1),
            AtRest | Stopping => self.fuel = false,
            _ => {}
        }
        let settings = &self.settings;
        self.timer = Duration::from_secs(match next {
            AtRest | OffLoad | LoadOnGenset | SoftToMains | SoftToGenset => 0,
            SynchronizeToGenset | SynchronizeToMains => 0,
            WaitBeforeFuel => settings.wait_before_fuel + settings.preheat,
            // The fuel solenoid opens a second before the starter turns.
            WaitBeforeCrank if first_wait => 1,
            WaitBeforeCrank => settings.wait_between_starts,
            Cranking => settings.crank,
            Heating => settings.heating,
            GensetContactorSynch | GensetContactor => settings.genset_contactor,
            MainsContactorSynch | MainsContactor => settings.mains_contactor,
            Cooldown => settings.cooldown,
            Stopping => settings.stop,
        });
        self.operation = next;
        self.elapsed = Duration::ZERO;
        self.released = false;
    }
}

/// What a running engine does without load.
fn unloaded(demand: Demand) -> Operation {
    if demand.engine { OffLoad } else { Cooldown }
}

#[cfg(test)]
mod tests {
    use super::super::settings::SITE;
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);
    const GOOD: Sensed = Sensed {
        running: true,
        turning: true,
        genset_healthy: true,
        mains_healthy: true,
        genset_contactor: false,
        mains_contactor: true,
        in_step: true,
        genset_unloaded: false,
        mains_unloaded: false,
    };
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

    /// Contactors that follow at once, and power that moves over at once.
    fn walk(settings: &Settings, demands: &[(Demand, bool)]) -> Vec<u16> {
        let mut sequence = Sequence::new(settings.clone());
        let mut sensed = GOOD;
        let mut codes = vec![0];
        for &(demand, mains_healthy) in demands {
            sensed.mains_healthy = mains_healthy;
            for _ in 0..600 {
                sensed.turning = sequence.fuel;
                sensed.running = sequence.fuel;
                (sensed.genset_unloaded, sensed.mains_unloaded) = (true, true);
                sequence.step(TENTH, demand, sensed);
                let controls = sequence.controls(demand, sensed);
                (sensed.genset_contactor, sensed.mains_contactor) =
                    (controls.genset_breaker, controls.mains_breaker);
                let code = sequence.operation().code();
                if codes.last() != Some(&code) {
                    codes.push(code);
                }
            }
        }
        assert_eq!(sequence.failures, Failures::default());
        codes
    }

    #[test]
    fn a_mains_failure_goes_out_with_a_break_and_home_without_one() {
        let codes = walk(&SITE, &[(Demand::ON_LOAD, false), (Demand::REST, true)]);
        assert_eq!(codes, [0, 1, 2, 3, 4, 7, 8, 9, 10, 14, 12, 13, 0]);
    }

    #[test]
    fn a_load_test_interrupts_nothing() {
        let codes = walk(&SITE, &[(Demand::ON_LOAD, true), (Demand::REST, true)]);
        assert_eq!(codes, [0, 1, 2, 3, 4, 5, 6, 15, 8, 9, 10, 14, 12, 13, 0]);
    }

    #[test]
    fn without_soft_transfer_the_contactors_overlap_and_without_no_break_they_do_not() {
        let demands = [(Demand::ON_LOAD, true), (Demand::REST, true)];
        let hard = Settings { soft_transfer: false, ..SITE };
        assert_eq!(walk(&hard, &demands), [0, 1, 2, 3, 4, 5, 6, 8, 9, 10, 12, 13, 0]);
        let broken = Settings { no_break_transfer: false, ..SITE };
        // Code 0 while the mains contactor opens: it still carries the load.
        assert_eq!(walk(&broken, &demands), [0, 1, 2, 3, 4, 0, 7, 8, 11, 12, 13, 0]);
    }

    #[test]
    fn a_test_runs_beside_the_load_under_code_0() {
        let codes = walk(&SITE, &[(Demand::OFF_LOAD, true), (Demand::REST, true)]);
        assert_eq!(codes, [0, 1, 2, 3, 4, 0, 12, 13, 0]);
    }

    #[test]
    fn a_short_dip_starts_nothing() {
        let mut sequence = Sequence::new(SITE);
        let dead = Sensed { mains_healthy: false, mains_contactor: false, ..Sensed::default() };
        sequence.step(TENTH, Demand::ON_LOAD, dead);
        assert_eq!(sequence.operation(), WaitBeforeFuel);
        assert!(!sequence.is_committed());
        sequence.step(TENTH, Demand::REST, Sensed { mains_healthy: true, ..dead });
        assert_eq!(sequence.operation(), MainsContactor);
    }

    #[test]
    fn three_attempts_then_fail_to_start() {
        let mut sequence = Sequence::new(SITE);
        let mut codes = Vec::new();
        for _ in 0..600 {
            sequence.step(TENTH, Demand::OFF_LOAD, Sensed::default());
            let code = sequence.operation().code();
            if codes.last() != Some(&code) {
                codes.push(code);
            }
            if sequence.failures.to_start {
                break;
            }
        }
        assert_eq!(codes, [1, 2, 3, 2, 3, 2, 3, 13]);
        assert!(!sequence.controls(Demand::OFF_LOAD, Sensed::default()).fuel);
    }

    #[test]
    fn an_engine_that_turns_on_after_the_stop_timer_has_failed_to_stop() {
        let mut sequence = Sequence::new(SITE);
        sequence.enter(Stopping);
        for _ in 0..(SITE.stop * 10) {
            assert!(!sequence.failures.to_stop);
            sequence.step(TENTH, Demand::REST, GOOD);
        }
        assert!(sequence.failures.to_stop);
        assert_eq!(sequence.operation(), Stopping);
    }

    #[test]
    fn mains_lost_in_parallel_leave_the_load_to_the_genset() {
        for operation in [GensetContactorSynch, MainsContactorSynch, SoftToMains, SoftToGenset] {
            let mut sequence = Sequence::new(SITE);
            sequence.fuel = true;
            sequence.enter(operation);
            let lost = Sensed { mains_healthy: false, genset_contactor: true, ..GOOD };
            sequence.step(TENTH, Demand::ON_LOAD, lost);
            assert_eq!(sequence.operation(), LoadOnGenset, "{operation:?}");
            assert!(sequence.failures.mains_in_parallel);
            assert!(!sequence.controls(Demand::ON_LOAD, lost).mains_breaker);
            sequence.step(TENTH, Demand::ON_LOAD, GOOD);
            assert!(!sequence.failures.mains_in_parallel);
        }
    }

    #[test]
    fn both_contactors_close_together_only_where_the_two_are_in_step() {
        for operation in ALL {
            for seed in 0..32_u8 {
                let bit = |n: u8| seed >> n & 1 == 1;
                let sensed = Sensed {
                    genset_contactor: bit(0),
                    mains_contactor: bit(1),
                    mains_healthy: bit(2),
                    ..GOOD
                };
                let mut sequence = Sequence::new(SITE);
                sequence.enter(operation);
                if bit(3) {
                    sequence.timer = Duration::ZERO;
                }
                sequence.released = bit(4);
                for demand in [Demand::REST, Demand::OFF_LOAD, Demand::ON_LOAD] {
                    let controls = sequence.controls(demand, sensed);
                    let both = controls.genset_breaker && controls.mains_breaker;
                    assert!(!both || operation.is_parallel(), "{operation:?} {sensed:?}");
                    // A contactor that closes on a source under voltage does so in step or on nothing.
                    let closes_mains = controls.mains_breaker && !sensed.mains_contactor;
                    let closes_genset = controls.genset_breaker && !sensed.genset_contactor;
                    assert!(!closes_mains || !sensed.genset_contactor || operation == MainsContactorSynch);
                    // The load is on the genset: its contactor is closed already.
                    let loaded = matches!(operation, LoadOnGenset | SynchronizeToMains);
                    let allowed = !sensed.mains_contactor || operation.is_parallel() || loaded;
                    assert!(!closes_genset || allowed, "{operation:?} {sensed:?}");
                }
            }
        }
    }
}
