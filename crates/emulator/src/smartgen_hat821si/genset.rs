//! The start output: register 1092 with delay 1093.

use std::time::Duration;

/// Before the start output comes on.
const START_DELAY: Duration = Duration::from_secs(3);
/// Before it goes off.
const STOP_DELAY: Duration = Duration::from_secs(5);
/// How long the set takes from the start signal to its rated voltage.
const RUN_UP: Duration = Duration::from_secs(8);

/// States with their codes. Scheduled runs (2 and 3) need a schedule, and none is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
enum State {
    StartDelay = 0,
    StopDelay = 1,
    Started = 8,
    Standby = 9,
}

/// The controller's side of the genset, and how far the set has come.
#[derive(Clone, Debug)]
pub(super) struct Genset {
    state: State,
    timer: Duration,
    signalled_for: Duration,
}

impl Genset {
    pub(super) fn new() -> Self {
        Self { state: State::Standby, timer: Duration::ZERO, signalled_for: Duration::ZERO }
    }

    pub(super) fn step(&mut self, dt: Duration, wanted: bool) {
        self.timer = self.timer.saturating_sub(dt);
        let elapsed = self.timer.is_zero();
        (self.state, self.timer) = match (self.state, wanted) {
            (State::Standby, true) => (State::StartDelay, START_DELAY),
            (State::StartDelay, true) if elapsed => (State::Started, Duration::ZERO),
            (State::StartDelay, false) => (State::Standby, Duration::ZERO),
            (State::Started, false) => (State::StopDelay, STOP_DELAY),
            (State::StopDelay, true) => (State::Started, Duration::ZERO),
            (State::StopDelay, false) if elapsed => (State::Standby, Duration::ZERO),
            (same, _) => (same, self.timer),
        };
        self.signalled_for = if self.start_output() { self.signalled_for + dt } else { Duration::ZERO };
    }

    /// Bit 500.15.
    pub(super) fn start_output(&self) -> bool {
        matches!(self.state, State::Started | State::StopDelay)
    }

    /// It has its voltage.
    pub(super) fn is_running(&self) -> bool {
        self.signalled_for >= RUN_UP
    }

    pub(super) fn status(&self) -> u16 {
        self.state as u16
    }

    pub(super) fn seconds_left(&self) -> u64 {
        self.timer.as_millis().div_ceil(1000) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn start_and_stop_take_their_delays() {
        let second = Duration::from_secs(1);
        let mut genset = Genset::new();
        let mut walk = |wanted, seconds| {
            (0..seconds).for_each(|_| genset.step(second, wanted));
            (genset.status(), genset.seconds_left(), genset.start_output(), genset.is_running())
        };
        assert_eq!(walk(true, 1), (0, 3, false, false));
        assert_eq!(walk(false, 1), (9, 0, false, false), "no longer wanted before it was started");
        assert_eq!(walk(true, 4), (8, 0, true, false));
        assert_eq!(walk(true, 8), (8, 0, true, true));
        assert_eq!(walk(false, 1), (1, 5, true, true));
        assert_eq!(walk(true, 1), (8, 0, true, true), "wanted again");
        assert_eq!(walk(false, 6), (9, 0, false, false));
    }
}
