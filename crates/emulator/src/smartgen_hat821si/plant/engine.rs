//! A genset behind a source, as far as a transfer switch sees it: a start signal in, voltage out.

/// Seconds from the start signal to the rated voltage.
const RUN_UP: f64 = 8.0;

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
}

impl Engine {
    pub(super) fn new() -> Self {
        Self { health: Health::Normal, turning: 0.0 }
    }

    pub(super) fn step(&mut self, dt: f64, start: bool) {
        let stays = match self.health {
            Health::Normal => true,
            Health::WillNotStart => self.has_voltage(),
            Health::Fails => false,
        };
        self.turning = if start && stays { self.turning + dt } else { 0.0 };
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
            (0..10 * seconds).for_each(|_| engine.step(0.1, start));
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
}
