//! How long to wait for a unit: its measured latency, within limits.

use std::time::Duration;

/// After so many doublings every limit is reached.
const MOST_DOUBLINGS: u8 = 16;

/// Smoothed latency and deviation of one unit, as RFC 6298 has them for TCP, in microseconds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Timing {
    smoothed: u32,
    deviation: u32,
    /// Time-outs since the last measurement.
    doublings: u8,
    measured: bool,
}

impl Timing {
    /// An answer came after so long, the time of its characters on the line left out.
    pub(crate) fn measure(&mut self, latency: Duration) {
        let micros = u32::try_from(latency.as_micros()).unwrap_or(u32::MAX / 8).min(u32::MAX / 8);
        if self.measured {
            // Weights of 1/4 and 1/8.
            self.deviation = self.deviation - self.deviation / 4 + self.smoothed.abs_diff(micros) / 4;
            self.smoothed = self.smoothed - self.smoothed / 8 + micros / 8;
        } else {
            self.measured = true;
            (self.smoothed, self.deviation) = (micros, micros / 2);
        }
        self.doublings = 0;
    }

    /// No answer came in time.
    pub(crate) fn miss(&mut self) {
        self.doublings = (self.doublings + 1).min(MOST_DOUBLINGS);
    }

    /// How long the next request waits: the limit where nothing was measured.
    pub(crate) fn timeout(&self, floor: Duration, limit: Duration) -> Duration {
        if !self.measured {
            return limit;
        }
        // A steady latency is no promise: half of it at least is left for what may come between.
        let estimate = self.with_margin((4 * self.deviation).max(self.smoothed / 2));
        estimate.max(floor).saturating_mul(1 << self.doublings).min(limit)
    }

    /// How long a probe waits; none where nothing was measured. It can be short: if the answer comes later, that is
    /// heard too.
    pub(crate) fn probe(&self, floor: Duration, limit: Duration) -> Option<Duration> {
        self.measured.then(|| self.with_margin(self.smoothed / 2).max(floor).min(limit))
    }

    fn with_margin(&self, margin: u32) -> Duration {
        Duration::from_micros(u64::from(self.smoothed) + u64::from(margin))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    #[test]
    fn follows_what_was_measured_within_limits() {
        let (floor, limit) = (ms(200), ms(3000));
        let mut timing = Timing::default();
        let timeout = |timing: &Timing| timing.timeout(floor, limit).as_millis();
        assert_eq!(timeout(&timing), 3000, "nothing is known");

        timing.measure(ms(600));
        assert_eq!(timeout(&timing), 1800, "one measurement is little");
        (0..40).for_each(|_| timing.measure(ms(600)));
        assert_eq!(timeout(&timing), 900);
        timing.measure(ms(1400));
        assert_eq!(timeout(&timing), 1500, "one that is late makes it wait");
        assert_eq!(timing.probe(floor, limit), Some(ms(1050)), "but not a probe");
        (0..60).for_each(|_| timing.measure(ms(2)));
        assert_eq!(timeout(&timing), 200, "the floor");

        for doubled in [400, 800, 1600, 3000, 3000] {
            timing.miss();
            assert_eq!(timeout(&timing), doubled);
        }
        assert_eq!(timing.probe(floor, limit), Some(ms(200)));
        timing.measure(ms(2));
        assert_eq!(timeout(&timing), 200);
        (0..60).for_each(|_| timing.measure(Duration::MAX));
        assert_eq!(timeout(&timing), 3000, "the limit");
        assert_eq!(timing.timeout(floor, ms(50)), ms(50), "which is below the floor if it likes");
    }
}
