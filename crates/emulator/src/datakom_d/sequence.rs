//! The order in which a D-series unit starts, loads, unloads and stops its genset: register 10604 with timer 10606.
//!
//! The load changes sides by an open transition: one breaker opens, the timer of the other runs with both open, then
//! that one is activated until its feedback says closed. Off load (8) and on load (13) last until their breaker has
//! moved, so that the status always says what carries the load.

use std::time::Duration;

use crate::plant::{Controls, Plant};

/// Operation statuses this imitation goes through, with their codes in register 10604. The manual's others need
/// a second source on the busbar: synchronizing (9, 17), load transfer (10, 18), peak lopping (14), exporting (15),
/// slave on load (16).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Operation {
    AtRest = 0,
    WaitBeforeFuel = 1,
    Preheat = 2,
    WaitOilFlashOff = 3,
    CrankRest = 4,
    Cranking = 5,
    IdleSpeed = 6,
    Heating = 7,
    OffLoad = 8,
    GensetBreakerActivation = 11,
    GensetBreakerTimer = 12,
    OnLoad = 13,
    MainsBreakerActivation = 19,
    MainsBreakerTimer = 20,
    StopWithCooldown = 21,
    CoolingDown = 22,
    IdleBeforeStop = 23,
    ImmediateStop = 24,
    Stopping = 25,
}

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
    pub(super) const ON_LOAD: Self = Self { engine: true, source: Source::Genset };

    fn on_load(self) -> bool {
        self.engine && self.source == Source::Genset
    }
}

/// What feeds the load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Mains,
    Genset,
    /// Both breakers are open.
    Nothing,
}

/// Seconds of the unit's timers. The cool-down is shorter than a real site's, so that it can be watched.
#[derive(Clone, Debug)]
struct Timers {
    wait_before_fuel: u64,
    preheat: u64,
    oil_flash_off: u64,
    crank: u64,
    crank_rest: u64,
    idle_speed: u64,
    heating: u64,
    breaker: u64,
    stop_decision: u64,
    cooldown: u64,
    idle_before_stop: u64,
    stop: u64,
    attempts: u8,
}

const TIMERS: Timers = Timers {
    wait_before_fuel: 3,
    preheat: 3,
    oil_flash_off: 2,
    crank: 6,
    crank_rest: 8,
    idle_speed: 4,
    heating: 5,
    breaker: 2,
    stop_decision: 1,
    cooldown: 30,
    idle_before_stop: 4,
    stop: 15,
    attempts: 3,
};

/// What the sequence sees of the plant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensed {
    pub(super) running: bool,
    pub(super) turning: bool,
    pub(super) genset_healthy: bool,
    pub(super) genset_breaker: bool,
    pub(super) mains_breaker: bool,
}

impl From<&Plant> for Sensed {
    fn from(plant: &Plant) -> Self {
        Self {
            running: plant.engine.is_running(),
            turning: plant.engine.speed > 0.0,
            genset_healthy: plant.genset_healthy(),
            genset_breaker: plant.genset_breaker.closed,
            mains_breaker: plant.mains_breaker.closed,
        }
    }
}

