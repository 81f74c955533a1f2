//! When a device is polled next. Time is an argument.

use std::time::Duration;

use busbar_profile::Rate;

use crate::rates::Rates;
use crate::site::Poll;

/// A silent device is probed at least this often, so that its return is seen soon.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

/// Between two tries at least.
const LEAST_PAUSE: Duration = Duration::from_millis(10);

/// Another device in its place is asked who it is at least this often.
const LONGEST_WRONG: Duration = Duration::from_secs(3);

/// So long at least a device is believed to be who it said it is.
const LEAST_TRUST: Duration = Duration::from_secs(5);

/// When each rate of a device is due, and when it is asked who it is.
#[derive(Debug)]
pub(crate) struct Schedule {
    poll: Poll,
    /// How long after the first fast round the second one comes, so that not all devices are read in the same instant.
    stagger: Duration,
    /// Whether the fast round to come is the first one.
    is_first: bool,
    fast: Duration,
    slow: Duration,
    /// None when it is done.
    once: Option<Duration>,
    /// When it was last done.
    once_done: Option<Duration>,
    /// When the device is asked who it is; none when that is known.
    identity: Option<Duration>,
    /// When it was last asked and answered.
    identified: Option<Duration>,
    /// Whether another device answers in its place.
    wrong: bool,
    /// Whether the connection outlived the last round.
    steady: bool,
    /// The next probe of a device that is silent, and how many it left unanswered.
    silent: Option<(Duration, u32)>,
}

impl Schedule {
    /// Everything is due at `now`. Devices that have another place have their beat at another time.
    pub(crate) fn new(poll: Poll, place: usize, now: Duration) -> Self {
        Self::staggered(poll, stagger(place, poll.fast), now)
    }

    fn staggered(poll: Poll, stagger: Duration, now: Duration) -> Self {
        Self {
            poll,
            stagger,
            is_first: true,
            fast: now,
            slow: now,
            once: Some(now),
            once_done: None,
            identity: Some(now),
            identified: None,
            wrong: false,
            steady: true,
            silent: None,
        }
    }

    /// When the next round begins. What is slow waits for the next fast round, so that they share reads.
    pub(crate) fn next(&self) -> Duration {
        match (self.silent, self.identity) {
            (Some((at, _)), _) => at,
            (None, Some(at)) if self.wrong => at,
            (None, identity) => [self.once, identity].into_iter().flatten().fold(self.fast, Duration::min),
        }
    }

    /// Whether the device is to be asked who it is before anything else.
    pub(crate) fn asks_identity(&self, now: Duration) -> bool {
        self.silent.is_some() || self.is_doubted(now)
    }

    /// Whether there is reason to ask it who it is, beside its having been silent.
    pub(crate) fn is_doubted(&self, now: Duration) -> bool {
        self.identity.is_some_and(|at| at <= now)
    }

    /// It is the device that the site file says.
    pub(crate) fn identified(&mut self, now: Duration) {
        if std::mem::take(&mut self.wrong) {
            // Nothing is known of it.
            (self.fast, self.slow, self.once, self.is_first) = (now, now, Some(now), true);
        }
        (self.identity, self.identified) = (None, Some(now));
    }

    /// Another device answers in its place, and is asked again soon who it is.
    pub(crate) fn wrong(&mut self, now: Duration) {
        self.wrong = true;
        self.silent = None;
        (self.identity, self.identified) = (Some(now + self.poll.slow.min(LONGEST_WRONG)), Some(now));
    }

    /// What it answered says neither yes nor no: it is asked again with what is due next.
    pub(crate) fn unclear(&mut self, now: Duration) {
        if self.silent.is_some() {
            *self = Self { identified: self.identified, ..Self::staggered(self.poll, self.stagger, now) };
        }
        self.fast = following(self.fast, self.poll.fast, now);
        (self.once, self.identity) = (self.once.map(|once| once.max(self.fast)), Some(self.fast));
    }

    /// Whether so much time has gone by since the device was last asked who it is that it may be asked again.
    pub(crate) fn may_doubt(&self, now: Duration) -> bool {
        self.identified.is_none_or(|identified| identified + self.poll.slow.max(LEAST_TRUST) <= now)
    }

    /// There is reason to ask who it is.
    pub(crate) fn doubt(&mut self, now: Duration) {
        self.identity = Some(now);
    }

