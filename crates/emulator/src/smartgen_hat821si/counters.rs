//! Supply times, and the controller's calendar.

use std::time::Duration;

use busbar_profile::{DateTime, TimePart};

use crate::random::Random;

/// How long a bus section has had voltage.
#[derive(Clone, Debug)]
pub(super) struct SupplyTime {
    pub(super) present: Duration,
    pub(super) last: Duration,
    pub(super) total: Duration,
}

impl SupplyTime {
    /// `own` is how long the section's own source has fed it; the rest came over the tie.
    pub(super) fn new(own: Duration, random: &mut Random) -> Self {
        let mut seconds = |low, high| Duration::from_secs(random.between(low, high) as u64);
        Self {
            present: seconds(3.0e5, 2.0e6),
            last: seconds(3.0e5, 4.0e6),
            total: own + seconds(2.0e5, 2.0e6),
        }
    }

    pub(super) fn step(&mut self, dt: Duration, alive: bool) {
        if alive {
            self.present += dt;
            self.total += dt;
        } else if !self.present.is_zero() {
            self.last = std::mem::take(&mut self.present);
        }
    }
}

/// Hours, minutes and seconds as three registers have them.
pub(super) fn parts(time: Duration) -> [i64; 3] {
    let seconds = time.as_secs();
    [seconds / 3600, seconds / 60 % 60, seconds % 60].map(|part| part as i64)
}

/// Year, month, day, day of the week (0 is Sunday), hour, minute and second after this much time in service. A
/// controller is switched on at ten in the morning of Monday, 5 January 2026.
pub(super) fn calendar(passed: Duration) -> [i64; 7] {
    const DAY: u64 = 86_400;
    let (Some(switched_on), Some(sunday)) =
        (DateTime::new(2026, 1, 5, 10, 0, 0), DateTime::new(2026, 1, 4, 0, 0, 0))
    else {
        return [0; 7];
    };
    let now = switched_on.plus(passed);
    let weekday = now.distance(sunday).as_secs() / DAY % 7;
    let part = |part| i64::from(now.part(part));
    [
        part(TimePart::Year),
        part(TimePart::Month),
        part(TimePart::Day),
        weekday as i64,
        part(TimePart::Hour),
        part(TimePart::Minute),
        part(TimePart::Second),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_ends_one_supply_and_begins_another() {
        let second = Duration::from_secs(1);
        let mut time = SupplyTime::new(second * 9_000_000, &mut Random::new(1));
        let before = time.clone();
        time.step(second, true);
        assert_eq!((time.present, time.total), (before.present + second, before.total + second));
        time.step(second, false);
        time.step(second, false);
        assert_eq!((time.present, time.last), (Duration::ZERO, before.present + second));
        assert_eq!(time.total, before.total + second);
    }

    #[test]
    fn times_come_in_three_parts() {
        assert_eq!(parts(Duration::from_secs(3600 * 7000 + 59 * 60 + 58)), [7000, 59, 58]);
    }

    #[test]
    fn the_calendar_runs_on_over_days_and_months() {
        let hours = |hours: u64| Duration::from_secs(hours * 3600);
        assert_eq!(calendar(Duration::ZERO), [26, 1, 5, 1, 10, 0, 0]);
        assert_eq!(calendar(hours(14)), [26, 1, 6, 2, 0, 0, 0]);
        assert_eq!(calendar(hours(6 * 24) + Duration::from_millis(61_900)), [26, 1, 11, 0, 10, 1, 1]);
        assert_eq!(calendar(hours(27 * 24)), [26, 2, 1, 0, 10, 0, 0]);
    }
}