/// The state machine; time and the plant are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    operation: Operation,
    timer: Duration,
    attempts_left: u8,
    /// Latched until [`Sequence::acknowledge`].
    failed_to_start: bool,
    /// The genset breaker opens for an immediate stop.
    tripping: bool,
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
            operation: Operation::AtRest,
            timer: Duration::ZERO,
            attempts_left: 0,
            failed_to_start: false,
            tripping: false,
            runs,
            cranks: runs + runs / 9,
            loads: runs - runs / 4,
        }
    }

    pub(super) fn operation(&self) -> Operation {
        self.operation
    }

    /// Whole seconds until the status changes by itself; 0 where it waits for something else.
    pub(super) fn seconds_left(&self) -> u64 {
        self.timer.as_millis().div_ceil(1000) as u64
    }

    /// Whether the engine has been brought to speed: it can take the load, and its protections are live.
    pub(super) fn is_up_to_speed(&self) -> bool {
        (Operation::OffLoad as u8..=Operation::CoolingDown as u8).contains(&(self.operation as u8))
    }

    pub(super) fn failed_to_start(&self) -> bool {
        self.failed_to_start
    }

    /// Forgets the latched failure; a new start is then possible.
    pub(super) fn acknowledge(&mut self) {
        self.failed_to_start = false;
    }

    /// Opens the genset breaker and closes the fuel without cooling first.
    pub(super) fn stop_now(&mut self) {
        match self.operation {
            Operation::AtRest | Operation::ImmediateStop | Operation::Stopping => {}
            Operation::OnLoad => self.tripping = true,
            _ => self.enter(Operation::ImmediateStop),
        }
    }

    /// Everything that was under way is forgotten; counters and a latched failure are not.
    pub(super) fn restart(&mut self) {
        self.enter(Operation::AtRest);
    }

    pub(super) fn step(&mut self, dt: Duration, demand: Demand, sensed: Sensed) {
        self.timer = self.timer.saturating_sub(dt);
        if let Some(next) = self.next(demand, sensed) {
            self.failed_to_start |=
                self.operation == Operation::Cranking && next == Operation::Stopping && demand.engine;
            self.enter(next);
        }
    }

    /// What the unit's outputs do in this status.
    pub(super) fn controls(&self, demand: Demand, sensed: Sensed) -> Controls {
        use Operation::*;
        let to_genset = match self.operation {
            GensetBreakerActivation => true,
            OnLoad => demand.on_load() && !self.tripping,
            _ => false,
        };
        let to_mains = match self.operation {
            OffLoad => !takes_load(demand, sensed),
            GensetBreakerTimer | GensetBreakerActivation | OnLoad | MainsBreakerTimer => false,
            _ => true,
        };
        Controls {
            fuel: !matches!(self.operation, AtRest | WaitBeforeFuel | ImmediateStop | Stopping),
            starter: self.operation == Cranking,
            idle: matches!(self.operation, IdleSpeed | IdleBeforeStop),
            // The breakers interlock: neither closes while the other's feedback says closed.
            genset_breaker: to_genset && !sensed.mains_breaker,
            mains_breaker: to_mains && demand.source != Source::Nothing && !sensed.genset_breaker,
            ..Controls::default()
        }
    }

    fn next(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        use Operation::*;
        let wanted = demand.engine;
        let elapsed = self.timer.is_zero();
        let after = |next: Operation| elapsed.then_some(next);
        match self.operation {
            AtRest => (wanted && !self.failed_to_start).then_some(WaitBeforeFuel),
            WaitBeforeFuel | Preheat | WaitOilFlashOff if !wanted => Some(AtRest),
            WaitBeforeFuel => after(Preheat),
            Preheat => after(WaitOilFlashOff),
            WaitOilFlashOff => after(Cranking),
            Cranking if sensed.running => Some(IdleSpeed),
            Cranking | CrankRest if !wanted => Some(Stopping),
            Cranking if self.attempts_left > 0 => after(CrankRest),
            Cranking => after(Stopping),
            CrankRest => after(Cranking),
            IdleSpeed | Heating | OffLoad if !wanted => Some(StopWithCooldown),
            IdleSpeed => after(Heating),
            Heating => after(OffLoad),
            StopWithCooldown | CoolingDown if wanted => Some(OffLoad),
            StopWithCooldown => after(CoolingDown),
            CoolingDown => after(IdleBeforeStop),
            IdleBeforeStop => after(Stopping),
            ImmediateStop => after(Stopping),
            Stopping => (elapsed && !sensed.turning).then_some(AtRest),
            OffLoad
            | GensetBreakerTimer
            | GensetBreakerActivation
            | OnLoad
            | MainsBreakerTimer
            | MainsBreakerActivation => self.next_of_transfer(demand, sensed),
        }
    }

    fn next_of_transfer(&self, demand: Demand, sensed: Sensed) -> Option<Operation> {
        use Operation::*;
        let elapsed = self.timer.is_zero();
        let unloaded = if demand.engine { OffLoad } else { StopWithCooldown };
        let away_from_genset = if demand.source == Source::Nothing { unloaded } else { MainsBreakerTimer };
        match self.operation {
            OffLoad => (takes_load(demand, sensed) && !sensed.mains_breaker).then_some(GensetBreakerTimer),
            GensetBreakerActivation if sensed.genset_breaker => Some(OnLoad),
            GensetBreakerTimer | GensetBreakerActivation if !demand.on_load() => Some(away_from_genset),
            GensetBreakerTimer => elapsed.then_some(GensetBreakerActivation),
            OnLoad if sensed.genset_breaker => None,
            OnLoad if self.tripping => Some(ImmediateStop),
            OnLoad => Some(away_from_genset),
            MainsBreakerActivation if sensed.mains_breaker => Some(unloaded),
            MainsBreakerTimer | MainsBreakerActivation if demand.on_load() => Some(GensetBreakerTimer),
            MainsBreakerTimer | MainsBreakerActivation if demand.source == Source::Nothing => Some(unloaded),
            MainsBreakerTimer => elapsed.then_some(MainsBreakerActivation),
            _ => None,
        }
    }

    fn enter(&mut self, next: Operation) {
        use Operation::*;
        match next {
            WaitBeforeFuel => self.attempts_left = TIMERS.attempts,
            Cranking => {
                self.attempts_left = self.attempts_left.saturating_sub(1);
                self.cranks += 1;
            }
            IdleSpeed => self.runs += 1,
            OnLoad => self.loads += 1,
            _ => {}
        }
        self.operation = next;
        self.tripping = false;
        self.timer = Duration::from_secs(match next {
            AtRest | OffLoad | OnLoad | GensetBreakerActivation | MainsBreakerActivation => 0,
            WaitBeforeFuel => TIMERS.wait_before_fuel,
            Preheat => TIMERS.preheat,
            WaitOilFlashOff => TIMERS.oil_flash_off,
            CrankRest => TIMERS.crank_rest,
            Cranking => TIMERS.crank,
            IdleSpeed => TIMERS.idle_speed,
            Heating => TIMERS.heating,
            GensetBreakerTimer | MainsBreakerTimer => TIMERS.breaker,
            StopWithCooldown | ImmediateStop => TIMERS.stop_decision,
            CoolingDown => TIMERS.cooldown,
            IdleBeforeStop => TIMERS.idle_before_stop,
            Stopping => TIMERS.stop,
        });
    }
}

