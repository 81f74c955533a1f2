//! The order in which a D-series unit starts, loads, unloads and stops its genset: register 10604 with timer 10606.
//!
//! With a break one breaker opens, the timer of the other runs with both open, then that one is activated until its
//! feedback says closed. Without a break the genset is synchronized first, and both are closed for a moment, or for as
//! long as a soft transfer takes. A status that moves a breaker lasts until that has moved, so that the status always
//! says what carries the load.

use std::time::Duration;

use crate::plant::Controls;

use super::operation::Operation::{self, *};
use super::settings::Settings;

/// How long a decision to stop is shown.
const DECISION: Duration = Duration::from_secs(1);
/// An engine that is to stop at once waits no longer for its breaker than this.
const BREAKER_PATIENCE: Duration = Duration::from_millis(500);

/// What the unit wants at this moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Demand {
    /// The engine runs.
    pub(super) engine: bool,
    /// What feeds the load, as far as it can.
    pub(super) source: Source,
}

impl Demand {
    pub(super) const REST: Self = Self { engine: false, source: Source::Mains };
    pub(super) const OFF_LOAD: Self = Self { engine: true, source: Source::Mains };
    pub(super) const ON_LOAD: Self = Self { engine: true, source: Source::Genset };
    pub(super) const PEAK_LOPPING: Self = Self { engine: true, source: Source::PeakLopping };
    pub(super) const EXPORTING: Self = Self { engine: true, source: Source::Exporting };

    fn on_load(self) -> bool {
        self.engine && self.source == Source::Genset
    }

    /// Genset and mains together.
    pub(super) fn parallel(self) -> bool {
        self.engine && matches!(self.source, Source::PeakLopping | Source::Exporting)
    }
}

/// What feeds the load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Mains,
    Genset,
    /// Both, the genset whatever is above a limit of the mains.
    PeakLopping,
    /// Both, the genset a power of its own.
    Exporting,
    /// Both breakers are open.
    Nothing,
}

/// How an alarm takes the genset off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Trip {
    /// The breaker opens, the engine cools down and stops.
    LoadDump,
    /// The breaker opens and the engine stops.
    Shutdown,
}

/// What the sequence sees of the plant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensed {
    pub(super) running: bool,
    pub(super) turning: bool,
    pub(super) genset_healthy: bool,
    /// The mains are good, and their breaker obeys.
    pub(super) mains_healthy: bool,
    pub(super) genset_breaker: bool,
    pub(super) mains_breaker: bool,
    /// Genset and mains agree in frequency, voltage and angle.
    pub(super) in_step: bool,
    /// Next to nothing flows through the breaker.
    pub(super) genset_unloaded: bool,
    pub(super) mains_unloaded: bool,
}

/// What went wrong on the way; each stays until [`Sequence::acknowledge`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Failures {
    pub(super) to_start: bool,
    pub(super) to_stop: bool,
    pub(super) to_synchronize: bool,
    /// The mains were to go on feeding beside the genset, so that nothing but a stop is left.
    pub(super) to_parallel: bool,
}

/// The state machine; time and the plant are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    settings: Settings,
    operation: Operation,
    timer: Duration,
    attempts_left: u8,
    /// What a parallel status waited for has come: the breaker that the load has left opens, or the other one closes.
    ready: bool,
    /// Genset and mains have met in step, or are about to.
    in_parallel: bool,
    /// It could not be synchronized this time: the load moves with a break.
    unsynchronized: bool,
    /// The genset breaker opens because of an alarm, since then.
    tripping: Option<(Trip, Duration)>,
    pub(super) failures: Failures,
    /// Times the engine ran, since the unit was fitted.
    pub(super) runs: u32,
    /// Times the starter was engaged.
    pub(super) cranks: u32,
    /// Times the genset took the load.
    pub(super) loads: u32,
}

impl Sequence {
    pub(super) fn new(runs: u32) -> Self {
        Self {
            settings: Settings::default(),
            operation: AtRest,
            timer: Duration::ZERO,
            attempts_left: 0,
            ready: false,
            in_parallel: false,
            unsynchronized: false,
            tripping: None,
            failures: Failures::default(),
            runs,
            cranks: runs + runs / 9,
            loads: runs - runs / 4,
        }
    }

    pub(super) fn configure(&mut self, settings: &Settings) {
        self.settings = settings.clone();
    }

    pub(super) fn operation(&self) -> Operation {
        self.operation
    }

    /// Left until the status changes by itself; nothing where it waits for something else.
    pub(super) fn timer(&self) -> Duration {
        self.timer
    }

    /// Forgets what went wrong; a new start is then possible.
    pub(super) fn acknowledge(&mut self) {
        self.failures = Failures::default();
    }

