//! Ten maintenance countdowns, in hours that the engine runs.

use crate::random::Random;

use super::setup::Setup;

/// When each service is due, in seconds of total running time.
#[derive(Clone, Debug)]
pub(super) struct Services {
    due: [u64; 10],
    intervals: [u64; 10],
}

impl Services {
    /// Countdowns of a unit that has been in use for a while.
    pub(super) fn new(total: u64, setup: &Setup, random: &mut Random) -> Self {
        let intervals = setup.services.map(|service| service.interval);
        let due = intervals.map(|interval| total + (interval as f64 * random.between(0.2, 0.9)) as u64);
        Self { due, intervals }
    }

    /// Another interval begins its countdown anew.
    pub(super) fn configure(&mut self, total: u64, setup: &Setup) {
        for ((due, interval), service) in self.due.iter_mut().zip(&mut self.intervals).zip(setup.services) {
            if *interval != service.interval {
                *interval = service.interval;
                *due = total + service.interval;
            }
        }
    }

    /// Seconds of running left of each.
    pub(super) fn left(&self, total: u64) -> [u64; 10] {
        self.due.map(|due| due.saturating_sub(total))
    }

    /// Somebody sets a countdown, or does the service where no time is given. Numbers start at 0.
    pub(super) fn set(&mut self, service: usize, seconds: Option<u64>, total: u64) {
        if let (Some(due), Some(interval)) = (self.due.get_mut(service), self.intervals.get(service)) {
            *due = total + seconds.unwrap_or(*interval);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_countdown_ends_at_0_and_begins_anew_when_the_service_is_done_or_another_interval_is_set() {
        let mut services = Services::new(1000, &Setup::with(&[]), &mut Random::new(1));
        let left = |services: &Services, total: u64| services.left(total)[4];
        let first = left(&services, 1000);
        assert!((180_000..=810_000).contains(&first), "{first}");
        assert_eq!(left(&services, 1000 + first), 0);
        assert_eq!(left(&services, 1000 + 2 * first), 0);
        services.set(4, None, 5000);
        assert_eq!(left(&services, 5000), 250 * 3600);
        services.configure(6000, &Setup::with(&[]));
        assert_eq!(left(&services, 6000), 250 * 3600 - 1000);
        services.configure(6000, &Setup::with(&[("maintenance_5_interval", "2")]));
        assert_eq!(left(&services, 6000), 7200);
        services.set(4, Some(90), 6000);
        assert_eq!(left(&services, 6010), 80);
        assert_eq!(
            services.left(6010)[3],
            Services::new(1000, &Setup::with(&[]), &mut Random::new(1)).left(6010)[3]
        );
    }
}
