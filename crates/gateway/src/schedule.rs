//! When a device is polled next. Time is an argument.

use std::time::Duration;

use busbar_profile::Rate;

use crate::site::Poll;

/// A silent device is probed at least this often, so that its return is seen soon.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// When each rate of a device is due.
#[derive(Debug)]
pub(crate) struct Schedule {
    poll: Poll,
    fast: Duration,
    slow: Duration,
    /// None when it is done.
    once: Option<Duration>,
    /// The next probe of a device that is silent, and how many it left unanswered.
    silent: Option<(Duration, u32)>,
}

impl Schedule {
    /// Everything is due at `now`.
    pub(crate) fn new(poll: Poll, now: Duration) -> Self {
        Self { poll, fast: now, slow: now, once: Some(now), silent: None }
    }

    /// What is due first, and when. Of what is due together, the rarer comes first: it is not put off by the rest.
    pub(crate) fn next(&self) -> (Rate, Duration) {
        if let Some((at, _)) = self.silent {
            return (Rate::Fast, at);
        }
        let candidates =
            [(self.once, Rate::Once), (Some(self.slow), Rate::Slow), (Some(self.fast), Rate::Fast)];
        let due = candidates.into_iter().filter_map(|(at, rate)| Some((at?, rate)));
        due.min_by_key(|(at, _)| *at).map_or((Rate::Fast, self.fast), |(at, rate)| (rate, at))
    }

    pub(crate) fn is_silent(&self) -> bool {
        self.silent.is_some()
    }

    /// A round is finished and the device answered. Rounds that should have begun meanwhile are left out, so that a
    /// slow wire is never owed anything.
    pub(crate) fn done(&mut self, rate: Rate, now: Duration) {
        if self.silent.take().is_some() {
            // It was away: who knows what changed.
            *self = Self::new(self.poll, now);
        }
        match rate {
            Rate::Fast => self.fast = following(self.fast, self.poll.fast, now),
            Rate::Slow => self.slow = following(self.slow, self.poll.slow, now),
            Rate::Once | Rate::OnDemand => self.once = None,
        }
    }

    /// What is read once is to be read again.
    pub(crate) fn identify(&mut self, now: Duration) {
        self.once = Some(now);
    }

    /// The device did not answer: the next try comes after a pause that grows.
    pub(crate) fn silent(&mut self, now: Duration) {
        let unanswered = self.silent.map_or(0, |(_, unanswered)| unanswered);
        let pause =
            self.poll.fast.saturating_mul(1 << unanswered.min(16)).min(LONGEST_PAUSE.max(self.poll.fast));
        self.silent = Some((now + pause, unanswered.saturating_add(1)));
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

    /// Runs every round that is due until `end`; a round takes `takes`.
    fn play(schedule: &mut Schedule, end: Duration, takes: Duration) -> Vec<(Rate, u64)> {
        let mut now = Duration::ZERO;
        let mut rounds = Vec::new();
        loop {
            let (rate, due) = schedule.next();
            now = now.max(due);
            if now > end {
                return rounds;
            }
            rounds.push((rate, now.as_millis() as u64));
            now += takes;
            schedule.done(rate, now);
        }
    }

    #[test]
    fn each_rate_has_its_beat() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        let rounds = play(&mut schedule, ms(10_500), ms(10));
        let of =
            |rate| rounds.iter().filter(|round| round.0 == rate).map(|round| round.1).collect::<Vec<_>>();
        assert_eq!(rounds[..3], [(Rate::Once, 0), (Rate::Slow, 10), (Rate::Fast, 20)]);
        assert_eq!(of(Rate::Once), [0]);
        assert_eq!(of(Rate::Slow), [10, 10_000]);
        // The beat stays on the grid however long a round takes.
        assert_eq!(of(Rate::Fast)[..3], [20, 1_000, 2_000]);
        assert_eq!(of(Rate::Fast).len(), 11);
    }

    #[test]
    fn a_slow_wire_is_owed_nothing() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        let rounds = play(&mut schedule, ms(30_000), ms(2_500));
        let slow = rounds.iter().filter(|round| round.0 == Rate::Slow).count();
        let fast = rounds.iter().filter(|round| round.0 == Rate::Fast).count();
        assert!(slow >= 3, "the slow rate is not starved: {rounds:?}");
        assert!(fast >= 7, "and the fast one goes on: {rounds:?}");
    }

    #[test]
    fn a_silent_device_is_probed_ever_more_rarely() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        let mut now = Duration::ZERO;
        let mut pauses = Vec::new();
        for _ in 0..7 {
            schedule.silent(now);
            let (_, due) = schedule.next();
            pauses.push((due - now).as_secs());
            now = due;
        }
        assert_eq!(pauses, [1, 2, 4, 8, 10, 10, 10]);
        assert!(schedule.is_silent());

        // The wire came up again: no reason to wait.
        schedule.probe(now - ms(500));
        assert_eq!(schedule.next().1, now - ms(500));
    }

    #[test]
    fn after_silence_everything_is_read_again() {
        let mut schedule = Schedule::new(POLL, Duration::ZERO);
        play(&mut schedule, ms(3_000), ms(1));
        schedule.silent(ms(3_100));
        schedule.done(Rate::Fast, ms(5_000));
        assert!(!schedule.is_silent());
        assert_eq!(schedule.next(), (Rate::Once, ms(5_000)));
        schedule.done(Rate::Once, ms(5_010));
        assert_eq!(schedule.next(), (Rate::Slow, ms(5_000)));
        schedule.done(Rate::Slow, ms(5_020));
        assert_eq!(schedule.next(), (Rate::Fast, ms(6_000)));
    }
}