    /// Takes the genset off, as an alarm does for as long as it stands.
    pub(super) fn trip(&mut self, how: Trip) {
        if self.operation.carries_load() || self.operation == GensetBreakerActivation {
            let since = self.tripping.map_or(Duration::ZERO, |(_, since)| since);
            self.tripping = Some((how, since));
        } else if how == Trip::Shutdown && self.may_turn() {
            self.enter(ImmediateStop);
        }
    }

    /// Everything that was under way is forgotten; counters and failures are not.
    pub(super) fn restart(&mut self) {
        self.enter(AtRest);
    }

    pub(super) fn step(&mut self, dt: Duration, demand: Demand, sensed: Sensed) {
        self.timer = self.timer.saturating_sub(dt);
        if let Some((_, since)) = &mut self.tripping {
            *since += dt;
        }
        // A load that cannot be moved whole is left with its rest.
        let late = self.timer.is_zero();
        self.ready |= match self.operation {
            TransferToGenset => sensed.mains_unloaded || late,
            TransferToMains => sensed.genset_unloaded || late,
            SynchronizingBack => sensed.in_step,
            _ => false,
        };
        if self.operation.is_up_to_speed() && !sensed.turning {
            // An engine that stands carries nothing, whatever its protections are set to.
            self.trip(Trip::LoadDump);
        }
        self.judge(demand, sensed);
        if let Some(next) = self.next(demand, sensed) {
            let starting = matches!(self.operation, Cranking | IdleSpeed | Heating);
            self.failures.to_start |= starting && next == Stopping && demand.engine;
            self.enter(next);
        }
    }

    /// What the unit's outputs do in this status.
    pub(super) fn controls(&self, demand: Demand, sensed: Sensed) -> Controls {
        Controls {
            fuel: !matches!(self.operation, AtRest | WaitBeforeFuel | ImmediateStop | Stopping),
            starter: self.operation == Cranking,
            idle: matches!(self.operation, IdleSpeed | IdleBeforeStop),
            genset_breaker: self.tripping.is_none() && self.genset_breaker(demand, sensed),
            mains_breaker: sensed.mains_healthy && self.mains_breaker(demand, sensed),
            ..Controls::default()
        }
    }

    fn genset_breaker(&self, demand: Demand, sensed: Sensed) -> bool {
        // Alone it never closes while the mains' feedback says closed.
        let alone = !sensed.mains_breaker;
        match self.operation {
            GensetBreakerActivation => alone || self.in_parallel,
            OnLoad | SlaveOnLoad => {
                let kept = demand.on_load() || self.goes_back_without_break(demand, sensed);
                kept && (alone || self.in_parallel)
            }
            TransferToMains => !self.ready,
            TransferToGenset | PeakLopping | Exporting | SynchronizingBack => true,
            _ => false,
        }
    }

    fn mains_breaker(&self, demand: Demand, sensed: Sensed) -> bool {
        // Beside a closed genset breaker it stays closed where the two have met in step, and never closes.
        let lawful = !sensed.genset_breaker || self.in_parallel && sensed.mains_breaker;
        match self.operation {
            OffLoad => {
                let leaves = demand.on_load() && sensed.genset_healthy && !self.without_break(sensed);
                !leaves && demand.source != Source::Nothing && lawful
            }
            GensetBreakerActivation => self.in_parallel,
            TransferToGenset => !self.ready,
            SynchronizingBack => self.ready,
            Synchronizing | PeakLopping | Exporting | TransferToMains => true,
            GensetBreakerTimer | OnLoad | SlaveOnLoad | MainsBreakerTimer => false,
            _ => demand.source != Source::Nothing && lawful,
        }
    }

    /// Notes what has gone wrong.
    fn judge(&mut self, demand: Demand, sensed: Sensed) {
        let late = self.timer.is_zero();
        self.failures.to_stop |= self.operation == Stopping && late && sensed.turning;
        if self.operation.is_synchronizing() && late && !self.ready && !sensed.in_step {
            self.unsynchronized = true;
            self.failures.to_synchronize = true;
            self.failures.to_parallel |= demand.parallel();
        }
    }

    fn next(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        if let Some((trip, since)) = self.tripping {
            let open = !sensed.genset_breaker;
            return match trip {
                Trip::Shutdown => (open || since >= BREAKER_PATIENCE).then_some(ImmediateStop),
                Trip::LoadDump => open.then(|| away(demand, sensed)),
            };
        }
        match self.operation {
            AtRest | WaitBeforeFuel | Preheat | WaitOilFlashOff | CrankRest | Cranking => {
                self.next_of_start(demand, sensed)
            }
            IdleSpeed | Heating => self.next_of_warming(demand, sensed),
            OffLoad | Synchronizing | GensetBreakerTimer | GensetBreakerActivation => {
                self.next_to_genset(demand, sensed)
            }
            _ if self.operation.carries_load() => self.next_on_load(demand, sensed),
            MainsBreakerTimer | MainsBreakerActivation => self.next_to_mains(demand, sensed),
            _ => self.next_of_stop(demand, sensed),
        }
    }

