//! How an ACC1700 starts, loads, unloads and stops its compressor: register 94 with its delay in register 95.

use std::time::Duration;

use crate::plant::{Compressor, Orders};

/// kPa below which the load valve opens, and at which it shuts.
const LOAD_BELOW: f64 = 620.0;
const UNLOAD_AT: f64 = 750.0;
/// kPa down to which a stop waits for the discharge pressure.
const STOP_BELOW: f64 = 200.0;

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

impl Status {
    /// Seconds until it changes by itself; 0 where it waits for something else. As a site would set them, but for a
    /// shorter cool-down, so that it can be watched.
    fn seconds(self) -> u64 {
        match self {
            Self::Standby | Self::WaitToOnload | Self::NormalRunning | Self::StopFailure => 0,
            Self::FuelOutput => 1,
            Self::EnergiseToStop => 3,
            Self::Preheat | Self::SafetyOn | Self::AfterStop => 5,
            Self::Crank => 8,
            Self::CrankRest | Self::StartIdle | Self::WarmingUp | Self::StopIdle => 10,
            Self::WaitForStop => 15,
            Self::Cooling => 20,
        }
    }

    /// The engine turns by itself.
    pub(super) fn is_running(self) -> bool {
        (Self::SafetyOn..=Self::StopIdle).contains(&self)
    }

    /// The safety-on delay has passed: oil pressure and speed are watched.
    pub(super) fn is_watched(self) -> bool {
        (Self::StartIdle..=Self::StopIdle).contains(&self)
    }
}

const ATTEMPTS: u8 = 3;

/// What the sequence sees of the plant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensed {
    pub(super) running: bool,
    pub(super) turning: bool,
    /// kPa.
    pub(super) pressure: f64,
}

impl From<&Compressor> for Sensed {
    fn from(plant: &Compressor) -> Self {
        Self {
            running: plant.engine.is_running(),
            turning: plant.engine.speed > 0.0,
            pressure: plant.air.pressure,
        }
    }
}

/// The state machine; keys, time and the plant are handed in.
#[derive(Clone, Debug)]
pub(super) struct Sequence {
    status: Status,
    timer: Duration,
    attempts_left: u8,
    load_valve: bool,
    waits_for_pressure: bool,
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
            load_valve: false,
            waits_for_pressure: false,
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

    /// A stop waits for the discharge pressure to fall; the cooling delay stands still.
    pub(super) fn waits_for_pressure(&self) -> bool {
        self.waits_for_pressure
    }

    pub(super) fn failed_to_start(&self) -> bool {
        self.failed_to_start
    }

    pub(super) fn acknowledge(&mut self) {
        self.failed_to_start = false;
    }

    /// Starts a unit that stands by; whether it does.
    pub(super) fn start(&mut self) -> bool {
        let starts = self.status == Status::Standby;
        if starts {
            self.attempts_left = ATTEMPTS;
            self.enter(Status::Preheat);
        }
        starts
    }

    /// Ends whatever runs in an orderly way.
    pub(super) fn stop(&mut self) {
        match self.status {
            Status::Preheat | Status::FuelOutput => self.enter(Status::Standby),
            Status::Crank | Status::CrankRest => self.enter(Status::EnergiseToStop),
            Status::SafetyOn | Status::StartIdle => self.enter(Status::StopIdle),
            Status::WarmingUp | Status::WaitToOnload | Status::NormalRunning => self.enter(Status::Cooling),
            _ => {}
        }
    }

    /// Ends whatever runs at once.
    pub(super) fn trip(&mut self) {
        match self.status {
            Status::Preheat | Status::FuelOutput => self.enter(Status::Standby),
            status if (Status::Crank..=Status::StopIdle).contains(&status) => {
                self.enter(Status::EnergiseToStop);
            }
            _ => {}
        }
    }

    /// Loads a unit that waits for it, and unloads a loaded one.
    pub(super) fn toggle_load(&mut self, pressure: f64) {
        match self.status {
            Status::WaitToOnload => {
                self.enter(Status::NormalRunning);
                self.load_valve = pressure < UNLOAD_AT;
            }
            Status::NormalRunning => self.enter(Status::WaitToOnload),
            _ => {}
        }
    }

