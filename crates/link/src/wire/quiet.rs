//! The silence before a request: what breaks it, and who gives up waiting for it.

use std::task::Waker;
use std::time::Duration;

use busbar_modbus::client::DEFAULT_QUIET;

use super::Wire;
use crate::error::LinkError;
use crate::job::Job;
use crate::queue::Entry;

/// Who waits for a silent line waits so long at least: what is late may take as long.
const LEAST_PATIENCE: Duration = DEFAULT_QUIET.saturating_mul(2);

impl Wire {
    /// When the next request may leave if the line stays silent.
    pub(super) fn ready(&self) -> Duration {
        self.client.quiet_until().map_or(self.earliest, |until| until.max(self.earliest))
    }

    /// RTU: something is on the line, which has to be silent after it.
    pub(super) fn break_silence(&mut self, now: Duration) {
        let silent = now + self.line.silence;
        if self.exchange.is_none() && silent > self.earliest {
            match now < self.ready() {
                true => self.disturbed.get_or_insert(now),
                false => self.disturbed.insert(now),
            };
        }
        self.earliest = self.earliest.max(silent);
    }

    /// On a line that never falls silent nobody waits for longer than for an answer. Says when the next one will have.
    pub(super) fn wait_for_silence(&mut self, now: Duration, wakes: &mut Vec<Waker>) -> Option<Duration> {
        let Some(since) = self.disturbed else {
            let somebody_waits = self.together.is_some() || !self.queue.is_empty();
            return somebody_waits.then_some(Duration::MAX);
        };
        let until = |entry: &Entry| entry.since.max(since) + entry.job.timeout.max(LEAST_PATIENCE);
        let judge = |entry: &Entry| {
            let Job { unit, timeout: after, .. } = entry.job;
            (until(entry) <= now).then_some(LinkError::NeverSilent { unit, after })
        };
        self.queue.fail_waiting(judge, wakes);
        if let Some(place) = self.together
            && let Some(error) = self.queue.entry(place).and_then(|entry| judge(entry))
        {
            self.together = None;
            self.queue.finish(place, Err(error), wakes);
        }
        let together = self.together.map(|place| self.queue.entry(place).map_or(now, |entry| until(entry)));
        self.queue.waiting().map(until).chain(together).min()
    }
}
