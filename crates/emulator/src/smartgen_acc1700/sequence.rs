//! How an ACC1700 starts, loads, unloads and stops its compressor: register 94 with its delay in register 95.

use std::time::Duration;

use crate::plant::Orders;

use super::setup::Setup;

/// Codes of register 94 (table 13, page 20).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
#[repr(u8)]
pub(super) enum Status {
    Standby = 0,
    Preheat = 1,
    FuelOutput = 2,
    Crank = 3,
    CrankRest = 4,
    SafetyOn = 5,
    StartIdle = 6,
    WarmingUp = 7,
    WaitToOnload = 8,
    NormalRunning = 9,
    Cooling = 10,
    StopIdle = 11,
    EnergiseToStop = 12,
    WaitForStop = 13,
    StopFailure = 14,
    AfterStop = 15,
}

/// Why a status changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    StartKey,
    StopKey,
    LoadKey,
    /// Some shutdown alarm is active.
    Shutdown,
    DelayOver,
    /// The engine turns by itself.
    EngineRuns,
    /// The last crank was in vain.
    AttemptsOver,
    EngineStands,
}

/// Every change of status that there is. What is not here does not happen, and `docs/imitation` draws it.
pub(super) const TRANSITIONS: &[(Status, Cause, Status)] = {
    use Cause::*;
    use Status::*;
    &[
        (Standby, StartKey, Preheat),
        (Preheat, DelayOver, FuelOutput),
        (Preheat, StopKey, Standby),
        (Preheat, Shutdown, Standby),
        (FuelOutput, DelayOver, Crank),
        (FuelOutput, StopKey, Standby),
        (FuelOutput, Shutdown, Standby),
        (Crank, EngineRuns, SafetyOn),
        (Crank, DelayOver, CrankRest),
        (Crank, AttemptsOver, EnergiseToStop),
        (Crank, StopKey, EnergiseToStop),
        (Crank, Shutdown, EnergiseToStop),
        (CrankRest, DelayOver, Crank),
        (CrankRest, StopKey, EnergiseToStop),
        (CrankRest, Shutdown, EnergiseToStop),
        (SafetyOn, DelayOver, StartIdle),
        (SafetyOn, StopKey, StopIdle),
        (SafetyOn, Shutdown, EnergiseToStop),
        (StartIdle, DelayOver, WarmingUp),
        (StartIdle, StopKey, StopIdle),
        (StartIdle, Shutdown, EnergiseToStop),
        (WarmingUp, DelayOver, WaitToOnload),
        (WarmingUp, StopKey, Cooling),
        (WarmingUp, Shutdown, EnergiseToStop),
        (WaitToOnload, LoadKey, NormalRunning),
        (WaitToOnload, StopKey, Cooling),
        (WaitToOnload, Shutdown, EnergiseToStop),
        (NormalRunning, LoadKey, WaitToOnload),
        (NormalRunning, StopKey, Cooling),
        (NormalRunning, Shutdown, EnergiseToStop),
        (Cooling, DelayOver, StopIdle),
        (Cooling, Shutdown, EnergiseToStop),
        (StopIdle, DelayOver, EnergiseToStop),
        (StopIdle, Shutdown, EnergiseToStop),
        (EnergiseToStop, DelayOver, WaitForStop),
        (WaitForStop, EngineStands, AfterStop),
        (WaitForStop, DelayOver, StopFailure),
        (StopFailure, EngineStands, AfterStop),
        (AfterStop, DelayOver, Standby),
    ]
};

impl Status {
    /// The engine turns by itself.
    pub(super) fn is_running(self) -> bool {
        (Self::SafetyOn..=Self::StopIdle).contains(&self)
    }

    /// The safety-on delay has passed: oil pressure and speed are watched.
    pub(super) fn is_watched(self) -> bool {
        (Self::StartIdle..=Self::StopIdle).contains(&self)
    }

    /// It ends by itself.
    fn is_timed(self) -> bool {
        !matches!(self, Self::Standby | Self::WaitToOnload | Self::NormalRunning | Self::StopFailure)
    }
}

/// What the sequence knows of the plant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensed {
    /// The engine is seen to turn by itself.
    pub(super) running: bool,
    /// The engine is seen to turn.
    pub(super) turning: bool,
    /// kPa at the discharge, where it is known.
    pub(super) pressure: Option<f64>,
}

/// The state machine; keys, time and what is measured are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    status: Status,
    timer: Duration,
    attempts_left: u8,
    waits_for_pressure: bool,
    /// How long it has waited for the pressure.
    waited: Duration,
    /// Latched until [`Sequence::acknowledge`].
    failed_to_start: bool,
    /// Times the engine ran, since the unit was fitted.
    pub(super) starts: u16,
}