    pub(super) fn step(&mut self, dt: Duration, sensed: Sensed) {
        self.waits_for_pressure = self.status == Status::Cooling && sensed.pressure > STOP_BELOW;
        if !self.waits_for_pressure {
            self.timer = self.timer.saturating_sub(dt);
        }
        self.load_valve = self.is_loaded()
            && (sensed.pressure < LOAD_BELOW || self.load_valve && sensed.pressure < UNLOAD_AT);
        if let Some(next) = self.next(sensed) {
            self.failed_to_start |= self.status == Status::Crank && next == Status::EnergiseToStop;
            self.enter(next);
        }
    }

    /// What the unit's outputs do in this status.
    pub(super) fn orders(&self) -> Orders {
        use Status::*;
        Orders {
            fuel: (FuelOutput..=StopIdle).contains(&self.status),
            starter: self.status == Crank,
            idle: matches!(self.status, SafetyOn | StartIdle | WaitToOnload | StopIdle),
            load_valve: self.load_valve,
            blow_down: self.status == Standby || self.status >= Cooling,
        }
    }

    fn next(&self, sensed: Sensed) -> Option<Status> {
        use Status::*;
        let elapsed = self.timer.is_zero();
        let after = |next: Status| elapsed.then_some(next);
        match self.status {
            Standby | WaitToOnload | NormalRunning => None,
            Preheat => after(FuelOutput),
            FuelOutput => after(Crank),
            Crank if sensed.running => Some(SafetyOn),
            Crank if self.attempts_left > 0 => after(CrankRest),
            Crank => after(EnergiseToStop),
            CrankRest => after(Crank),
            SafetyOn => after(StartIdle),
            StartIdle => after(WarmingUp),
            WarmingUp => after(WaitToOnload),
            Cooling => after(StopIdle),
            StopIdle => after(EnergiseToStop),
            EnergiseToStop => after(WaitForStop),
            WaitForStop | StopFailure if !sensed.turning => Some(AfterStop),
            WaitForStop => after(StopFailure),
            StopFailure => None,
            AfterStop => after(Standby),
        }
    }

