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

/// Year, month, day, day of the week (0 is Sunday), hour, minute and second.
pub(super) fn calendar(now: DateTime) -> [i64; 7] {
    const DAY: u64 = 86_400;
    const SATURDAY: u64 = 6;
    let weekday = (now.distance(DateTime::FIRST).as_secs() / DAY + SATURDAY) % 7;
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
    fn the_calendar_knows_the_day_of_the_week() {
        let at = |time: &str| calendar(time.parse().unwrap());
        assert_eq!(at("2026-01-05T10:00:00"), [26, 1, 5, 1, 10, 0, 0]);
        assert_eq!(at("2026-01-06T00:00:00"), [26, 1, 6, 2, 0, 0, 0]);
        assert_eq!(at("2026-01-11T10:01:01"), [26, 1, 11, 0, 10, 1, 1]);
        assert_eq!(at("2028-02-29T23:59:59"), [28, 2, 29, 2, 23, 59, 59]);
    }
}