    /// The connection outlived a round.
    pub(crate) fn steady(&mut self) {
        self.steady = true;
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

    /// Whether another device answers in its place.
    pub(crate) fn is_wrong(&self) -> bool {
        self.wrong
    }

    /// Whether it is read in rounds.
    pub(crate) fn is_polled(&self) -> bool {
        self.silent.is_none() && !self.wrong
    }

    /// A round is finished and the device answered. Rounds that should have begun meanwhile are left out, so that a
    /// slow wire is never owed anything.
    pub(crate) fn done(&mut self, rates: Rates, now: Duration) {
        if self.silent.take().is_some() {
            // It was away: who knows what changed. Who it is was asked.
            let Self { identity, identified, .. } = *self;
            *self = Self { identity, identified, ..Self::staggered(self.poll, self.stagger, now) };
        }
        for rate in rates.iter() {
            match rate {
                Rate::Fast if std::mem::take(&mut self.is_first) => {
                    self.fast = after(self.fast + self.stagger, self.poll.fast, now);
                }
                Rate::Fast => self.fast = following(self.fast, self.poll.fast, now),
                Rate::Slow => self.slow = following(self.slow, self.poll.slow, now),
                Rate::Once => (self.once, self.once_done) = (None, Some(now)),
                Rate::OnDemand => {}
            }
        }
    }

    /// What is read once did not come: it is tried again with the slow points.
    pub(crate) fn missed_once(&mut self) {
        self.once = Some(self.slow);
    }

    /// The connection was made anew: there may be another device behind it. Who it is is asked at once, and what is read
    /// once is read again; but neither more often than what is slow where a connection does not outlive a round: there
    /// are devices that close each after one answer.
    pub(crate) fn reconnected(&mut self, now: Duration) {
        let slow = |done: Option<Duration>| now.max(done.map_or(now, |done| done + self.poll.slow));
        let identity = if self.steady { now } else { slow(self.identified) };
        self.identity = Some(self.identity.map_or(identity, |at| at.min(identity)));
        let once = slow(self.once_done);
        self.once = Some(self.once.map_or(once, |at| at.min(once)));
        self.steady = false;
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

/// Between half an interval and one and a half, spread evenly over however many places there are.
fn stagger(place: usize, interval: Duration) -> Duration {
    /// The golden section of 2^32: its multiples leave no wide gap and no crowd on a circle.
    const GOLDEN: u32 = 0x9E37_79B9;
    let part = (place as u32).wrapping_mul(GOLDEN);
    let phase = interval.mul_f64(f64::from(part) / 2_f64.powi(32));
    if phase < interval / 2 { interval + phase } else { phase }
}

/// The first instant of the grid `due`, `due + interval`, ... that is after `now`, `due` itself left out.
fn following(due: Duration, interval: Duration, now: Duration) -> Duration {
    after(due + interval, interval, now)
}

/// The first instant of the grid `first`, `first + interval`, ... that is after `now`.
fn after(first: Duration, interval: Duration, now: Duration) -> Duration {
    let Some(past) = now.checked_sub(first) else { return first };
    let missed = past.as_nanos() / interval.as_nanos().max(1);
    first + interval.saturating_mul(u32::try_from(missed).unwrap_or(u32::MAX).saturating_add(1))
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
            if schedule.asks_identity(now) {
                schedule.identified(now);
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
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
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
    fn devices_begin_together_and_then_each_has_its_own_time() {
        const DEVICES: usize = 1_000;
        let mut began = [0_u32; 10];
        for place in 0..DEVICES {
            let mut schedule = Schedule::new(POLL, place, ms(77));
            assert_eq!(schedule.due(ms(77)), rates([Rate::Fast, Rate::Slow, Rate::Once]), "all at once");
            schedule.identified(ms(80));
            schedule.done(schedule.due(ms(77)), ms(90));
            let second = schedule.next();
            assert!(second >= ms(577) && second < ms(1_577), "{second:?}");
            began[(second.subsec_millis() / 100) as usize] += 1;
            schedule.done(schedule.due(second), second + ms(3));
            assert_eq!(schedule.next(), second + POLL.fast, "and keeps it");
            // Those on one wire come back together, too.
            schedule.silent(ms(5_000));
            schedule.done(rates([Rate::Fast]), ms(6_000));
            schedule.done(rates([Rate::Slow, Rate::Once]), ms(6_000));
            assert_eq!(schedule.next() - ms(6_000), second - ms(77));
        }
        assert!(began.iter().all(|count| (95..=105).contains(count)), "{began:?}");
    }

    #[test]
    fn a_slow_beat_that_is_no_multiple_of_the_fast_one_waits_for_it() {
        let poll = Poll { fast: ms(1_000), slow: ms(2_500) };
        let mut schedule = Schedule::new(poll, 0, Duration::ZERO);
        let rounds = play(&mut schedule, ms(10_500), ms(10));
        assert_eq!(of(&rounds, Rate::Slow), [0, 3_000, 5_000, 8_000, 10_000]);
        assert_eq!(rounds.len(), 11);
    }

    #[test]
    fn a_slow_wire_is_owed_nothing() {
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
        let rounds = play(&mut schedule, ms(30_000), ms(2_500));
        assert!(of(&rounds, Rate::Slow).len() >= 3, "the slow rate is not starved: {rounds:?}");
        assert!(of(&rounds, Rate::Fast).len() >= 10, "and the fast one goes on: {rounds:?}");
    }

    #[test]
    fn a_new_identity_is_asked_for_at_once_and_a_missed_one_again() {
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
        play(&mut schedule, ms(13_000), ms(1));
        schedule.reconnected(ms(13_100));
        assert_eq!((schedule.next(), schedule.due(ms(13_100))), (ms(13_100), rates([Rate::Once])));
        assert!(schedule.asks_identity(ms(13_100)));
        schedule.identified(ms(13_100));
        schedule.done(rates([Rate::Once]), ms(13_200));
        schedule.missed_once();
        assert_eq!((schedule.next(), schedule.due(ms(14_000))), (ms(14_000), rates([Rate::Fast])));
        assert_eq!(schedule.due(ms(20_000)), rates([Rate::Fast, Rate::Slow, Rate::Once]));
    }

    #[test]
    fn a_connection_that_is_made_anew_all_the_time_causes_no_storm() {
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
        let (mut now, mut rounds) = (Duration::ZERO, Vec::new());
        let mut asked = 0;
        while now <= ms(30_000) {
            if schedule.asks_identity(now) {
                schedule.identified(now);
                asked += 1;
            }
            let due = schedule.due(now);
            rounds.push((due, now.as_millis() as u64));
            now += ms(1);
            schedule.done(due, now);
            schedule.reconnected(now);
            now = now.max(schedule.next());
        }
        assert!(of(&rounds, Rate::Once).len() <= 4 && rounds.len() <= 38, "{rounds:?}");
        // At the start, when the connection first dropped, and then with what is slow.
        assert_eq!(asked, 4);
    }

    #[test]
    fn a_silent_device_is_probed_ever_more_rarely() {
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
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
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
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
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
        play(&mut schedule, ms(3_000), ms(1));
        schedule.silent(ms(3_100));
        assert!(schedule.asks_identity(ms(5_000)));
        schedule.identified(ms(5_000));
        schedule.done(rates([Rate::Fast]), ms(5_000));
        assert!(!schedule.is_silent());
        assert_eq!((schedule.next(), schedule.due(ms(5_000))), (ms(5_000), rates([Rate::Slow, Rate::Once])));
        schedule.done(rates([Rate::Slow, Rate::Once]), ms(5_020));
        assert_eq!((schedule.next(), schedule.due(ms(6_000))), (ms(6_000), rates([Rate::Fast])));
        assert_eq!(schedule.due(ms(15_000)), rates([Rate::Fast, Rate::Slow]), "and they fall together again");
    }

    #[test]
    fn a_steady_connection_that_drops_is_doubted_at_once() {
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
        play(&mut schedule, ms(2_500), ms(1));
        schedule.steady();
        schedule.reconnected(ms(2_600));
        assert!(schedule.asks_identity(ms(2_600)) && schedule.next() == ms(2_600));
        schedule.identified(ms(2_600));
        assert!(!schedule.asks_identity(ms(2_600)));
        // It did not outlive a round.
        schedule.reconnected(ms(3_001));
        assert!(!schedule.asks_identity(ms(12_500)) && schedule.asks_identity(ms(12_600)));
        schedule.steady();
        schedule.reconnected(ms(3_100));
        assert!(schedule.asks_identity(ms(3_100)));
    }

    #[test]
    fn another_device_is_asked_nothing_but_who_it_is() {
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
        schedule.wrong(ms(100));
        assert_eq!((schedule.next(), schedule.is_wrong(), schedule.is_polled()), (ms(3_100), true, false));
        schedule.wrong(ms(3_100));
        assert_eq!(schedule.next(), ms(6_100));
        schedule.reconnected(ms(4_000));
        assert_eq!(schedule.next(), ms(4_000), "whoever it is now");
        schedule.identified(ms(4_000));
        assert_eq!(schedule.due(ms(4_000)), rates([Rate::Fast, Rate::Slow, Rate::Once]));
        assert!(schedule.is_polled());
    }

    #[test]
    fn who_says_neither_yes_nor_no_is_asked_again_with_the_next_round() {
        let mut schedule = Schedule::new(POLL, 0, Duration::ZERO);
        schedule.unclear(ms(20));
        assert_eq!((schedule.next(), schedule.asks_identity(ms(999))), (ms(1_000), false));
        assert!(schedule.asks_identity(ms(1_000)));
        assert_eq!(schedule.due(ms(1_000)), rates([Rate::Fast, Rate::Slow, Rate::Once]));
    }

    #[test]
    fn who_it_is_is_not_doubted_all_the_time() {
        let mut schedule = Schedule::new(Poll { fast: ms(50), slow: ms(200) }, 0, Duration::ZERO);
        assert!(schedule.may_doubt(Duration::ZERO));
        schedule.identified(ms(10));
        assert!(!schedule.may_doubt(ms(5_009)) && schedule.may_doubt(ms(5_010)));
    }
}
