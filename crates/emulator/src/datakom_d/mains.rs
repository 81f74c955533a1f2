//! Whether the mains are good, and since when: the delay before they count as failed, and the wait before the load
//! goes back to them.

use std::time::Duration;

use crate::plant::Feed;

use super::settings::MainsSettings;

/// Mains that have failed are back when they have been inside their limits for so long.
const BACK_AFTER: Duration = Duration::from_secs(1);

/// The mains as the unit judges them.
#[derive(Clone, Debug)]
pub(super) struct Mains {
    settings: MainsSettings,
    healthy: bool,
    /// How long what is measured has contradicted `healthy`.
    doubted: Duration,
    /// Left of the wait after they came back.
    waiting: Duration,
}

impl Mains {
    /// Good since long ago.
    pub(super) fn good() -> Self {
        Self {
            settings: MainsSettings::default(),
            healthy: true,
            doubted: Duration::ZERO,
            waiting: Duration::ZERO,
        }
    }

    pub(super) fn configure(&mut self, settings: &MainsSettings) {
        self.settings = settings.clone();
    }

    /// `in_order` says that the phases follow each other as they should.
    pub(super) fn step(&mut self, dt: Duration, feed: &Feed, in_order: bool) {
        if self.healthy {
            self.waiting = self.waiting.saturating_sub(dt);
        }
        if (in_order && self.within_limits(feed)) == self.healthy {
            self.doubted = Duration::ZERO;
            return;
        }
        self.doubted += dt;
        if self.doubted >= if self.healthy { self.settings.fail_delay } else { BACK_AFTER } {
            self.healthy = !self.healthy;
            self.doubted = Duration::ZERO;
            self.waiting = self.settings.waiting;
        }
    }

    /// Takes them for failed at once: something else than their limits says so.
    pub(super) fn lose(&mut self) {
        (self.healthy, self.doubted, self.waiting) = (false, Duration::ZERO, self.settings.waiting);
    }

    /// Not failed.
    pub(super) fn is_healthy(&self) -> bool {
        self.healthy
    }

    /// Healthy for long enough to hand the load back to them.
    pub(super) fn is_trusted(&self) -> bool {
        self.healthy && self.waiting.is_zero()
    }

    /// Not failed yet, but outside their limits.
    pub(super) fn is_failing(&self) -> bool {
        self.healthy && !self.doubted.is_zero()
    }

    /// What is left of the wait, while it runs.
    pub(super) fn wait(&self) -> Duration {
        if self.healthy { self.waiting } else { Duration::ZERO }
    }

    /// Mains that have failed must come back inside their limits by the hysteresis.
    fn within_limits(&self, feed: &Feed) -> bool {
        let MainsSettings { voltage: (low, high), hysteresis, frequency: (slow, fast), .. } = self.settings;
        let margin = if self.healthy { 0.0 } else { hysteresis };
        feed.voltage.iter().all(|phase| (low + margin..=high - margin).contains(phase))
            && (slow..=fast).contains(&feed.frequency)
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::Settings;
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn mains() -> Mains {
        let mut mains = Mains::good();
        mains.configure(&Settings::usual().mains);
        mains
    }

    fn pass(mains: &mut Mains, volts: f64, tenths: u32) {
        let feed = Feed { voltage: [231.0, 231.0, volts], frequency: 50.0, ..Feed::default() };
        for _ in 0..tenths {
            mains.step(TENTH, &feed, true);
        }
    }

    #[test]
    fn one_phase_outside_its_limits_is_a_failure_after_the_delay() {
        let mut mains = mains();
        let delay = mains.settings.fail_delay.as_millis() as u32 / 100;
        pass(&mut mains, 180.0, delay - 1);
        assert!(mains.is_healthy() && mains.is_failing(), "a dip is none");
        pass(&mut mains, 231.0, 1);
        assert!(!mains.is_failing());
        pass(&mut mains, 180.0, delay);
        assert!(!mains.is_healthy());
    }

    #[test]
    fn a_return_has_hysteresis_and_a_wait() {
        let mut mains = mains();
        pass(&mut mains, 0.0, 100);
        let inside = mains.settings.voltage.0 + mains.settings.hysteresis / 2.0;
        pass(&mut mains, inside, 50);
        assert!(!mains.is_healthy(), "inside the hysteresis");
        pass(&mut mains, 231.0, 10);
        assert!(mains.is_healthy() && !mains.is_trusted());
        assert_eq!(mains.wait(), mains.settings.waiting);
        let waiting = mains.settings.waiting.as_millis() as u32 / 100;
        pass(&mut mains, 231.0, waiting - 1);
        assert!(!mains.is_trusted());
        pass(&mut mains, 231.0, 1);
        assert!(mains.is_trusted());
    }

    #[test]
    fn phases_in_the_wrong_order_are_no_mains() {
        let mut mains = mains();
        let feed = Feed { voltage: [231.0; 3], frequency: 50.0, ..Feed::default() };
        for _ in 0..100 {
            mains.step(TENTH, &feed, false);
        }
        assert!(!mains.is_healthy());
    }
}
