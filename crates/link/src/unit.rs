//! What a wire knows about each of its units.

use std::time::Duration;

use crate::statistics::{Latency, UnitState, UnitStatistics};
use crate::timing::Timing;

/// So many time-outs in a row, and a unit counts as silent.
const SILENT_AFTER: u8 = 3;

/// The units of one wire that were asked something, by id.
///
/// Most wires have one: its record is the one thing that is allocated.
#[derive(Debug, Default)]
pub(crate) struct Units(Vec<Unit>);

impl Units {
    pub(crate) fn get(&self, id: u8) -> Option<&Unit> {
        self.find(id).ok().and_then(|index| self.0.get(index))
    }

    pub(crate) fn get_mut(&mut self, id: u8) -> Option<&mut Unit> {
        self.find(id).ok().and_then(|index| self.0.get_mut(index))
    }

    /// The record of a unit, made at first.
    pub(crate) fn record(&mut self, id: u8) -> &mut Unit {
        let index = self.find(id).unwrap_or_else(|index| {
            if self.0.is_empty() {
                self.0.reserve_exact(1);
            }
            self.0.insert(index, Unit::new(id));
            index
        });
        &mut self.0[index]
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Unit> {
        self.0.iter()
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Unit> {
        self.0.iter_mut()
    }

    /// How long a probe of the slowest unit would wait; none where nothing was measured.
    pub(crate) fn slowest(&self, floor: Duration, limit: Duration) -> Option<Duration> {
        self.0.iter().filter_map(|unit| unit.timing.probe(floor, limit)).max()
    }

    fn find(&self, id: u8) -> Result<usize, usize> {
        match &self.0[..] {
            [only] if only.id == id => Ok(0),
            units => units.binary_search_by_key(&id, |unit| unit.id),
        }
    }
}

/// One unit.
#[derive(Debug)]
pub(crate) struct Unit {
    pub(crate) id: u8,
    /// Time-outs since it answered last.
    missed: u8,
    /// Polls in slots of its own that it left unanswered since it fell silent.
    probes: u8,
    pub(crate) timing: Timing,
    /// Silent: no poll before this.
    pub(crate) next_probe: Duration,
    /// The number of its last exchange.
    pub(crate) served: u64,
    /// When that ended, and the pause that was wanted after it.
    ended: Duration,
    spacing: Duration,
    /// When the last request left that has had no answer.
    unanswered: Option<Duration>,
    pub(crate) counts: Counts,
}

/// What is counted for one unit; see [`UnitStatistics`].
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) requests: u64,
    pub(crate) answers: u64,
    pub(crate) timeouts: u64,
    pub(crate) retries: u64,
    pub(crate) held: u64,
    pub(crate) late: u64,
    pub(crate) crc_errors: u64,
    pub(crate) garbage_bytes: u64,
    pub(crate) bytes_sent: u64,
    pub(crate) bytes_received: u64,
    pub(crate) exceptions: std::collections::BTreeMap<u8, u64>,
    pub(crate) latency: Latency,
    /// Time from requests to the ends of their exchanges.
    occupied: Duration,
}

impl Unit {
    fn new(id: u8) -> Self {
        Self {
            id,
            missed: 0,
            probes: 0,
            timing: Timing::default(),
            next_probe: Duration::ZERO,
            served: 0,
            ended: Duration::ZERO,
            spacing: Duration::ZERO,
            unanswered: None,
            counts: Counts::default(),
        }
    }

    /// Whether it counts as silent.
    pub(crate) fn is_silent(&self) -> bool {
        self.missed >= SILENT_AFTER
    }