/// Whether a genset that runs off load is to take the load, and can.
fn takes_load(demand: Demand, sensed: Sensed) -> bool {
    demand.on_load() && sensed.genset_healthy
}

#[cfg(test)]
mod tests {
    use super::*;

    const OFF_LOAD: Demand = Demand { engine: true, source: Source::Mains };

    const TENTH: Duration = Duration::from_millis(100);

    /// Steps until the status changes; the new one and the seconds it took.
    fn until_change(sequence: &mut Sequence, demand: Demand, sensed: Sensed) -> (Operation, f64) {
        let before = sequence.operation();
        for tenth in 1..1000 {
            sequence.step(TENTH, demand, sensed);
            if sequence.operation() != before {
                return (sequence.operation(), f64::from(tenth) / 10.0);
            }
        }
        panic!("{before:?} never ended");
    }

    #[test]
    fn three_attempts_then_fail_to_start_until_acknowledged() {
        let mut sequence = Sequence::new(100);
        let dead = Sensed::default();
        let mut walk = Vec::new();
        while walk.last() != Some(&Operation::AtRest) {
            walk.push(until_change(&mut sequence, OFF_LOAD, dead).0);
        }
        use Operation::*;
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
                Stopping,
                AtRest
            ]
        );
        assert!(sequence.failed_to_start());
        assert_eq!((sequence.runs, sequence.cranks), (100, 114));

        sequence.step(TENTH, OFF_LOAD, dead);
        assert_eq!(sequence.operation(), AtRest, "a latched failure keeps it at rest");
        sequence.acknowledge();
        sequence.step(TENTH, OFF_LOAD, dead);
        assert_eq!(sequence.operation(), WaitBeforeFuel);
    }

    #[test]
    fn the_timer_counts_down_to_the_change() {
        let mut sequence = Sequence::new(1);
        sequence.step(TENTH, OFF_LOAD, Sensed::default());
        let mut seen = vec![sequence.seconds_left()];
        while sequence.operation() == Operation::WaitBeforeFuel {
            sequence.step(TENTH, OFF_LOAD, Sensed::default());
            if sequence.operation() == Operation::WaitBeforeFuel
                && seen.last() != Some(&sequence.seconds_left())
            {
                seen.push(sequence.seconds_left());
            }
        }
        assert_eq!(seen, [3, 2, 1]);
    }

    #[test]
    fn a_start_that_is_no_longer_wanted_ends_before_cranking() {
        let mut sequence = Sequence::new(1);
        sequence.step(TENTH, Demand::ON_LOAD, Sensed::default());
        sequence.step(TENTH, Demand::REST, Sensed::default());
        assert_eq!(sequence.operation(), Operation::AtRest);
        assert!(!sequence.failed_to_start());
    }

    #[test]
    fn the_breakers_are_never_commanded_closed_together() {
        use Operation::*;
        for operation in
            [AtRest, OffLoad, GensetBreakerActivation, OnLoad, MainsBreakerActivation, ImmediateStop]
        {
            for (genset_breaker, mains_breaker) in
                [(false, false), (false, true), (true, false), (true, true)]
            {
                let mut sequence = Sequence::new(1);
                sequence.enter(operation);
                let sensed =
                    Sensed { genset_breaker, mains_breaker, genset_healthy: true, ..Sensed::default() };
                for demand in [Demand::REST, OFF_LOAD, Demand::ON_LOAD] {
                    let controls = sequence.controls(demand, sensed);
                    assert!(!(controls.genset_breaker && controls.mains_breaker));
                    assert!(!(controls.genset_breaker && mains_breaker), "{operation:?} {demand:?}");
                    assert!(!(controls.mains_breaker && genset_breaker), "{operation:?} {demand:?}");
                }
            }
        }
    }
}
