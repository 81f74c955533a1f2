//! The exerciser: a test that the clock starts and its duration ends.

use std::time::Duration;

use super::Mode;
use super::clock::Clock;
use super::parameters::{Every, Exercise};

/// What runs, and what comes after it.
#[derive(Clone, Debug)]
pub(super) struct Exerciser {
    /// Left of the exercise, and the mode that it interrupted.
    running: Option<(Duration, Mode)>,
    /// Of the week; a start needs a change.
    hour: u16,
}

impl Exerciser {
    /// One that is fitted at this time: an hour that has begun already starts nothing.
    pub(super) fn at(clock: &Clock) -> Self {
        Self { running: None, hour: clock.hour_of_the_week() }
    }

    pub(super) fn is_on(&self) -> bool {
        self.running.is_some()
    }

    /// Begins an exercise that somebody wants.
    pub(super) fn begin(&mut self, duration: Duration, interrupted: Mode) {
        self.running = Some((duration, interrupted));
    }

    /// Somebody has chosen a mode: what ran is over.
    pub(super) fn cancel(&mut self) {
        self.running = None;
    }

    /// Lets time pass; the mode that the unit goes to, where it goes to another.
    pub(super) fn step(&mut self, dt: Duration, clock: &Clock, set: &Exercise, mode: Mode) -> Option<Mode> {
        let hour = clock.hour_of_the_week();
        let begins = hour != self.hour && clock.minute() == 0;
        self.hour = hour;
        if let Some((left, interrupted)) = &mut self.running {
            *left = left.saturating_sub(dt);
            let ended = left.is_zero().then_some(*interrupted);
            if ended.is_some() {
                self.running = None;
            }
            return ended;
        }
        if !begins || mode != Mode::Auto || !is_due(hour, clock.day(), set) {
            return None;
        }
        self.begin(set.duration, mode);
        Some(if set.on_load { Mode::LoadTest } else { Mode::Test })
    }
}

/// Whether an hour of the week, on a day of the month, is one to exercise at.
fn is_due(hour: u16, day: u8, set: &Exercise) -> bool {
    let Some(wanted) = set.hour else { return false };
    match set.every {
        Every::Day => hour % 24 == wanted % 24,
        Every::Week => hour == wanted,
        Every::Month => hour == wanted && day <= 7,
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::site_with;
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    /// The modes that the unit goes to in two hours from a time on, and when.
    fn modes(from: &str, changes: &[(&str, &str)], mode: Mode) -> Vec<(u64, Mode)> {
        let set = site_with(changes).exercise;
        let mut clock = Clock::at(from.parse().unwrap());
        let (mut exerciser, mut mode) = (Exerciser::at(&clock), mode);
        let mut seen = Vec::new();
        for second in 1..7200 {
            clock.step(SECOND);
            if let Some(next) = exerciser.step(SECOND, &clock, &set, mode) {
                mode = next;
                seen.push((second, mode));
            }
        }
        seen
    }

    #[test]
    fn it_runs_at_its_hour_for_its_duration_and_goes_back() {
        // A Monday; ten o'clock is a minute away, and three steps are half an hour.
        let run = vec![(60, Mode::LoadTest), (60 + 1800, Mode::Auto)];
        let monday = "2026-01-05T09:59:00";
        assert_eq!(modes(monday, &[], Mode::Auto), run);
        assert_eq!(modes("2026-01-06T09:59:00", &[], Mode::Auto), [], "a Tuesday");
        assert_eq!(modes("2026-01-06T09:59:00", &[("exercise_every", "0")], Mode::Auto), run);
        assert_eq!(modes(monday, &[("exercise_every", "2")], Mode::Auto), run);
        assert_eq!(modes("2026-01-12T09:59:00", &[("exercise_every", "2")], Mode::Auto), [], "the second");
        assert_eq!(modes("2026-01-11T22:59:00", &[("exercise_time", "167")], Mode::Auto), run);
        let short = modes(monday, &[("exercise_duration", "0.1"), ("exercise_on_load", "0")], Mode::Auto);
        assert_eq!(short, [(60, Mode::Test), (660, Mode::Auto)]);
    }

    #[test]
    fn it_does_not_run_where_it_is_off_or_the_mode_is_not_auto_or_the_hour_has_begun() {
        let monday = "2026-01-05T09:59:00";
        for change in [("exercise_time", "168"), ("exercise_duration", "0")] {
            assert_eq!(modes(monday, &[change], Mode::Auto), [], "{change:?}");
        }
        assert_eq!(modes(monday, &[], Mode::Off), []);
        assert_eq!(modes("2026-01-05T10:00:00", &[], Mode::Auto), []);
    }
}
