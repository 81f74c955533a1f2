//! The clock of one plant: it runs as fast as it is told, stands still, or is let go on by hand.

use std::time::Duration;

use busbar_profile::text::shown;

use crate::MAX_SPEED;

/// A clock that was held up (a sleeping laptop, a debugger) does not make up for more than this.
const MOST_LAPSE: Duration = Duration::from_secs(2);

/// So much simulated time of one plant passes at once: clients wait no longer than that takes.
pub(super) const STRIDE: Duration = Duration::from_secs(10);

/// How a simulated clock runs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Pace {
    /// Simulated seconds a second while it runs.
    pub speed: f64,
    /// It stands still, but for steps by hand.
    pub paused: bool,
}

/// No simulated clock runs like that.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("speed {} is not possible, choose a number above 0 and up to {MAX_SPEED}", shown(.speed))]
pub struct SpeedError {
    /// What was asked for, as text.
    pub speed: String,
}

/// Simulated time since power-on, and how it goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    pace: Pace,
    simulated: Duration,
}

impl Pace {
    /// Whether a clock can run so fast.
    ///
    /// # Errors
    /// It is not above 0, or above [`MAX_SPEED`].
    pub fn check(speed: f64) -> Result<(), SpeedError> {
        match speed > 0.0 && speed <= MAX_SPEED {
            true => Ok(()),
            false => Err(SpeedError { speed: speed.to_string() }),
        }
    }
}

impl Clock {
    /// A clock at power-on that runs at a speed that [`Pace::check`] lets pass.
    pub(super) fn new(speed: f64) -> Self {
        Self { pace: Pace { speed, paused: false }, simulated: Duration::ZERO }
    }

    pub(super) fn pace(&self) -> Pace {
        self.pace
    }

    pub(super) fn pause(&mut self, paused: bool) {
        self.pace.paused = paused;
    }

    pub(super) fn run_at(&mut self, speed: f64) -> Result<(), SpeedError> {
        Pace::check(speed)?;
        self.pace.speed = speed;
        Ok(())
    }

    /// How much simulated time is to pass in so much real time.
    pub(super) fn due(&self, real: Duration) -> Duration {
        match self.pace.paused {
            true => Duration::ZERO,
            false => real.min(MOST_LAPSE).mul_f64(self.pace.speed),
        }
    }

    /// Lets simulated time pass unless it is paused; gives the time that it is now.
    pub(super) fn run(&mut self, by: Duration) -> Duration {
        self.step(if self.pace.paused { Duration::ZERO } else { by })
    }

    /// Lets simulated time pass, paused or not; gives the time that it is now.
    pub(super) fn step(&mut self, by: Duration) -> Duration {
        self.simulated = self.simulated.saturating_add(by);
        self.simulated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn it_runs_stands_and_is_stepped() {
        let mut clock = Clock::new(60.0);
        assert_eq!(clock.due(SECOND), 60 * SECOND);
        assert_eq!(clock.run(60 * SECOND), 60 * SECOND);
        clock.pause(true);
        assert_eq!(clock.due(SECOND), Duration::ZERO);
        assert_eq!(clock.run(SECOND), 60 * SECOND, "whatever was due before");
        assert_eq!(clock.step(SECOND), 61 * SECOND);
        clock.run_at(2.0).unwrap();
        clock.pause(false);
        assert_eq!(clock.due(SECOND), 2 * SECOND);
        assert_eq!(clock.due(1000 * SECOND), 4 * SECOND, "it was held up");
    }

    #[test]
    fn no_speed_is_beyond_what_a_clock_can_keep() {
        let mut clock = Clock::new(1.0);
        for speed in [0.0, -1.0, MAX_SPEED * 1.01, f64::NAN, f64::INFINITY] {
            clock.run_at(speed).unwrap_err();
        }
        assert_eq!(clock.pace(), Pace { speed: 1.0, paused: false });
        clock.run_at(MAX_SPEED).unwrap();
    }
}
