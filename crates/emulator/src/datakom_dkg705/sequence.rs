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
    /// The two have been joined out of step, and pull at each other.
    pub(super) jolting: bool,
}

/// What went wrong on the way; each stays until it is taken back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Failures {
    pub(super) to_start: bool,
    pub(super) to_stop: bool,
    /// Until the two have come into step after all.
    pub(super) to_synchronize: bool,
    /// A contactor of ours has joined the two out of step; until a key is pressed.
    pub(super) out_of_step: bool,
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
    /// Left until the protections of an engine that has just started are live.
    holdoff: Duration,
    /// The load has moved over: the contactor that it left opens.
    released: bool,
    /// The mains contactor has not closed onto good mains when it was last told to.
    refused: bool,
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
            holdoff: Duration::ZERO,
            released: false,
            refused: false,
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

    /// One that has been joined out of step, or whose mains contactor has refused.
    #[cfg(test)]
    pub(super) fn troubled(mut self, out_of_step: bool, refused: bool) -> Self {
        (self.failures.out_of_step, self.refused) = (out_of_step, refused);
        self
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

    /// Whether the engine has been made ready for its load, and is led by the outputs.
    pub(super) fn is_regulated(&self) -> bool {
        match self.operation {
            WaitBeforeCrank | Cranking => false,
            Heating => self.timer.is_zero(),
            _ => self.fuel,
        }
    }

    /// Whether the engine has had its time to come to speed: its protections are live.
    pub(super) fn is_up_to_speed(&self) -> bool {
        match self.operation {
            WaitBeforeCrank | Cranking => false,
            _ => self.fuel && self.holdoff.is_zero(),
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
        self.refused = false;
    }

    pub(super) fn step(&mut self, dt: Duration, demand: Demand, sensed: Sensed, set: &Parameters) {
        self.elapsed += dt;
        self.timer = self.timer.saturating_sub(dt);
        self.holdoff = self.holdoff.saturating_sub(dt);
        self.failures.mains_in_parallel &= !sensed.mains_trusted;
        // Elsewhere it is the grid that has come back onto what the genset feeds.
        self.failures.out_of_step |= sensed.jolting && self.operation.is_synchronizing();
        self.failures.to_synchronize |= sensed.jolting;
        self.refused |= self.operation == MainsContactor && self.is_overdue(set) && !sensed.genset_contactor;
        self.refused &= sensed.mains_healthy && !sensed.mains_contactor;
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
            LoadOnGenset => demand.load || self.returns_without_break(sensed, set),
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
            OffLoad => kept && !self.takes_load_with_a_break(demand, sensed, set),
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
            // Some fire with the last turn of the starter.
            WaitBeforeCrank | Cranking if sensed.running => Some(Heating),
            WaitBeforeCrank | Cranking if !demand.engine => Some(Stopping),
            WaitBeforeCrank => after(Cranking),
            Cranking if self.attempts_left > 0 => after(WaitBeforeCrank),
            Cranking => after(Stopping),
            Heating if !demand.engine => Some(Cooldown),
            // Who is to take the load goes on heating until its voltage is there.
            Heating if !sensed.warm || demand.load && !sensed.genset_healthy => None,
            Heating => after(self.take_load(demand, sensed, set).unwrap_or(OffLoad)),
            OffLoad if !demand.engine => Some(Cooldown),
            OffLoad if demand.load => self.take_load(demand, sensed, set),
            OffLoad => mains_back(sensed).filter(|_| !self.refused),
            Cooldown if demand.engine => Some(self.take_load(demand, sensed, set).unwrap_or(OffLoad)),
            Cooldown => mains_back(sensed).filter(|_| !self.refused).or(after(Stopping)),
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
            // Not again before somebody has looked: the load moves with a break, or stays.
            GensetContactorSynch if self.failures.out_of_step => {
                Some(if demand.load && !demand.parallel { GensetContactor } else { unloaded(demand) })
            }
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
            GensetContactor if sensed.genset_contactor && !sensed.mains_contactor => Some(LoadOnGenset),
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
            // The genset would go on feeding a dead line.
            LoadOnGenset if sensed.mains_contactor && !sensed.mains_healthy => {
                (self.elapsed >= OPENS_WITHIN).then_some(GensetContactor)
            }
            LoadOnGenset => (!stays && self.returns_without_break(sensed, set) && !sensed.mains_contactor)
                .then_some(SynchronizeToMains),
            SynchronizeToMains if !sensed.genset_contactor => Some(MainsContactor),
            SynchronizeToMains if stays || !sensed.mains_healthy => Some(LoadOnGenset),
            SynchronizeToMains if sensed.in_step => Some(MainsContactorSynch),
            SynchronizeToMains => {
                elapsed.then_some(if demand.parallel { LoadOnGenset } else { MainsContactor })
            }
            MainsContactorSynch if self.failures.out_of_step => Some(unloaded(demand)),
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
            MainsContactor if self.refused && self.fuel => Some(unloaded(demand)),
            MainsContactor if self.refused => demand.engine.then_some(AtRest),
            MainsContactor => (self.fuel && demand.load).then_some(OffLoad),
            _ => None,
        }
    }

    /// How the running genset takes the load that it is to have.
    fn take_load(&self, demand: Demand, sensed: Sensed, set: &Parameters) -> Option<Operation> {
        match (demand.load && sensed.genset_healthy, sensed.mains_contactor) {
            (false, _) => None,
            (true, false) => Some(GensetContactor),
            (true, true) if !sensed.mains_healthy => Some(GensetContactor),
            (true, true) if self.moves_without_break(set) => Some(SynchronizeToGenset),
            // The mains contactor opens first, but not for who only wants help.
            (true, true) => None,
        }
    }

    fn takes_load_with_a_break(&self, demand: Demand, sensed: Sensed, set: &Parameters) -> bool {
        demand.load && !demand.parallel && sensed.genset_healthy && !self.moves_without_break(set)
    }

    fn returns_without_break(&self, sensed: Sensed, set: &Parameters) -> bool {
        self.moves_without_break(set) && sensed.mains_healthy
    }

    fn moves_without_break(&self, set: &Parameters) -> bool {
        set.transfer.no_break && !self.failures.out_of_step
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
            MainsContactor => self.refused = false,
            Heating => self.holdoff = set.start.idle + set.start.holdoff,
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
/// What a contactor takes to open.
const OPENS_WITHIN: Duration = Duration::from_millis(500);

/// Good mains that are not connected take the load after their timer.
fn mains_back(sensed: Sensed) -> Option<Operation> {
    (sensed.mains_healthy && !sensed.mains_contactor).then_some(MainsContactor)
}

/// What a running engine does without load.
fn unloaded(demand: Demand) -> Operation {
    if demand.engine { OffLoad } else { Cooldown }
}

#[cfg(test)]
mod tests;
