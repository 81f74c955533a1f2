//! Hours and days since the last service, and what is left until the next ones.

use crate::random::Random;

/// What the unit remembers of its service.
#[derive(Clone, Debug)]
pub(super) struct Service {
    /// Engine hours at the last one.
    hours: f64,
    /// Days that had passed since then when the unit was switched on; less than nothing where it was later.
    days: f64,
}

impl Service {
    /// The last one was some weeks ago.
    pub(super) fn new(hours: f64, random: &mut Random) -> Self {
        let days = random.between(20.0, 90.0);
        Self { hours: hours - random.between(20.0, 110.0), days }
    }

    /// Hours and days since then; `time` is in seconds since the unit was switched on.
    pub(super) fn since(&self, hours: f64, time: f64) -> [f64; 2] {
        [hours - self.hours, self.days + time / 86_400.0]
    }

    /// It has been done just now.
    pub(super) fn done(&mut self, hours: f64, time: f64) {
        (self.hours, self.days) = (hours, -time / 86_400.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_starts_hours_and_days_anew() {
        let mut service = Service::new(1000.0, &mut Random::new(1));
        let [hours, days] = service.since(1000.0, 0.0);
        assert!((20.0..110.0).contains(&hours) && (20.0..90.0).contains(&days));
        service.done(1010.0, 7200.0);
        let [hours, days] = service.since(1012.0, 7200.0 + 86_400.0);
        assert!((hours - 2.0).abs() < 1e-9 && (days - 1.0).abs() < 1e-9);
    }
}
