//! The clock at 0024h: six numbers, each written by itself.

use std::time::Duration;

use busbar_profile::{DateTime, TimePart};

/// Year, month, day, hour, minute and second, in the order of the registers.
///
/// A date that the calendar does not have can stand here between two writes; it lasts until midnight.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    parts: [u8; 6],
    /// Of the running second.
    passed: Duration,
}

const YEAR: usize = 0;
const MONTH: usize = 1;
const DAY: usize = 2;
const HOUR: usize = 3;
const MINUTE: usize = 4;
const SECOND: usize = 5;

/// What the table allows.
const RANGES: [(u8, u8); 6] = [(0, 99), (1, 12), (1, 31), (0, 23), (0, 59), (0, 59)];

impl Clock {
    /// A clock that begins a second at `time`; it has two digits for the year.
    pub(super) fn at(time: DateTime) -> Self {
        use TimePart::{Day, Hour, Minute, Month, Second, Year};
        let parts = [Year, Month, Day, Hour, Minute, Second].map(|part| (time.part(part) % 100) as u8);
        Self { parts, passed: Duration::ZERO }
    }

    pub(super) fn parts(&self) -> [u8; 6] {
        self.parts
    }

    pub(super) fn day(&self) -> u8 {
        self.parts[DAY]
    }

    pub(super) fn minute(&self) -> u8 {
        self.parts[MINUTE]
    }

    /// Since Monday 00:00.
    pub(super) fn hour_of_the_week(&self) -> u16 {
        let [year, month, day, hour, ..] = self.parts;
        let leap_days = u16::from(year).div_ceil(4);
        let months: u16 = (1..month).map(|month| u16::from(days_of(year, month))).sum();
        let days = 365 * u16::from(year) + leap_days + months + u16::from(day) - 1;
        // The first of January 2000 was a Saturday.
        (days + 5) % 7 * 24 + u16::from(hour)
    }

    pub(super) fn step(&mut self, dt: Duration) {
        self.passed += dt;
        while let Some(rest) = self.passed.checked_sub(Duration::from_secs(1)) {
            self.passed = rest;
            self.tick();
        }
    }

    /// Takes one number; one out of its range has no effect. A second that is set begins now.
    pub(super) fn set(&mut self, part: usize, value: u8) {
        let fits = RANGES.get(part).is_some_and(|(least, most)| (*least..=*most).contains(&value));
        if !fits {
            return;
        }
        self.parts[part] = value;
        if part == SECOND {
            self.passed = Duration::ZERO;
        }
    }

    fn tick(&mut self) {
        for part in [SECOND, MINUTE, HOUR, DAY, MONTH, YEAR] {
            let (least, most) = match part {
                DAY => (1, days_of(self.parts[YEAR], self.parts[MONTH])),
                _ => RANGES[part],
            };
            if self.parts[part] < most {
                self.parts[part] += 1;
                return;
            }
            self.parts[part] = least;
        }
    }
}

/// Of 2000 to 2099, where every fourth year is a leap year.
fn days_of(year: u8, month: u8) -> u8 {
    match month {
        4 | 6 | 9 | 11 => 30,
        2 if year.is_multiple_of(4) => 29,
        2 => 28,
        _ => 31,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(parts: [u8; 6], seconds: u64) -> [u8; 6] {
        let mut clock = Clock { parts, passed: Duration::ZERO };
        clock.step(Duration::from_secs(seconds));
        clock.parts()
    }

    #[test]
    fn it_starts_at_any_time_and_keeps_two_digits_of_the_year() {
        let parts = |time: &str| Clock::at(time.parse().unwrap()).parts();
        assert_eq!(parts("2031-12-24T18:59:07"), [31, 12, 24, 18, 59, 7]);
        assert_eq!(parts("2100-02-28T00:00:00"), [0, 2, 28, 0, 0, 0]);
    }

    #[test]
    fn it_carries_as_the_calendar_does() {
        assert_eq!(after([26, 1, 1, 10, 0, 58], 3), [26, 1, 1, 10, 1, 1]);
        assert_eq!(after([26, 12, 31, 23, 59, 59], 1), [27, 1, 1, 0, 0, 0]);
        assert_eq!(after([99, 12, 31, 23, 59, 59], 1), [0, 1, 1, 0, 0, 0]);
        assert_eq!(after([28, 2, 28, 23, 59, 59], 1), [28, 2, 29, 0, 0, 0]);
        assert_eq!(after([26, 2, 28, 23, 59, 59], 1), [26, 3, 1, 0, 0, 0]);
        assert_eq!(after([26, 4, 30, 23, 59, 59], 1), [26, 5, 1, 0, 0, 0]);
    }

    #[test]
    fn the_week_begins_on_monday() {
        for (time, hour) in [
            ("2000-01-01T00:00:00", 5 * 24),
            ("2026-01-05T10:59:59", 10),
            ("2026-01-11T23:00:00", 167),
            ("2028-02-29T07:00:00", 24 + 7),
            ("2028-03-01T00:00:00", 2 * 24),
            ("2099-12-31T01:00:00", 3 * 24 + 1),
        ] {
            assert_eq!(Clock::at(time.parse().unwrap()).hour_of_the_week(), hour, "{time}");
        }
    }

    #[test]
    fn a_date_outside_the_calendar_ends_at_midnight() {
        assert_eq!(after([26, 2, 31, 23, 59, 58], 1), [26, 2, 31, 23, 59, 59]);
        assert_eq!(after([26, 2, 31, 23, 59, 58], 2), [26, 3, 1, 0, 0, 0]);
    }

    #[test]
    fn tenths_add_up_to_seconds_and_a_new_second_begins_when_it_is_set() {
        let mut clock = Clock::at("2026-01-01T10:00:00".parse().unwrap());
        for _ in 0..19 {
            clock.step(Duration::from_millis(100));
        }
        assert_eq!(clock.parts(), [26, 1, 1, 10, 0, 1]);
        clock.set(SECOND, 30);
        clock.step(Duration::from_millis(900));
        assert_eq!(clock.parts()[SECOND], 30);
    }
}
