//! The two clocks of a controller: one that runs down, and one that asks how long something has been so.

use std::time::Duration;

/// Counts down to zero.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Countdown(Duration);

impl Countdown {
    pub(super) fn of(time: Duration) -> Self {
        Self(time)
    }

    pub(super) fn step(&mut self, dt: Duration) {
        self.0 = self.0.saturating_sub(dt);
    }

    pub(super) fn is_over(self) -> bool {
        self.0.is_zero()
    }

    /// What of it has not yet run.
    pub(super) fn left(self) -> Duration {
        self.0
    }

    /// Whole seconds that a delay register shows: 1 until the last one is over.
    pub(super) fn seconds(self) -> u16 {
        u16::try_from(self.0.as_millis().div_ceil(1000)).unwrap_or(u16::MAX)
    }
}

/// How long something has been so without a gap.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lasting(Option<Duration>);

impl Lasting {
    /// Whether it has been so for `long`; with a `long` of zero at once.
    pub(super) fn step(&mut self, dt: Duration, is_so: bool, long: Duration) -> bool {
        self.0 = is_so.then(|| self.0.map_or(Duration::ZERO, |time| time.saturating_add(dt)));
        self.0.is_some_and(|time| time >= long)
    }

    /// Begins anew.
    pub(super) fn restart(&mut self) {
        self.0 = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_countdown_shows_whole_seconds_until_it_is_over() {
        let mut left = Countdown::of(SECOND * 2);
        assert_eq!(left.seconds(), 2);
        left.step(Duration::from_millis(1100));
        assert_eq!((left.seconds(), left.is_over()), (1, false));
        left.step(SECOND);
        assert_eq!((left.seconds(), left.is_over()), (0, true));
    }

    #[test]
    fn what_lasts_is_forgotten_in_a_gap() {
        let mut lasting = Lasting::default();
        let walk = [true, true, true, false, true, true, true];
        let seen = walk.map(|is_so| lasting.step(SECOND, is_so, 2 * SECOND));
        assert_eq!(seen, [false, false, true, false, false, false, true]);
        assert!(Lasting::default().step(SECOND, true, Duration::ZERO));
    }
}
