//! A genset behind a source, as far as a transfer switch sees it: a start signal in, voltage out.

/// Seconds from the start signal to the rated voltage.
const RUN_UP: f64 = 8.0;
/// kW that it gives at most: a tenth more than what it can carry for long.
const MOST: f64 = 1.1 * 3500.0;
/// Below this part of its speed for so many seconds its own controller stops it.
const TOO_SLOW: (f64, f64) = (0.9, 5.0);

/// Part of its speed, and of its voltage with it, that a set holds when consumers ask for so many kW at full voltage: as
/// its voltage falls they take less, until it can give what they take.
pub(super) fn holds(kw: f64) -> f64 {
    (MOST / kw.max(MOST)).sqrt()
}

/// What is wrong with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Health {
    Normal,
    /// It stays at rest; one that runs goes on.
    WillNotStart,
    /// It stops, and stays at rest.
    Fails,
}

/// The set with its own controller, which follows the start signal.
#[derive(Clone, Debug)]
pub(in super::super) struct Engine {
    pub(in super::super) health: Health,
    /// Seconds since it began to start.
    turning: f64,
    /// Seconds for which it has been too slow.
    strained_for: f64,
    /// Its own controller has stopped it, and does not start it anew before the start signal has gone.
    stopped: bool,
}

impl Engine {
    pub(super) fn new() -> Self {
        Self { health: Health::Normal, turning: 0.0, strained_for: 0.0, stopped: false }
    }

    /// `holds` is the part of its speed that it holds.
    pub(super) fn step(&mut self, dt: f64, start: bool, holds: f64) {
        let (slow, patience) = TOO_SLOW;
        self.strained_for = if holds < slow { self.strained_for + dt } else { 0.0 };
        self.stopped = start && (self.stopped || self.strained_for > patience);
        let stays = match self.health {
            Health::Normal => true,
            Health::WillNotStart => self.has_voltage(),
            Health::Fails => false,
        };
        self.turning = if start && stays && !self.stopped { self.turning + dt } else { 0.0 };
    }

    pub(in super::super) fn has_voltage(&self) -> bool {
        self.turning >= RUN_UP - 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_runs_up_runs_and_stops() {
        let mut engine = Engine::new();
        let mut walk = |health, start, seconds| {
            engine.health = health;
            (0..10 * seconds).for_each(|_| engine.step(0.1, start, 1.0));
            engine.has_voltage()
        };
        assert!(!walk(Health::Normal, true, 7));
        assert!(walk(Health::Normal, true, 1));
        assert!(walk(Health::WillNotStart, true, 5), "it runs already");
        assert!(!walk(Health::Fails, true, 1));
        assert!(!walk(Health::WillNotStart, true, 60));
        assert!(walk(Health::Normal, true, 8));
        assert!(!walk(Health::Normal, false, 1));
    }

    #[test]
    fn too_slow_for_too_long_it_is_stopped_until_its_signal_has_gone() {
        let mut engine = Engine::new();
        let mut walk = |start, holds, tenths| {
            (0..tenths).for_each(|_| engine.step(0.1, start, holds));
            engine.has_voltage()
        };
        assert!(walk(true, 1.0, 80) && walk(true, 0.8, 49) && walk(true, 0.95, 100) && walk(true, 0.8, 49));
        assert!(!walk(true, 0.8, 3) && !walk(true, 1.0, 300), "it is not tried again");
        assert!(!walk(false, 1.0, 1) && walk(true, 1.0, 80));
        assert!(holds(3800.0) == 1.0 && (0.91..0.93).contains(&holds(4500.0)) && holds(9000.0) < 0.7);
    }
}