impl Sequence {
    pub(super) fn new(starts: u16) -> Self {
        Self {
            status: Status::Standby,
            timer: Duration::ZERO,
            attempts_left: 0,
            waits_for_pressure: false,
            waited: Duration::ZERO,
            failed_to_start: false,
            starts,
        }
    }

    pub(super) fn status(&self) -> Status {
        self.status
    }

    /// Whole seconds until the status changes by itself; 0 where the manual has no delay value.
    pub(super) fn seconds_left(&self) -> u64 {
        match self.status {
            Status::FuelOutput => 0,
            _ => self.timer.as_millis().div_ceil(1000) as u64,
        }
    }

    pub(super) fn is_loaded(&self) -> bool {
        self.status == Status::NormalRunning
    }

    /// A stop waits for the discharge pressure to fall; the delay stands still.
    pub(super) fn waits_for_pressure(&self) -> bool {
        self.waits_for_pressure
    }

    pub(super) fn failed_to_start(&self) -> bool {
        self.failed_to_start
    }

    pub(super) fn acknowledge(&mut self) {
        self.failed_to_start = false;
    }

    /// Takes what has come up; whether the status changed by it.
    pub(super) fn react(&mut self, cause: Cause, setup: &Setup) -> bool {
        let found = TRANSITIONS.iter().find(|(from, by, _)| *from == self.status && *by == cause);
        let Some((_, _, next)) = found else { return false };
        if cause == Cause::StartKey {
            self.attempts_left = setup.attempts;
        }
        self.failed_to_start |= cause == Cause::AttemptsOver;
        self.enter(*next, setup);
        true
    }

    pub(super) fn step(&mut self, dt: Duration, sensed: Sensed, setup: &Setup) {
        match self.waits(sensed, setup) {
            true => self.waited += dt,
            false => self.timer = self.timer.saturating_sub(dt),
        }
        let mut cause = self.cause(sensed, setup);
        while let Some(found) = cause {
            self.react(found, setup);
            // A status with a delay of 0 is left out; cranks have one, so this ends.
            let left_out = setup.delay(self.status).is_zero();
            cause = self.cause(sensed, setup).filter(|_| left_out);
        }
        self.waits_for_pressure = self.waits(sensed, setup);
    }

    /// What the unit's relays do in this status; the load valve is another's.
    pub(super) fn orders(&self) -> Orders {
        use Status::*;
        Orders {
            // Without fuel between two cranks: an engine that fires too late does not run up unseen.
            fuel: (FuelOutput..=StopIdle).contains(&self.status) && self.status != CrankRest,
            starter: self.status == Crank,
            // Nor does one that does not stop speed up again.
            idle: match self.status {
                SafetyOn | StartIdle | WaitToOnload => true,
                status => status >= StopIdle,
            },
            load_valve: false,
            heater: false,
            blow_down: self.status == Standby || self.status >= Cooling,
        }
    }

    fn waits(&self, sensed: Sensed, setup: &Setup) -> bool {
        matches!(self.status, Status::Cooling | Status::StopIdle)
            && self.waited < setup.stop_pressure_time
            && sensed.pressure.is_some_and(|pressure| pressure > setup.stop_pressure)
    }

    fn cause(&self, sensed: Sensed, setup: &Setup) -> Option<Cause> {
        match self.status {
            Status::Crank if sensed.running => Some(Cause::EngineRuns),
            Status::WaitForStop | Status::StopFailure if !sensed.turning => Some(Cause::EngineStands),
            status if !status.is_timed() || !self.timer.is_zero() || self.waits(sensed, setup) => None,
            Status::Crank if self.attempts_left == 0 => Some(Cause::AttemptsOver),
            _ => Some(Cause::DelayOver),
        }
    }

