//! The connection of a wire: made, lost, made anew after a pause that grows.

use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use super::{LONGEST_WAIT, Step, Wire};
use crate::error::{Cause, LinkError, Outage};
use crate::queue::Entry;

/// A connection that drops is made anew at once only if it had lived so long, or had carried so many answers. Every
/// other drop counts as a failure, so that a peer which hangs up after each answer gets no storm of connections.
const PROVEN_AGE: Duration = Duration::from_secs(5);
const PROVEN_ANSWERS: u64 = 100;

/// The state of the connection.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Being made for the first time, or soon after it dropped: requests wait. It begins at `since`.
    Connecting { trying: bool, since: Duration },
    /// Up.
    Connected,
    /// It failed and is tried again later: requests fail at once.
    Down { retry_at: Duration, trying: bool, reason: Outage },
}

impl Wire {
    /// The connection is made.
    pub(crate) fn connected(&mut self, now: Duration) {
        self.client.reset();
        self.silence.begin();
        self.unanswered_since = None;
        self.connections += 1;
        self.connected_at = now;
        self.answers = 0;
        self.disturbed = None;
        // Nobody has listened yet: on a line somebody may be speaking.
        self.earliest = self.earliest.max(now + self.line.silence);
        // Behind a new connection things may have changed.
        self.units.iter_mut().for_each(|unit| unit.next_probe = Duration::ZERO);
        self.enter(Phase::Connected);
    }

    /// The attempt to connect failed.
    pub(crate) fn refused(&mut self, now: Duration, cause: Cause, wakes: &mut Vec<Waker>) {
        self.failures += 1;
        self.go_down(now, cause, wakes);
    }

    /// The connection ended.
    pub(crate) fn lost(&mut self, now: Duration, cause: Cause, wakes: &mut Vec<Waker>) {
        if !matches!(self.phase, Phase::Connected) {
            return;
        }
        self.client.reset();
        if let Some(exchange) = self.exchange.take() {
            self.drop_exchange(now, &exchange, cause, wakes);
        }
        if let Some(place) = self.together.take() {
            let reason = self.outage(cause);
            self.queue.finish(place, Err(LinkError::Down { reason }), wakes);
        }
        // Peers close idle connections, and that is nothing to report: one attempt at once. Nor is the first short
        // connection, but the next one has to wait.
        let proven = self.is_proven(now);
        if proven {
            self.failures = 0;
        }
        self.failures += 1;
        if self.failures > 1 {
            self.go_down(now, cause, wakes);
            return;
        }
        let since = match proven {
            true => now,
            false => self.next_attempt(now),
        };
        self.enter(Phase::Connecting { trying: false, since });
    }

    /// Whether the connection in use was good for something before it ended. Age alone proves nothing for one that
    /// left requests without an answer.
    fn is_proven(&self, now: Duration) -> bool {
        let answers = self.answers;
        let is_old = now.saturating_sub(self.connected_at) >= PROVEN_AGE;
        answers >= PROVEN_ANSWERS || is_old && (answers > 0 || self.silence.timeouts() == 0)
    }

    /// When to connect again after a failure.
    fn next_attempt(&self, now: Duration) -> Duration {
        now + self.rules.backoff.delay(self.failures).min(LONGEST_WAIT)
    }

    /// Ends the connection by our own choice.
    pub(super) fn hang_up(&mut self, now: Duration, cause: Cause, wakes: &mut Vec<Waker>) {
        self.lost(now, cause, wakes);
        self.hang_up = true;
    }

    fn go_down(&mut self, now: Duration, cause: Cause, wakes: &mut Vec<Waker>) {
        let reason = self.outage(cause);
        self.queue.fail_waiting(
            |_| {
                let reason = reason.clone();
                Some(LinkError::Down { reason })
            },
            wakes,
        );
        self.enter(Phase::Down { retry_at: self.next_attempt(now), trying: false, reason });
    }

    /// While a connection is being made a request waits as long as it would wait for an answer.
    pub(super) fn expire_waiting(&mut self, now: Duration, since: Duration, wakes: &mut Vec<Waker>) -> Step {
        let until = |entry: &Entry| entry.since.max(since) + entry.job.timeout;
        let endpoint = &self.endpoint;
        self.queue.fail_waiting(
            |entry| {
                let after = entry.job.timeout;
                (until(entry) <= now).then(|| LinkError::Down {
                    reason: Outage {
                        endpoint: Arc::clone(endpoint),
                        cause: Cause::StillConnecting { after },
                    },
                })
            },
            wakes,
        );
        Step::Wait(self.queue.waiting().map(until).min())
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.news = true;
    }

    pub(super) fn outage(&self, cause: Cause) -> Outage {
        Outage { endpoint: Arc::clone(&self.endpoint), cause }
    }
}
