//! When a device is polled next. Time is an argument.

use std::time::Duration;

use busbar_profile::Rate;

use crate::rates::Rates;
use crate::site::Poll;

/// A silent device is probed at least this often, so that its return is seen soon.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// Between two tries at least.
const LEAST_PAUSE: Duration = Duration::from_millis(10);

/// When each rate of a device is due.
#[derive(Debug)]
pub(crate) struct Schedule {
    poll: Poll,
    fast: Duration,
    slow: Duration,
    /// None when it is done.
    once: Option<Duration>,
    /// When it was last done.
    identified: Option<Duration>,
    /// The next probe of a device that is silent, and how many it left unanswered.
    silent: Option<(Duration, u32)>,
}

impl Schedule {
    /// Everything is due at `now`.
    pub(crate) fn new(poll: Poll, now: Duration) -> Self {
        Self { poll, fast: now, slow: now, once: Some(now), identified: None, silent: None }
    }

    /// When the next round begins. What is slow waits for the next fast round, so that they share reads.
    pub(crate) fn next(&self) -> Duration {
        match self.silent {
            Some((at, _)) => at,
            None => self.once.map_or(self.fast, |once| once.min(self.fast)),
        }
    }

    /// All that a round at `now` is to read.
    pub(crate) fn due(&self, now: Duration) -> Rates {
        let rates = [(Some(self.fast), Rate::Fast), (Some(self.slow), Rate::Slow), (self.once, Rate::Once)];
        let due = rates.into_iter().filter(|(at, _)| at.is_some_and(|at| at <= now));
        due.map(|(_, rate)| rate).collect()
    }

    pub(crate) fn is_silent(&self) -> bool {
        self.silent.is_some()
    }

    /// A round is finished and the device answered. Rounds that should have begun meanwhile are left out, so that a
    /// slow wire is never owed anything.
    pub(crate) fn done(&mut self, rates: Rates, now: Duration) {
        if self.silent.take().is_some() {
            // It was away: who knows what changed.
            *self = Self::new(self.poll, now);
        }
        for rate in rates.iter() {
            match rate {
                Rate::Fast => self.fast = following(self.fast, self.poll.fast, now),
                Rate::Slow => self.slow = following(self.slow, self.poll.slow, now),
                Rate::Once | Rate::OnDemand => (self.once, self.identified) = (None, Some(now)),
            }
        }
    }

    /// What is read once did not come: it is tried again with the slow points.
    pub(crate) fn missed_once(&mut self) {
        self.once = Some(self.slow);
    }

    /// What is read once is to be read again, but no more often than what is slow: there are devices that close each
    /// connection after one answer.
    pub(crate) fn identify(&mut self, now: Duration) {
        let earliest = self.identified.map_or(now, |identified| identified + self.poll.slow);
        let at = now.max(earliest);
        self.once = Some(self.once.map_or(at, |once| once.min(at)));
    }

    /// The device did not answer a round: the next try comes after a pause that grows.
    pub(crate) fn silent(&mut self, now: Duration) {
        let unanswered = self.silent.map_or(0, |(_, unanswered)| unanswered);
        let pause = self.poll.fast.saturating_mul(1 << unanswered.min(16));
        let pause = pause.min(LONGEST_PAUSE.max(self.poll.fast));
        self.silent = Some((now + pause, unanswered.saturating_add(1)));
    }

    /// The wire did not let a try through, for the sake of others on it, and will `again` after so long.
    pub(crate) fn held(&mut self, now: Duration, again: Duration) {
        let unanswered = self.silent.map_or(0, |(_, unanswered)| unanswered);
        self.silent = Some((now + again.max(LEAST_PAUSE), unanswered));
    }

    /// Something changed on the wire: a silent device is worth a probe at once.
    pub(crate) fn probe(&mut self, now: Duration) {
        if let Some((at, _)) = &mut self.silent {
            *at = now;
        }
    }
}