    fn enter(&mut self, next: Status, setup: &Setup) {
        match next {
            Status::Crank => self.attempts_left = self.attempts_left.saturating_sub(1),
            Status::SafetyOn => self.starts = self.starts.saturating_add(1),
            _ => {}
        }
        // One stop waits once, cooling or, where there is nothing to cool, idling.
        if (self.status, next) != (Status::Cooling, Status::StopIdle) {
            self.waited = Duration::ZERO;
        }
        self.status = next;
        self.timer = setup.delay(next);
        self.waits_for_pressure = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Status::*;

    const TENTH: Duration = Duration::from_millis(100);
    const DEAD: Sensed = Sensed { running: false, turning: false, pressure: Some(0.0) };
    const RUNNING: Sensed = Sensed { running: true, turning: true, pressure: Some(0.0) };

    /// A sequence with what it is set to.
    struct Bench {
        sequence: Sequence,
        setup: Setup,
    }

    impl Bench {
        fn new(changes: &[(&str, &str)]) -> Self {
            Self { sequence: Sequence::new(10), setup: Setup::with(changes) }
        }

        fn loaded() -> Self {
            let mut bench = Self::new(&[]);
            assert!(bench.react(Cause::StartKey));
            bench.walk(WaitToOnload, |_| RUNNING);
            assert!(bench.react(Cause::LoadKey));
            bench
        }

        fn react(&mut self, cause: Cause) -> bool {
            self.sequence.react(cause, &self.setup)
        }

        fn step(&mut self, sensed: Sensed) {
            self.sequence.step(TENTH, sensed, &self.setup);
        }

        fn status(&self) -> Status {
            self.sequence.status()
        }

        /// Every status until one of them is reached.
        fn walk(&mut self, to: Status, sensed: impl Fn(Status) -> Sensed) -> Vec<Status> {
            let mut seen = vec![self.status()];
            for _ in 0..3000 {
                if seen.last() == Some(&to) {
                    return seen;
                }
                self.step(sensed(self.status()));
                if seen.last() != Some(&self.status()) {
                    seen.push(self.status());
                }
            }
            panic!("{to:?} never came: {seen:?}");
        }
    }

    #[test]
    fn the_table_knows_every_status_and_no_two_ways_for_one_cause() {
        for (index, (from, cause, to)) in TRANSITIONS.iter().enumerate() {
            assert_ne!(from, to);
            let twins = TRANSITIONS[index + 1..].iter().filter(|other| (other.0, other.1) == (*from, *cause));
            assert_eq!(twins.count(), 0, "{from:?} {cause:?}");
        }
        let mut reached = vec![Standby];
        while let Some((_, _, next)) =
            TRANSITIONS.iter().find(|(from, _, to)| reached.contains(from) && !reached.contains(to))
        {
            reached.push(*next);
        }
        assert_eq!(reached.len(), 16, "{reached:?}");
        for status in reached {
            let ways = |wanted: Cause| {
                TRANSITIONS.iter().any(|(from, cause, _)| (*from, *cause) == (status, wanted))
            };
            assert_eq!(ways(Cause::DelayOver), status.is_timed(), "{status:?}");
            let stoppable = (Crank..=StopIdle).contains(&status) || matches!(status, Preheat | FuelOutput);
            assert_eq!(ways(Cause::Shutdown), stoppable, "{status:?}");
        }
    }

    #[test]
    fn it_starts_on_the_third_attempt_in_the_order_of_the_codes() {
        let mut bench = Bench::new(&[]);
        assert!(bench.react(Cause::StartKey) && !bench.react(Cause::StartKey));
        let cranked = std::cell::Cell::new(0);
        let seen = bench.walk(WaitToOnload, |status| {
            cranked.set(cranked.get() + u32::from(status == Crank));
            if cranked.get() > 170 { RUNNING } else { DEAD }
        });
        let attempts = [Crank, CrankRest, Crank, CrankRest, Crank];
        let mut resting = bench.sequence.clone();
        resting.enter(CrankRest, &bench.setup);
        assert_eq!(resting.orders(), Orders::default(), "no fuel between two cranks");
        let running = [SafetyOn, StartIdle, WarmingUp, WaitToOnload];
        assert_eq!(seen, [&[Preheat, FuelOutput][..], &attempts, &running].concat());
        assert_eq!(bench.sequence.starts, 11);
    }

    #[test]
    fn its_attempts_are_used_up_and_it_gives_up() {
        for attempts in [1, 3, 10] {
            let mut bench = Bench::new(&[("start_attempts", &attempts.to_string())]);
            bench.react(Cause::StartKey);
            let seen = bench.walk(Standby, |_| DEAD);
            assert_eq!(seen.iter().filter(|status| **status == Crank).count(), attempts);
            assert_eq!(seen[seen.len() - 4..], [EnergiseToStop, WaitForStop, AfterStop, Standby]);
            assert!(bench.sequence.failed_to_start());
            assert_eq!(bench.sequence.starts, 10);
            bench.sequence.acknowledge();
            assert!(!bench.sequence.failed_to_start());
        }
    }

    #[test]
    fn a_stop_while_cranking_is_no_failure() {
        let mut bench = Bench::new(&[]);
        bench.react(Cause::StartKey);
        bench.walk(Crank, |_| DEAD);
        bench.react(Cause::StopKey);
        bench.walk(Standby, |_| DEAD);
        assert!(!bench.sequence.failed_to_start());
    }

    #[test]
    fn a_stop_waits_for_the_pressure_with_its_delay_standing_still() {
        let mut bench = Bench::loaded();
        bench.react(Cause::StopKey);
        assert!(bench.sequence.orders().blow_down);
        for _ in 0..300 {
            bench.step(Sensed { pressure: Some(201.0), ..RUNNING });
            assert_eq!((bench.status(), bench.sequence.seconds_left()), (Cooling, 20));
            assert!(bench.sequence.waits_for_pressure());
        }
        bench.step(Sensed { pressure: Some(199.0), ..RUNNING });
        assert!(!bench.sequence.waits_for_pressure());
        let seen = bench.walk(Standby, |status| if status < WaitForStop { RUNNING } else { DEAD });
        assert_eq!(seen, [Cooling, StopIdle, EnergiseToStop, WaitForStop, AfterStop, Standby]);
    }

    #[test]
    fn a_stop_waits_no_longer_than_it_is_set_to() {
        let mut bench = Bench::loaded();
        bench.setup = Setup::with(&[("stop_pressure_time", "60")]);
        bench.react(Cause::StopKey);
        for _ in 0..600 {
            bench.step(Sensed { pressure: Some(700.0), ..RUNNING });
        }
        assert_eq!((bench.status(), bench.sequence.seconds_left()), (Cooling, 20));
        for _ in 0..50 {
            bench.step(Sensed { pressure: Some(700.0), ..RUNNING });
        }
        assert_eq!((bench.status(), bench.sequence.seconds_left()), (Cooling, 15));
        assert!(!bench.sequence.waits_for_pressure());
    }

    #[test]
    fn a_stop_that_has_nothing_to_cool_waits_at_idle() {
        let mut bench = Bench::new(&[("stop_pressure_time", "60")]);
        bench.react(Cause::StartKey);
        bench.walk(StartIdle, |_| RUNNING);
        bench.react(Cause::StopKey);
        for _ in 0..600 {
            bench.step(Sensed { pressure: Some(201.0), ..RUNNING });
            assert_eq!((bench.status(), bench.sequence.seconds_left()), (StopIdle, 10));
            assert!(bench.sequence.orders().idle && bench.sequence.orders().blow_down);
        }
        bench.step(Sensed { pressure: Some(201.0), ..RUNNING });
        assert!(!bench.sequence.waits_for_pressure());
        assert_eq!(bench.walk(EnergiseToStop, |_| RUNNING), [StopIdle, EnergiseToStop]);
    }

    #[test]
    fn a_stop_waits_for_no_pressure_that_nobody_knows() {
        let mut bench = Bench::loaded();
        bench.react(Cause::StopKey);
        for _ in 0..10 {
            bench.step(Sensed { pressure: None, ..RUNNING });
        }
        assert_eq!((bench.sequence.seconds_left(), bench.sequence.waits_for_pressure()), (19, false));
    }

    #[test]
    fn statuses_without_a_delay_are_left_out_but_the_wait_for_the_pressure_is_not() {
        let nothing =
            ["preheat_time", "fuel_output_time", "safety_on_time", "start_idle_time", "warming_up_time"];
        let stopping = ["cooling_time", "stop_idle_time", "energise_to_stop_time", "after_stop_time"];
        let changes: Vec<_> = nothing.iter().chain(&stopping).map(|id| (*id, "0")).collect();
        let mut bench = Bench::new(&changes);
        bench.react(Cause::StartKey);
        assert_eq!(bench.walk(WaitToOnload, |_| RUNNING), [Preheat, Crank, WaitToOnload]);
        bench.react(Cause::LoadKey);
        bench.react(Cause::StopKey);
        for _ in 0..50 {
            bench.step(Sensed { pressure: Some(300.0), ..RUNNING });
            assert_eq!(bench.status(), Cooling);
        }
        assert_eq!(bench.walk(WaitForStop, |_| RUNNING), [Cooling, WaitForStop]);
        assert_eq!(bench.walk(Standby, |_| DEAD), [WaitForStop, Standby]);
    }

    #[test]
    fn an_engine_that_goes_on_turning_is_a_stop_failure_until_it_stands() {
        let mut bench = Bench::loaded();
        bench.react(Cause::Shutdown);
        let seen = bench.walk(StopFailure, |_| RUNNING);
        assert_eq!(seen, [EnergiseToStop, WaitForStop, StopFailure]);
        for _ in 0..600 {
            bench.step(RUNNING);
        }
        assert_eq!((bench.status(), bench.sequence.seconds_left()), (StopFailure, 0));
        assert!(!bench.sequence.orders().fuel && !bench.react(Cause::StartKey));
        assert!(bench.sequence.orders().idle, "it does not speed up");
        assert_eq!(bench.walk(Standby, |_| DEAD), [StopFailure, AfterStop, Standby]);
    }

    #[test]
    fn the_load_key_is_dead_where_nothing_could_be_loaded() {
        for status in [Standby, Crank, StartIdle, WarmingUp, Cooling, StopIdle, AfterStop] {
            let mut bench = Bench::new(&[]);
            bench.sequence.enter(status, &bench.setup);
            assert!(!bench.react(Cause::LoadKey));
            assert_eq!(bench.status(), status);
        }
    }
}