    fn enter(&mut self, next: Status) {
        match next {
            Status::Crank => self.attempts_left = self.attempts_left.saturating_sub(1),
            Status::SafetyOn => self.starts = self.starts.saturating_add(1),
            _ => {}
        }
        self.status = next;
        self.timer = Duration::from_secs(next.seconds());
        self.load_valve = false;
        self.waits_for_pressure = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Status::*;

    const TENTH: Duration = Duration::from_millis(100);
    const DEAD: Sensed = Sensed { running: false, turning: false, pressure: 0.0 };
    const RUNNING: Sensed = Sensed { running: true, turning: true, pressure: 0.0 };

    /// Every status until one of them is reached.
    fn walk(sequence: &mut Sequence, to: Status, sensed: impl Fn(Status) -> Sensed) -> Vec<Status> {
        let mut seen = vec![sequence.status()];
        for _ in 0..3000 {
            if seen.last() == Some(&to) {
                return seen;
            }
            sequence.step(TENTH, sensed(sequence.status()));
            if seen.last() != Some(&sequence.status()) {
                seen.push(sequence.status());
            }
        }
        panic!("{to:?} never came: {seen:?}");
    }

    fn loaded() -> Sequence {
        let mut sequence = Sequence::new(10);
        assert!(sequence.start());
        walk(&mut sequence, WaitToOnload, |_| RUNNING);
        sequence.toggle_load(0.0);
        sequence
    }

    #[test]
    fn it_starts_on_the_third_attempt_in_the_order_of_the_codes() {
        let mut sequence = Sequence::new(10);
        assert!(sequence.start() && !sequence.start());
        let cranked = std::cell::Cell::new(0);
        let seen = walk(&mut sequence, WaitToOnload, |status| {
            cranked.set(cranked.get() + u32::from(status == Crank));
            if cranked.get() > 170 { RUNNING } else { DEAD }
        });
        assert_eq!(
            seen,
            [
                Preheat,
                FuelOutput,
                Crank,
                CrankRest,
                Crank,
                CrankRest,
                Crank,
                SafetyOn,
                StartIdle,
                WarmingUp,
                WaitToOnload
            ]
        );
        assert_eq!(sequence.starts, 11);
    }

    #[test]
    fn three_attempts_and_it_gives_up() {
        let mut sequence = Sequence::new(10);
        sequence.start();
        let seen = walk(&mut sequence, Standby, |_| DEAD);
        assert_eq!(seen.iter().filter(|status| **status == Crank).count(), 3);
        assert_eq!(seen[seen.len() - 4..], [EnergiseToStop, WaitForStop, AfterStop, Standby]);
        assert!(sequence.failed_to_start());
        assert_eq!(sequence.starts, 10);
        sequence.acknowledge();
        assert!(!sequence.failed_to_start());
    }

    #[test]
    fn a_stop_while_cranking_is_no_failure() {
        let mut sequence = Sequence::new(10);
        sequence.start();
        walk(&mut sequence, Crank, |_| DEAD);
        sequence.stop();
        walk(&mut sequence, Standby, |_| DEAD);
        assert!(!sequence.failed_to_start());
    }

    #[test]
    fn the_valve_hunts_between_its_limits_and_the_status_stays() {
        let mut sequence = loaded();
        let mut valve = |pressure| {
            sequence.step(TENTH, Sensed { pressure, ..RUNNING });
            assert_eq!(sequence.status(), NormalRunning);
            sequence.orders().load_valve
        };
        let pressures = [0.0, 700.0, 749.0, 750.0, 700.0, 620.0, 619.0, 700.0, 800.0];
        assert_eq!(pressures.map(&mut valve), [true, true, true, false, false, false, true, true, false]);
    }

    #[test]
    fn a_stop_waits_for_the_pressure_with_its_delay_standing_still() {
        let mut sequence = loaded();
        sequence.stop();
        assert!(!sequence.orders().load_valve && sequence.orders().blow_down);
        for _ in 0..300 {
            sequence.step(TENTH, Sensed { pressure: 201.0, ..RUNNING });
            assert_eq!((sequence.status(), sequence.seconds_left()), (Cooling, 20));
            assert!(sequence.waits_for_pressure());
        }
        sequence.step(TENTH, Sensed { pressure: 199.0, ..RUNNING });
        assert!(!sequence.waits_for_pressure());
        let seen = walk(&mut sequence, Standby, |status| if status < WaitForStop { RUNNING } else { DEAD });
        assert_eq!(seen, [Cooling, StopIdle, EnergiseToStop, WaitForStop, AfterStop, Standby]);
    }

    #[test]
    fn an_engine_that_goes_on_turning_is_a_stop_failure_until_it_stands() {
        let mut sequence = loaded();
        sequence.trip();
        let seen = walk(&mut sequence, StopFailure, |_| RUNNING);
        assert_eq!(seen, [EnergiseToStop, WaitForStop, StopFailure]);
        for _ in 0..600 {
            sequence.step(TENTH, RUNNING);
        }
        assert_eq!((sequence.status(), sequence.seconds_left()), (StopFailure, 0));
        assert!(!sequence.orders().fuel && !sequence.start());
        assert_eq!(walk(&mut sequence, Standby, |_| DEAD), [StopFailure, AfterStop, Standby]);
    }

    #[test]
    fn the_load_key_is_dead_where_nothing_could_be_loaded() {
        for status in [Standby, Crank, StartIdle, WarmingUp, Cooling, StopIdle, AfterStop] {
            let mut sequence = Sequence::new(10);
            sequence.enter(status);
            sequence.toggle_load(0.0);
            assert_eq!(sequence.status(), status);
            assert!(!sequence.orders().load_valve);
        }
    }
}