    fn next_of_start(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match self.operation {
            AtRest if sensed.turning => Some(Stopping),
            AtRest => demand.engine.then_some(WaitBeforeFuel),
            WaitBeforeFuel | Preheat | WaitOilFlashOff if !demand.engine => Some(AtRest),
            WaitBeforeFuel => self.after(Preheat),
            Preheat => self.after(WaitOilFlashOff),
            WaitOilFlashOff => self.after(Cranking),
            CrankRest | Cranking if sensed.running => Some(IdleSpeed),
            _ if !demand.engine => Some(Stopping),
            Cranking => self.after(self.next_attempt()),
            // The starter's pinion meets a flywheel that stands.
            _ => self.after(Cranking).filter(|_| !sensed.turning),
        }
    }

    fn next_of_warming(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match self.operation {
            _ if !demand.engine => Some(StopWithCooldown),
            _ if !sensed.running => Some(self.next_attempt()),
            IdleSpeed => self.after(Heating),
            _ => self.after(OffLoad),
        }
    }

    fn next_to_genset(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match self.operation {
            OffLoad if !sensed.turning => Some(Stopping),
            OffLoad if !demand.engine => Some(StopWithCooldown),
            OffLoad => self.take_load(demand, sensed),
            Synchronizing if !(demand.on_load() || demand.parallel()) || !sensed.mains_healthy => {
                Some(unloaded(demand))
            }
            Synchronizing if sensed.in_step => Some(GensetBreakerActivation),
            Synchronizing => self.after(OffLoad),
            GensetBreakerActivation if sensed.genset_breaker => Some(self.loaded(demand, sensed)),
            GensetBreakerActivation if self.in_parallel && !sensed.mains_healthy => {
                Some(if demand.on_load() { GensetBreakerTimer } else { unloaded(demand) })
            }
            GensetBreakerActivation if self.in_parallel && demand.parallel() => None,
            _ if !demand.on_load() => Some(away(demand, sensed)),
            GensetBreakerTimer if !sensed.genset_healthy => Some(OffLoad),
            GensetBreakerTimer => self.after(GensetBreakerActivation),
            _ => None,
        }
    }

    /// In the statuses in which the genset's breaker is closed.
    fn next_on_load(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        let alone = !sensed.mains_breaker || !sensed.mains_healthy;
        let returns = !demand.on_load() && !self.ready;
        match self.operation {
            TransferToMains if !sensed.genset_breaker => Some(unloaded(demand)),
            _ if !sensed.genset_breaker => Some(away(demand, sensed)),
            OnLoad | SlaveOnLoad => (!sensed.mains_breaker && self.goes_back_without_break(demand, sensed))
                .then_some(SynchronizingBack),
            SynchronizingBack => self.next_of_synchronizing_back(demand, sensed),
            // Mains that fail leave the load to the genset.
            _ if alone => Some(self.on_load()),
            TransferToGenset if returns => Some(side_by_side(demand)),
            TransferToMains if demand.on_load() && !self.ready => Some(TransferToGenset),
            TransferToMains if demand.parallel() && !self.ready => Some(side_by_side(demand)),
            PeakLopping | Exporting if demand.on_load() => Some(self.loaded(demand, sensed)),
            PeakLopping | Exporting => Some(side_by_side(demand)).filter(|next| *next != self.operation),
            _ => None,
        }
    }

    fn next_of_synchronizing_back(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match sensed.mains_breaker {
            _ if !sensed.mains_healthy => Some(self.on_load()),
            true if demand.parallel() => Some(side_by_side(demand)),
            true if demand.on_load() => Some(TransferToGenset),
            true if self.settings.soft_transfer => Some(TransferToMains),
            true => Some(unloaded(demand)),
            false if demand.on_load() => Some(self.on_load()),
            // The breaker's own time counts for the breaker.
            false if self.ready => None,
            false => self.after(self.on_load()),
        }
    }

    fn next_to_mains(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match self.operation {
            MainsBreakerActivation if sensed.mains_breaker => Some(unloaded(demand)),
            _ if demand.on_load() => Some(GensetBreakerTimer),
            _ if demand.source == Source::Nothing || !sensed.mains_healthy => Some(unloaded(demand)),
            MainsBreakerTimer => self.after(MainsBreakerActivation),
            _ => None,
        }
    }

    fn next_of_stop(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match self.operation {
            StopWithCooldown | CoolingDown | IdleBeforeStop if !sensed.running => Some(Stopping),
            StopWithCooldown | CoolingDown if demand.engine => Some(OffLoad),
            StopWithCooldown => self.after(CoolingDown),
            CoolingDown => self.after(IdleBeforeStop),
            IdleBeforeStop | ImmediateStop => self.after(Stopping),
            _ => self.after(AtRest).filter(|_| !sensed.turning),
        }
    }

