//! Signals joined from several points: hours from hours, minutes and seconds, a clock from its parts.

use serde::Serialize;

use crate::clock::DateTime;
use crate::image::Image;
use crate::number::{Number, divide_half_even};
use crate::profile::Profile;
use crate::terms::{Quality, WordOrder};

/// Decimals of joined hours: 0.36 s.
const DECIMALS: u8 = 4;

/// A signal that several points make up; it exists as a signal only, the points stay as they are.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Joined {
    /// Id in the shared vocabulary.
    pub signal: String,
    /// What it is made of.
    pub parts: JoinedParts,
}

/// The points of a joined signal, by their index in the profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JoinedParts {
    /// A number of hours, to 4 decimals, halves to the even one.
    Hours {
        /// Whole hours.
        hours: usize,
        /// Minutes, 0 to 59.
        minutes: usize,
        /// Seconds, 0 to 59, where there are any.
        seconds: Option<usize>,
    },
    /// A local date and time.
    Clock {
        /// Years since 2000.
        year: usize,
        /// Month.
        month: usize,
        /// Day of the month.
        day: usize,
        /// Hour.
        hour: usize,
        /// Minute.
        minute: usize,
        /// Second.
        second: usize,
    },
}

/// The value of a joined signal and how far it can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct JoinedReading {
    /// The value; none unless `quality` is good.
    pub value: Option<JoinedValue>,
    /// Good; or invalid where a part has no value, or is none of an hour or of the calendar.
    pub quality: Quality,
}

/// What a joined signal can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum JoinedValue {
    /// Hours.
    Number(Number),
    /// A local date and time.
    Clock(DateTime),
}

impl JoinedReading {
    const INVALID: Self = Self { value: None, quality: Quality::Invalid };
}

impl Joined {
    /// The indexes of its points.
    pub fn points(&self) -> impl Iterator<Item = usize> + use<> {
        let (six, len) = match self.parts {
            JoinedParts::Hours { hours, minutes, seconds: None } => ([hours, minutes, 0, 0, 0, 0], 2),
            JoinedParts::Hours { hours, minutes, seconds: Some(seconds) } => {
                ([hours, minutes, seconds, 0, 0, 0], 3)
            }
            JoinedParts::Clock { year, month, day, hour, minute, second } => {
                ([year, month, day, hour, minute, second], 6)
            }
        };
        six.into_iter().take(len)
    }

    /// The value out of a device's image; none until all parts have been read.
    ///
    /// `profile` must be the one that it belongs to.
    pub fn reading(&self, profile: &Profile, image: &Image, order: WordOrder) -> Option<JoinedReading> {
        self.reading_of(profile, order, |index| image.registers(index))
    }

    /// The value out of the registers of its points, asked for by their index; none where one of them has none.
    ///
    /// `profile` must be the one that it belongs to.
    pub fn reading_of<'r>(
        &self,
        profile: &Profile,
        order: WordOrder,
        registers: impl Fn(usize) -> Option<&'r [u16]>,
    ) -> Option<JoinedReading> {
        let mut parts = [0; 6];
        let mut valid = true;
        for (part, index) in parts.iter_mut().zip(self.points()) {
            let point = profile.points.get(index)?;
            let value = point.decode(registers(index)?, order).value;
            match value.and_then(|value| value.as_number()?.as_integer()) {
                Some(number) => *part = number,
                None => valid = false,
            }
        }
        if !valid {
            return Some(JoinedReading::INVALID);
        }
        let value = match self.parts {
            JoinedParts::Hours { .. } => join_hours(parts[0], parts[1], parts[2]).map(JoinedValue::Number),
            JoinedParts::Clock { .. } => join_clock(parts).map(JoinedValue::Clock),
        };
        Some(match value {
            Some(value) => JoinedReading { value: Some(value), quality: Quality::Good },
            None => JoinedReading::INVALID,
        })
    }
}

fn join_hours(hours: i64, minutes: i64, seconds: i64) -> Option<Number> {
    if hours < 0 || !(0..60).contains(&minutes) || !(0..60).contains(&seconds) {
        return None;
    }
    let seconds = i128::from(hours) * 3600 + i128::from(minutes * 60 + seconds);
    let scaled = divide_half_even(seconds * 10_i128.pow(u32::from(DECIMALS)), 3600);
    Number::new(i64::try_from(scaled).ok()?, DECIMALS).map(Number::shortest)
}

fn join_clock(parts: [i64; 6]) -> Option<DateTime> {
    let mut words = [0_u16; 6];
    for (word, part) in words.iter_mut().zip(parts) {
        *word = u16::try_from(part).ok()?;
    }
    let [year, month, day, hour, minute, second] = words;
    DateTime::new(year.checked_add(2000)?, month, day, hour, minute, second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_are_exact_to_four_decimals() {
        let hours = |h, m, s| join_hours(h, m, s).map(|number| number.to_string());
        assert_eq!(hours(1234, 30, 0).as_deref(), Some("1234.5"));
        assert_eq!(hours(0, 0, 1).as_deref(), Some("0.0003"), "0.000277…");
        assert_eq!(hours(0, 0, 9).as_deref(), Some("0.0025"));
        // 0.01125 h and 0.01375 h lie half way: to the even digit.
        assert_eq!(hours(0, 0, 40).as_deref(), Some("0.0111"));
        assert_eq!(hours(0, 2, 42).as_deref(), Some("0.045"));
        assert_eq!(hours(65_535, 59, 59).as_deref(), Some("65535.9997"));
        assert_eq!(hours(4_294_967_295, 59, 59).as_deref(), Some("4294967295.9997"));
        assert_eq!((hours(1, 60, 0), hours(1, 0, 60), hours(1, -1, 0)), (None, None, None));
    }

    #[test]
    fn a_clock_is_of_the_calendar() {
        let clock = |parts| join_clock(parts).map(|clock| clock.to_string());
        assert_eq!(clock([26, 11, 23, 5, 19, 51]).as_deref(), Some("2026-11-23T05:19:51"));
        assert_eq!(clock([28, 2, 29, 23, 59, 59]).as_deref(), Some("2028-02-29T23:59:59"));
        for parts in
            [[26, 2, 29, 0, 0, 0], [26, 0, 1, 0, 0, 0], [26, 1, 1, 24, 0, 0], [65_535, 1, 1, 0, 0, 0]]
        {
            assert_eq!(clock(parts), None, "{parts:?}");
        }
    }
}
