//! Local date and time as controllers keep it: six numbers and no zone.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use serde::{Serialize, Serializer};

use crate::terms::TimePart;

const DAY_S: u64 = 86_400;
/// 200 years: no clock is looked at so far ahead.
const END_S: u64 = 73_048 * DAY_S;
/// The year that a controller's year 0 stands for.
const EPOCH: u16 = 2000;
/// The last year that can be told from two digits and the one more that a manual allows.
const LAST: u16 = 2100;

/// A local date and time from 2000 on, without a zone; shown as `2026-11-23T05:19:51`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DateTime {
    /// Since the first instant of 2000, by the same local clock.
    since: Duration,
}

/// A text that is no date and time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no local date and time; write it as 2026-11-23T05:19:51")]
pub struct ParseDateTimeError {
    /// What was found.
    pub found: String,
}

impl DateTime {
    /// The first instant of 2000, a Saturday.
    pub const FIRST: Self = Self { since: Duration::ZERO };

    /// None unless it is a day of the calendar from 2000 to 2100 and a time of a day.
    pub fn new(year: u16, month: u16, day: u16, hour: u16, minute: u16, second: u16) -> Option<Self> {
        let in_range = (EPOCH..=LAST).contains(&year)
            && (1..=12).contains(&month)
            && (1..=days_of(year, month)).contains(&day)
            && hour < 24
            && minute < 60
            && second < 60;
        if !in_range {
            return None;
        }
        let years: u64 = (EPOCH..year).map(|year| 365 + u64::from(is_leap(year))).sum();
        let months: u64 = (1..month).map(|month| u64::from(days_of(year, month))).sum();
        let days = years + months + u64::from(day) - 1;
        let seconds = u64::from(hour) * 3600 + u64::from(minute) * 60 + u64::from(second);
        Some(Self { since: Duration::from_secs(days * DAY_S + seconds) })
    }

    /// The same clock, later; it stops after 200 years.
    pub fn plus(self, later: Duration) -> Self {
        Self { since: self.since.saturating_add(later).min(Duration::from_secs(END_S)) }
    }

    /// How far apart two readings of the clock are.
    pub const fn distance(self, other: Self) -> Duration {
        self.since.abs_diff(other.since)
    }

    /// One of its numbers as a controller keeps it: the year is counted from 2000.
    pub fn part(self, part: TimePart) -> u16 {
        let (year, month, day) = self.date();
        let second = self.since.as_secs() % DAY_S;
        match part {
            TimePart::Year => year - EPOCH,
            TimePart::Month => month,
            TimePart::Day => day,
            TimePart::Hour => (second / 3600) as u16,
            TimePart::Minute => (second / 60 % 60) as u16,
            TimePart::Second => (second % 60) as u16,
        }
    }

    fn date(self) -> (u16, u16, u16) {
        let mut days = self.since.as_secs() / DAY_S;
        let mut year = EPOCH;
        while days >= 365 + u64::from(is_leap(year)) {
            days -= 365 + u64::from(is_leap(year));
            year = year.saturating_add(1);
        }
        let mut month = 1;
        while days >= u64::from(days_of(year, month)) {
            days -= u64::from(days_of(year, month));
            month += 1;
        }
        (year, month, days as u16 + 1)
    }
}

impl fmt::Display for DateTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (year, month, day) = self.date();
        let [hour, minute, second] =
            [TimePart::Hour, TimePart::Minute, TimePart::Second].map(|part| self.part(part));
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}")
    }
}

impl FromStr for DateTime {
    type Err = ParseDateTimeError;

    fn from_str(text: &str) -> Result<Self, ParseDateTimeError> {
        parse(text).ok_or_else(|| ParseDateTimeError { found: text.to_owned() })
    }
}

impl Serialize for DateTime {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

fn parse(text: &str) -> Option<DateTime> {
    let (date, time) = text.split_once(['T', ' '])?;
    let [year, month, day] = numbers(date, '-', [4, 2, 2])?;
    let [hour, minute, second] = numbers(time, ':', [2, 2, 2])?;
    DateTime::new(year, month, day, hour, minute, second)
}

fn numbers(text: &str, between: char, widths: [usize; 3]) -> Option<[u16; 3]> {
    let mut numbers = [0; 3];
    let mut parts = text.split(between);
    for (number, width) in numbers.iter_mut().zip(widths) {
        let part = parts.next().filter(|part| part.len() == width)?;
        *number = part.bytes().all(|b| b.is_ascii_digit()).then(|| part.parse().ok())??;
    }
    parts.next().is_none().then_some(numbers)
}

const fn is_leap(year: u16) -> bool {
    year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
}

fn days_of(year: u16, month: u16) -> u16 {
    match month {
        2 => 28 + u16::from(is_leap(year)),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_day_of_the_century_is_itself() {
        let mut day = DateTime::new(2000, 1, 1, 12, 34, 56).unwrap();
        for _ in 0..36_525 + 365 {
            let [year, month, date] =
                [TimePart::Year, TimePart::Month, TimePart::Day].map(|part| day.part(part));
            assert_eq!(DateTime::new(year + 2000, month, date, 12, 34, 56), Some(day));
            assert_eq!(day.to_string().parse(), Ok(day));
            day = day.plus(Duration::from_secs(DAY_S));
        }
        assert_eq!(day.to_string(), "2101-01-01T12:34:56");
    }

    #[test]
    fn the_last_second_of_a_year_ends() {
        let eve: DateTime = "2026-12-31T23:59:59".parse().unwrap();
        let new_year = eve.plus(Duration::from_secs(1));
        assert_eq!(new_year.to_string(), "2027-01-01T00:00:00");
        assert_eq!(eve.distance(new_year), Duration::from_secs(1));
        assert_eq!(new_year.distance(eve), Duration::from_secs(1));
        assert_eq!((eve.part(TimePart::Year), eve.part(TimePart::Second)), (26, 59));
        assert_eq!("2028-02-29 00:00:00".parse::<DateTime>().unwrap().to_string(), "2028-02-29T00:00:00");
    }

    #[test]
    fn refuses_what_is_no_time() {
        for text in [
            "",
            "now",
            "2026-11-23",
            "2026-11-23T5:19:51",
            "2026-02-29T00:00:00",
            "2026-13-01T00:00:00",
            "2026-00-01T00:00:00",
            "1999-12-31T23:59:59",
            "2101-01-01T00:00:00",
            "2026-11-23T24:00:00",
            "2026-11-23T05:60:00",
            "2026-11-23T05:19:60",
            "2026-11-23T05:19:51Z",
            "2026-11-23T05:19:51.5",
            "2026-11-23-01T05:19:51",
            "+026-11-23T05:19:51",
        ] {
            let error = text.parse::<DateTime>().unwrap_err();
            assert!(error.to_string().starts_with(&format!("`{text}` is no local date")), "{error}");
        }
    }
}