    fn after(&self, next: Operation) -> Option<Operation> {
        self.timer.is_zero().then_some(next)
    }

    fn next_attempt(&self) -> Operation {
        if self.attempts_left > 0 { CrankRest } else { Stopping }
    }

    /// How a genset that runs off load takes what it is to take.
    fn take_load(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        match sensed.mains_breaker {
            _ if !sensed.genset_healthy => None,
            true if demand.parallel() && sensed.mains_healthy && !self.unsynchronized => Some(Synchronizing),
            true if demand.on_load() && self.without_break(sensed) => Some(Synchronizing),
            // Otherwise the mains breaker opens first.
            false if demand.on_load() => Some(GensetBreakerTimer),
            _ => None,
        }
    }

    /// What a genset does whose breaker has just closed, or that is to take all from the mains beside it.
    fn loaded(&self, demand: Demand, sensed: Sensed) -> Operation {
        match sensed.mains_breaker {
            true if demand.parallel() => side_by_side(demand),
            true if self.settings.soft_transfer && sensed.mains_healthy => TransferToGenset,
            _ => self.on_load(),
        }
    }

    fn on_load(&self) -> Operation {
        if self.settings.slave { SlaveOnLoad } else { OnLoad }
    }

    /// The load moves without a break: it is set so, the mains are there, and it has not failed this time.
    fn without_break(&self, sensed: Sensed) -> bool {
        self.settings.no_break_transfer && sensed.mains_healthy && !self.unsynchronized
    }

    fn goes_back_without_break(&self, demand: Demand, sensed: Sensed) -> bool {
        let home = demand.source == Source::Mains && self.without_break(sensed);
        home || demand.parallel() && sensed.mains_healthy && !self.unsynchronized
    }

    /// The engine turns, or has been cranked.
    fn may_turn(&self) -> bool {
        !matches!(
            self.operation,
            AtRest | WaitBeforeFuel | Preheat | WaitOilFlashOff | ImmediateStop | Stopping
        )
    }

    fn enter(&mut self, next: Operation) {
        let before = self.operation;
        match next {
            WaitBeforeFuel => self.attempts_left = self.settings.start_attempts,
            Cranking => {
                self.attempts_left = self.attempts_left.saturating_sub(1);
                self.cranks += 1;
            }
            IdleSpeed => self.runs += 1,
            AtRest => self.unsynchronized = false,
            _ if before == GensetBreakerActivation && next.carries_load() => self.loads += 1,
            _ => {}
        }
        self.in_parallel = match next {
            GensetBreakerActivation => before == Synchronizing,
            OnLoad | SlaveOnLoad | OffLoad | StopWithCooldown | ImmediateStop => self.in_parallel,
            _ => next.carries_load(),
        };
        self.operation = next;
        self.tripping = None;
        self.ready = false;
        let settings = &self.settings;
        self.timer = match next {
            WaitBeforeFuel => settings.start_delay,
            Preheat => settings.preheat,
            WaitOilFlashOff => settings.oil_flash_off,
            CrankRest => settings.crank_rest,
            Cranking => settings.crank,
            IdleSpeed => settings.idle,
            Heating => settings.heating,
            Synchronizing | SynchronizingBack => settings.synchronizing,
            TransferToGenset | TransferToMains => settings.load_transfer,
            GensetBreakerActivation | MainsBreakerActivation => settings.breaker_fail,
            GensetBreakerTimer => settings.genset_breaker,
            MainsBreakerTimer => settings.mains_breaker,
            StopWithCooldown | ImmediateStop => DECISION,
            CoolingDown => settings.cooldown,
            IdleBeforeStop => settings.stop_idle,
            Stopping => settings.stop,
            _ => Duration::ZERO,
        };
    }
}

/// What a running engine does without load.
fn unloaded(demand: Demand) -> Operation {
    if demand.engine { OffLoad } else { StopWithCooldown }
}

/// Where a genset goes whose breaker is open: the mains take over after their timer, if they can and are to.
fn away(demand: Demand, sensed: Sensed) -> Operation {
    match sensed.mains_breaker || !sensed.mains_healthy || demand.source == Source::Nothing {
        true => unloaded(demand),
        false => MainsBreakerTimer,
    }
}

/// What a genset beside the mains is for; where it is for nothing its load goes back.
fn side_by_side(demand: Demand) -> Operation {
    match demand.source {
        Source::PeakLopping if demand.engine => PeakLopping,
        Source::Exporting if demand.engine => Exporting,
        _ => TransferToMains,
    }
}

#[cfg(test)]
mod tests;