/// The first instant of the grid `due`, `due + interval`, ... that is after `now`.
fn following(due: Duration, interval: Duration, now: Duration) -> Duration {
    let next = due + interval;
    if next > now {
        return next;
    }
    let missed = (now - due).as_nanos() / interval.as_nanos().max(1);
    due + interval.saturating_mul(u32::try_from(missed).unwrap_or(u32::MAX).saturating_add(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const POLL: Poll = Poll { fast: Duration::from_secs(1), slow: Duration::from_secs(10) };

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn rates<const N: usize>(rates: [Rate; N]) -> Rates {
        Rates::from_iter(rates)
    }

    /// Runs every round that is due until `end`; a round takes `takes`.
    fn play(schedule: &mut Schedule, end: Duration, takes: Duration) -> Vec<(Rates, u64)> {
        let mut now = Duration::ZERO;
        let mut rounds = Vec::new();
        loop {
            now = now.max(schedule.next());
            if now > end {
                return rounds;
            }
            let due = schedule.due(now);
            rounds.push((due, now.as_millis() as u64));
            now += takes;
            schedule.done(due, now);
        }
    }

    fn of(rounds: &[(Rates, u64)], rate: Rate) -> Vec<u64> {
        rounds.iter().filter(|round| round.0.contains(rate)).map(|round| round.1).collect()
    }

    #[test]
    fn each_rate_has_its_beat_and_they_fall_together() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        let rounds = play(&mut schedule, ms(10_500), ms(10));
        assert_eq!(rounds[0], (rates([Rate::Fast, Rate::Slow, Rate::Once]), 0));
        assert_eq!(rounds[10], (rates([Rate::Fast, Rate::Slow]), 10_000));
        assert_eq!(of(&rounds, Rate::Once), [0]);
        assert_eq!(of(&rounds, Rate::Slow), [0, 10_000]);
        // The beat stays on the grid however long a round takes.
        assert_eq!(of(&rounds, Rate::Fast)[..3], [0, 1_000, 2_000]);
        assert_eq!(rounds.len(), 11, "no round is there for the slow points alone");
    }

    #[test]
    fn a_slow_beat_that_is_no_multiple_of_the_fast_one_waits_for_it() {
        let poll = Poll { fast: ms(1_000), slow: ms(2_500) };
        let mut schedule = Schedule::new(poll, Duration::ZERO);
        let rounds = play(&mut schedule, ms(10_500), ms(10));
        assert_eq!(of(&rounds, Rate::Slow), [0, 3_000, 5_000, 8_000, 10_000]);
        assert_eq!(rounds.len(), 11);
    }

    #[test]
    fn a_slow_wire_is_owed_nothing() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        let rounds = play(&mut schedule, ms(30_000), ms(2_500));
        assert!(of(&rounds, Rate::Slow).len() >= 3, "the slow rate is not starved: {rounds:?}");
        assert!(of(&rounds, Rate::Fast).len() >= 10, "and the fast one goes on: {rounds:?}");
    }

    #[test]
    fn a_new_identity_is_asked_for_at_once_and_a_missed_one_again() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        play(&mut schedule, ms(13_000), ms(1));
        schedule.identify(ms(13_100));
        assert_eq!((schedule.next(), schedule.due(ms(13_100))), (ms(13_100), rates([Rate::Once])));
        schedule.done(rates([Rate::Once]), ms(13_200));
        schedule.missed_once();
        assert_eq!((schedule.next(), schedule.due(ms(14_000))), (ms(14_000), rates([Rate::Fast])));
        assert_eq!(schedule.due(ms(20_000)), rates([Rate::Fast, Rate::Slow, Rate::Once]));
    }

    #[test]
    fn a_connection_that_is_made_anew_all_the_time_causes_no_storm() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        let (mut now, mut rounds) = (Duration::ZERO, Vec::new());
        while now <= ms(30_000) {
            let due = schedule.due(now);
            rounds.push((due, now.as_millis() as u64));
            now += ms(1);
            schedule.done(due, now);
            schedule.identify(now);
            now = now.max(schedule.next());
        }
        assert!(of(&rounds, Rate::Once).len() <= 4 && rounds.len() <= 34, "{rounds:?}");
    }

    #[test]
    fn a_silent_device_is_probed_ever_more_rarely() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        let mut now = Duration::ZERO;
        let mut pauses = Vec::new();
        for _ in 0..7 {
            schedule.silent(now);
            let due = schedule.next();
            pauses.push((due - now).as_secs());
            now = due;
        }
        assert_eq!(pauses, [1, 2, 4, 8, 10, 10, 10]);
        assert!(schedule.is_silent());

        // The wire came up again: no reason to wait.
        schedule.probe(now - ms(500));
        assert_eq!(schedule.next(), now - ms(500));
    }

    #[test]
    fn a_probe_that_the_wire_held_back_comes_when_it_lets_it_through() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        schedule.silent(ms(4_000));
        schedule.held(ms(5_000), ms(700));
        assert_eq!((schedule.next(), schedule.is_silent()), (ms(5_700), true));
        // It said nothing about the device: the pauses grow as if it had not been.
        schedule.silent(ms(6_700));
        assert_eq!(schedule.next(), ms(8_700));
        schedule.held(ms(8_700), Duration::ZERO);
        assert!(schedule.next() > ms(8_700), "never in the same instant");
    }

    #[test]
    fn after_silence_everything_is_read_again() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        play(&mut schedule, ms(3_000), ms(1));
        schedule.silent(ms(3_100));
        schedule.done(rates([Rate::Fast]), ms(5_000));
        assert!(!schedule.is_silent());
        assert_eq!((schedule.next(), schedule.due(ms(5_000))), (ms(5_000), rates([Rate::Slow, Rate::Once])));
        schedule.done(rates([Rate::Slow, Rate::Once]), ms(5_020));
        assert_eq!((schedule.next(), schedule.due(ms(6_000))), (ms(6_000), rates([Rate::Fast])));
        assert_eq!(schedule.due(ms(15_000)), rates([Rate::Fast, Rate::Slow]), "and they fall together again");
    }
}
