//! Windows of the calendar: when a genset runs by the clock, and when it does not run.

use std::time::Duration;

use busbar_profile::DateTime;

use crate::settings::Settings;

use super::counters::calendar;

const DAY: u64 = 86_400;
/// A window that opens each day.
const DAILY: u64 = 7;

/// A window of each week, or of each day.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Window {
    /// 0 is Sunday, 7 is each day.
    weekday: u64,
    opens: Duration,
    length: Duration,
}

impl Window {
    /// By settings whose ids begin alike.
    pub(super) fn of(settings: &Settings, name: &str) -> Self {
        let number = |part: &str| settings.number(&format!("{name}_{part}")) as u64;
        Self {
            weekday: number("weekday"),
            opens: Duration::from_secs(3600 * number("hour") + 60 * number("minute")),
            length: Duration::from_secs(60 * number("length")),
        }
    }

    /// How much of it is left; none where it is closed.
    pub(super) fn left(self, now: DateTime) -> Option<Duration> {
        let [_, _, _, weekday, ..] = calendar(now);
        let today = u64::try_from(weekday).unwrap_or(0);
        let of_day = Duration::from_secs(now.distance(DateTime::FIRST).as_secs() % DAY);
        // It may have opened yesterday.
        [(today, of_day), ((today + 6) % 7, of_day + Duration::from_secs(DAY))]
            .into_iter()
            .filter(|(day, _)| self.weekday == DAILY || self.weekday == *day)
            .filter_map(|(_, since_midnight)| {
                let open_for = since_midnight.checked_sub(self.opens)?;
                self.length.checked_sub(open_for).filter(|left| !left.is_zero())
            })
            .max()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_opens_and_closes_over_midnight_and_by_the_day() {
        let minutes = |minutes| Duration::from_secs(60 * minutes);
        let window = |weekday, hour: u64, length| Window {
            weekday,
            opens: minutes(60 * hour),
            length: minutes(length),
        };
        // 2026-01-05 is a Monday.
        for (window, now, left) in [
            (window(1, 10, 30), "2026-01-05T10:00:00", Some(30)),
            (window(1, 10, 30), "2026-01-05T10:29:00", Some(1)),
            (window(1, 10, 30), "2026-01-05T10:30:00", None),
            (window(1, 10, 30), "2026-01-05T09:59:59", None),
            (window(2, 10, 30), "2026-01-05T10:10:00", None),
            (window(7, 10, 30), "2026-01-07T10:10:00", Some(20)),
            (window(0, 23, 120), "2026-01-05T00:30:00", Some(30)),
            (window(7, 23, 120), "2026-01-06T00:59:00", Some(1)),
            (window(1, 10, 0), "2026-01-05T10:00:00", None),
        ] {
            assert_eq!(window.left(now.parse().unwrap()), left.map(minutes), "{window:?} {now}");
        }
    }
}