    /// Whether nobody knows that it will answer: it never has, or not for several times.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.is_silent() || self.counts.answers == 0
    }

    /// When it may be asked by somebody who wants this pause between its exchanges.
    pub(crate) fn rested(&self, spacing: Duration) -> Duration {
        match self.counts.requests {
            0 => Duration::ZERO,
            _ => self.ended + self.spacing.max(spacing),
        }
    }

    /// An exchange is over, answered or not.
    pub(crate) fn exchanged(&mut self, started: Duration, now: Duration, spacing: Duration) {
        self.ended = now;
        self.spacing = spacing;
        self.counts.occupied += now.saturating_sub(started);
    }

    /// It answered. `latency` is none where nobody can say which of several requests it answered.
    pub(crate) fn answered(&mut self, latency: Option<Duration>) {
        self.missed = 0;
        self.probes = 0;
        self.next_probe = Duration::ZERO;
        self.unanswered = None;
        if let Some(latency) = latency {
            self.timing.measure(latency);
        }
    }

    /// It did not answer a request that left at `started`.
    pub(crate) fn missed(&mut self, started: Duration) {
        self.counts.timeouts += 1;
        self.missed = self.missed.saturating_add(1);
        self.timing.miss();
        self.unanswered = Some(started);
    }

    /// It answered after all, too late: it is alive, and slower than was thought.
    pub(crate) fn answered_late(&mut self, now: Duration) {
        self.counts.late += 1;
        self.missed = self.missed.min(SILENT_AFTER - 1);
        self.probes = 0;
        self.next_probe = Duration::ZERO;
        if let Some(since) = self.unanswered.take() {
            self.timing.measure(now.saturating_sub(since));
        }
    }

    /// One more of its slots went by without an answer. Says how many have.
    pub(crate) fn missed_probe(&mut self) -> u32 {
        self.probes = self.probes.saturating_add(1);
        self.probes.into()
    }

    /// Its slots that went by without an answer.
    pub(crate) fn probes(&self) -> u32 {
        self.probes.into()
    }

    /// Everything counted. `busy` is the time of its bytes on the line; `slots` says whether silence is waited out.
    pub(crate) fn statistics(&self, now: Duration, busy: Duration, slots: bool) -> UnitStatistics {
        let counts = &self.counts;
        UnitStatistics {
            unit: self.id,
            state: match self.missed {
                0 if counts.answers == 0 => UnitState::Unknown,
                0 => UnitState::Answering,
                _ if slots && self.is_silent() => {
                    UnitState::Silent { next_probe: self.next_probe.saturating_sub(now) }
                }
                _ => UnitState::Missing,
            },
            requests: counts.requests,
            answers: counts.answers,
            timeouts: counts.timeouts,
            retries: counts.retries,
            held: counts.held,
            exceptions: counts.exceptions.clone(),
            crc_errors: counts.crc_errors,
            garbage_bytes: counts.garbage_bytes,
            late: counts.late,
            bytes_sent: counts.bytes_sent,
            bytes_received: counts.bytes_received,
            latency: counts.latency.clone(),
            busy,
            waiting: counts.occupied.saturating_sub(busy),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_each_unit_again() {
        let mut units = Units::default();
        for id in [9, 1, 247, 9, 5, 1] {
            units.record(id).counts.requests += 1;
        }
        let counted: Vec<_> = units.iter().map(|unit| (unit.id, unit.counts.requests)).collect();
        assert_eq!(counted, [(1, 2), (5, 1), (9, 2), (247, 1)]);
        assert!(units.get(2).is_none() && units.get_mut(247).is_some());
    }

    #[test]
    fn is_silent_after_three_time_outs_and_alive_after_any_answer() {
        let ms = Duration::from_millis;
        let mut unit = Unit::new(1);
        (0..2).for_each(|_| unit.missed(ms(0)));
        assert!(!unit.is_silent());
        unit.missed(ms(0));
        assert!(unit.is_silent());
        unit.answered_late(ms(600));
        assert!(!unit.is_silent());
        assert_eq!(unit.timing.timeout(ms(200), ms(5000)), ms(1800), "and slow");
        unit.missed(ms(700));
        assert!(unit.is_silent(), "it has not answered in time");
        unit.answered(None);
        assert!(!unit.is_silent());
        assert_eq!(unit.counts.late, 1);
    }

    #[test]
    fn one_record_is_small() {
        // Ten thousand wires with one unit each have one of these each.
        assert!(size_of::<Unit>() <= 352, "{}", size_of::<Unit>());
    }
}
