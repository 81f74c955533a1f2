//! Whether the mains are good, and since when: the wait before the load goes back to them.

use std::time::Duration;

use crate::plant::Feed;

use super::parameters::MainsLimits;

/// V below which a phase has none.
const DEAD: f64 = 50.0;

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

    pub(super) fn step(&mut self, dt: Duration, feed: &Feed, limits: &MainsLimits) {
        if self.healthy {
            self.waiting = self.waiting.saturating_sub(dt);
        }
        if within_limits(feed, self.healthy, limits) == self.healthy {
            self.doubted = Duration::ZERO;
            return;
        }
        self.doubted += dt;
        if self.doubted >= if self.healthy { limits.fail } else { limits.back } {
            self.healthy = !self.healthy;
            self.doubted = Duration::ZERO;
            self.waiting = limits.waiting;
        }
    }

    /// Takes them for failed, whatever their voltage: they must prove themselves anew.
    pub(super) fn condemn(&mut self) {
        self.healthy = false;
        self.doubted = Duration::ZERO;
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

/// Whether all phases are there and follow each other the wrong way round.
pub(super) fn is_order_wrong(feed: &Feed) -> bool {
    feed.phase_order_wrong && feed.voltage.iter().all(|phase| *phase > DEAD)
}

/// Mains that have failed must come back inside their limits by the hysteresis. A limit of 0 is not watched.
fn within_limits(feed: &Feed, were_healthy: bool, limits: &MainsLimits) -> bool {
    let margin = if were_healthy { 0.0 } else { limits.hysteresis };
    let between = |value: f64, low: f64, high: f64, margin: f64| {
        (low == 0.0 || value >= low + margin) && (high == 0.0 || value <= high - margin)
    };
    feed.voltage.iter().all(|phase| *phase > DEAD && between(*phase, limits.low, limits.high, margin))
        && between(feed.frequency, limits.low_frequency, limits.high_frequency, 0.0)
        && (limits.any_order || !is_order_wrong(feed))
}

#[cfg(test)]
mod tests {
    use super::super::parameters::{site, site_with};
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn feed(volts: f64) -> Feed {
        Feed { voltage: [231.0, 231.0, volts], frequency: 50.0, ..Feed::default() }
    }

    fn pass(mains: &mut Mains, volts: f64, tenths: u32) {
        for _ in 0..tenths {
            mains.step(TENTH, &feed(volts), &site().mains);
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

    #[test]
    fn every_limit_counts_where_it_is_watched() {
        let reversed = Feed { phase_order_wrong: true, ..feed(231.0) };
        for (feed, parameter) in [
            (feed(180.0), ("mains_voltage_low_limit", "0")),
            (feed(270.0), ("mains_voltage_high_limit", "0")),
            (Feed { frequency: 46.0, ..feed(231.0) }, ("mains_frequency_low", "0")),
            (Feed { frequency: 54.0, ..feed(231.0) }, ("mains_frequency_high", "0")),
            (reversed, ("ignore_phase_order", "1")),
        ] {
            assert!(!within_limits(&feed, true, &site().mains), "{parameter:?}");
            assert!(within_limits(&feed, true, &site_with(&[parameter]).mains), "{parameter:?}");
        }
        let unwatched = site_with(&[("mains_voltage_low_limit", "0"), ("mains_frequency_low", "0")]);
        assert!(!within_limits(&feed(0.0), true, &unwatched.mains), "a dead phase is never good");
    }

    #[test]
    fn condemned_mains_must_prove_themselves() {
        let mut mains = Mains::GOOD;
        mains.condemn();
        pass(&mut mains, 231.0, 9);
        assert!(!mains.is_healthy());
        pass(&mut mains, 231.0, 1);
        assert!(mains.is_healthy() && !mains.is_trusted());
    }
}
