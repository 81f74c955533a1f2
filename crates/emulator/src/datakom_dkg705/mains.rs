//! Whether the mains are good, and since when: the wait before the load goes back to them.

use std::time::Duration;

use crate::plant::Feed;

use super::settings::SITE;

/// How long a fault must last to be one, and a return.
const FAILED_AFTER: Duration = Duration::from_millis(300);
const BACK_AFTER: Duration = Duration::from_secs(1);
/// The table has no limits for the mains frequency: these are wide.
const HERTZ: std::ops::RangeInclusive<f64> = 47.0..=53.0;

/// The mains as the unit judges them.
#[derive(Clone, Debug)]
pub(super) struct Mains {
    healthy: bool,
    /// How long the voltage has contradicted `healthy`.
    doubted: Duration,
    /// Left of the wait after they came back.
    waiting: Duration,
}

impl Mains {
    /// Good since long ago.
    pub(super) const GOOD: Self = Self { healthy: true, doubted: Duration::ZERO, waiting: Duration::ZERO };

    pub(super) fn step(&mut self, dt: Duration, feed: &Feed) {
        if self.healthy {
            self.waiting = self.waiting.saturating_sub(dt);
        }
        if within_limits(feed, self.healthy) == self.healthy {
            self.doubted = Duration::ZERO;
            return;
        }
        self.doubted += dt;
        if self.doubted >= if self.healthy { FAILED_AFTER } else { BACK_AFTER } {
            self.healthy = !self.healthy;
            self.doubted = Duration::ZERO;
            self.waiting = Duration::from_secs(SITE.mains_waiting);
        }
    }

    /// Inside their limits at this moment.
    pub(super) fn is_healthy(&self) -> bool {
        self.healthy
    }

    /// Healthy for long enough to hand the load back to them.
    pub(super) fn is_trusted(&self) -> bool {
        self.healthy && self.waiting.is_zero()
    }

    /// What is left of the wait, while it runs.
    pub(super) fn wait(&self) -> Duration {
        if self.healthy { self.waiting } else { Duration::ZERO }
    }
}

/// Mains that have failed must come back inside their limits by the hysteresis.
fn within_limits(feed: &Feed, were_healthy: bool) -> bool {
    let margin = if were_healthy { 0.0 } else { SITE.hysteresis_voltage };
    let volts = SITE.mains_voltage_low + margin..=SITE.mains_voltage_high - margin;
    feed.voltage.iter().all(|phase| volts.contains(phase)) && HERTZ.contains(&feed.frequency)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn pass(mains: &mut Mains, volts: f64, tenths: u32) {
        let feed = Feed { voltage: [231.0, 231.0, volts], frequency: 50.0, ..Feed::default() };
        for _ in 0..tenths {
            mains.step(TENTH, &feed);
        }
    }

    #[test]
    fn one_phase_below_its_limit_is_a_failure_and_the_return_has_hysteresis_and_a_wait() {
        let mut mains = Mains::GOOD;
        pass(&mut mains, 180.0, 2);
        assert!(mains.is_healthy(), "a flicker is none");
        pass(&mut mains, 231.0, 1);
        pass(&mut mains, 180.0, 3);
        assert!(!mains.is_healthy());
        pass(&mut mains, 188.0, 50);
        assert!(!mains.is_healthy(), "inside the hysteresis");
        pass(&mut mains, 231.0, 10);
        assert!(mains.is_healthy() && !mains.is_trusted());
        assert_eq!(mains.wait(), Duration::from_secs(20));
        pass(&mut mains, 231.0, 199);
        assert!(!mains.is_trusted());
        pass(&mut mains, 231.0, 1);
        assert!(mains.is_trusted());
    }
}
