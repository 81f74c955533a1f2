//! The rules of one wire as a pure state machine: time, bytes and events in; the next step out.
//!
//! It has no clock and no socket, so every rule is tested as a script. `shared` does what it says and tells it what
//! happened.

use std::sync::Arc;
use std::task::{Poll, Waker};
use std::time::Duration;

use busbar_modbus::{Client, Progress, Response};

use crate::endpoint::Endpoint;
use crate::error::{Cause, LinkError, Loss, Outage};
use crate::heard::Ear;
use crate::job::{Job, Outcome, Priority};
use crate::line::Line;
use crate::options::{Backoff, Options};
use crate::queue::{Entry, Place, Queue, Ticket};
use crate::silence::Silence;
use crate::statistics::Statistics;

/// Longer waits are cut to this, so that no sum of times overflows.
const LONGEST_WAIT: Duration = Duration::from_secs(24 * 60 * 60);

/// A connection that drops is made anew at once only if it had lived so long, or had carried so many answers. Every
/// other drop counts as a failure, so that a peer which hangs up after each answer gets no storm of connections.
const PROVEN_AGE: Duration = Duration::from_secs(5);
const PROVEN_ANSWERS: u64 = 100;

/// One wire: what waits, what is under way, and what state the connection is in.
#[derive(Debug)]
pub(crate) struct Wire {
    endpoint: Arc<Endpoint>,
    line: Line,
    rules: Rules,
    client: Client,
    queue: Queue,
    phase: Phase,
    exchange: Option<Exchange>,
    /// No request leaves before this: spacing.
    earliest: Duration,
    silence: Silence,
    /// Connections that failed since the last one that proved good.
    failures: u32,
    /// The connection in use is no good any more, and the task does not know yet.
    hang_up: bool,
    /// The phase has changed since the task last asked.
    news: bool,
    closed: bool,
    connections: u64,
    connected_at: Duration,
    /// Answers before this connection.
    answers_before: u64,
    statistics: Statistics,
}

impl Wire {
    pub(crate) fn new(endpoint: Arc<Endpoint>, line: Line, options: &Options) -> Self {
        Self {
            endpoint,
            line,
            rules: Rules {
                spacing: options.spacing.min(LONGEST_WAIT),
                retries: options.retries,
                timeouts_to_drop: options.timeouts_to_drop,
                backoff: options.backoff,
            },
            client: Client::new(line.framing),
            queue: Queue::new(options.queue),
            phase: Phase::Connecting { trying: false, since: Duration::ZERO },
            exchange: None,
            earliest: Duration::ZERO,
            silence: Silence::default(),
            failures: 0,
            hang_up: false,
            news: false,
            closed: false,
            connections: 0,
            connected_at: Duration::ZERO,
            answers_before: 0,
            statistics: Statistics::default(),
        }
    }

    // What callers do.

    /// Takes a job in, or refuses it at once.
    pub(crate) fn submit(&mut self, now: Duration, job: Job, waker: &Waker) -> Result<Ticket, Outcome> {
        if let Err(error) = self.accepts(job.priority) {
            return Err(Outcome { result: Err(error), registers: job.registers });
        }
        let job = Job { timeout: job.timeout.min(LONGEST_WAIT), ..job };
        let probe = job.priority == Priority::Poll && !self.silence.is_answering(job.unit);
        Ok(self.queue.push(Entry { job, since: now, tries: 0, probe, waker: Some(waker.clone()) }))
    }

    /// The outcome of a job if there is one; otherwise `waker` will be woken for it.
    pub(crate) fn take(&mut self, ticket: &Ticket, waker: &Waker) -> Poll<Outcome> {
        self.queue.take(ticket, waker)
    }

    /// Wakes nobody for this job, until `take` is called again.
    pub(crate) fn forget_waker(&mut self, ticket: &Ticket) {
        if let Some(entry) = self.queue.entry(ticket.place()) {
            entry.waker = None;
        }
    }

    /// The caller has gone. What has not left will not leave.
    pub(crate) fn cancel(&mut self, ticket: Ticket) {
        self.queue.cancel(ticket);
    }

    /// The last handle is gone, or the task is: everything ends.
    pub(crate) fn close(&mut self, wakes: &mut Vec<Waker>) {
        self.closed = true;
        if let Some(exchange) = self.exchange.take() {
            let error = match exchange.may_have_left() {
                true => LinkError::Lost { unit: exchange.unit, loss: Loss::Closed },
                false => LinkError::Closed,
            };
            self.queue.finish(exchange.place, Err(error), wakes);
        }
        self.queue.fail_waiting(|_| Some(LinkError::Closed), wakes);
    }

    /// Whether a job that comes now has to wait for an exchange to end first.
    pub(crate) fn is_busy(&self) -> bool {
        self.exchange.is_some()
    }

    /// The job that is on the wire.
    pub(crate) fn under_way(&self) -> Option<Place> {
        self.exchange.as_ref().map(|exchange| exchange.place)
    }

    /// Whether the task has nothing to do: nobody waits, and the connection is as it was.
    pub(crate) fn is_at_rest(&self) -> bool {
        matches!(self.phase, Phase::Connected) && !self.hang_up && !self.news && self.queue.is_empty()
    }

    /// A copy of everything counted.
    pub(crate) fn statistics(&self) -> Statistics {
        let seen = self.client.counters();
        Statistics {
            late: seen.late,
            wrong_unit: seen.wrong_unit,
            wrong_function: seen.wrong_function,
            wrong_length: seen.wrong_length,
            wrong_echo: seen.wrong_echo,
            wrong_protocol: seen.wrong_protocol,
            crc_errors: seen.crc_errors,
            garbage_bytes: seen.garbage_bytes,
            reconnects: self.connections.saturating_sub(1),
            ..self.statistics.clone()
        }
    }

    // What the task reports.

    /// The connection is made.
    pub(crate) fn connected(&mut self, now: Duration) {
        self.client.reset();
        self.silence.begin();
        self.connections += 1;
        self.connected_at = now;
        self.answers_before = self.statistics.answers;
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
            self.drop_exchange(&exchange, cause, wakes);
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

    /// RTU: so many bytes were on the line, whatever they are, and how long the echo of our own request is if they end
    /// one. The line has to be silent after them.
    pub(crate) fn heard(&mut self, now: Duration, bytes: usize, echo: Option<usize>) {
        self.statistics.echoes += u64::from(echo.is_some());
        self.earliest = self.earliest.max(now + self.line.silence);
        if let Some(exchange) = &mut self.exchange {
            exchange.ear.hears(bytes, echo);
        }
    }

    /// Bytes came.
    pub(crate) fn received(&mut self, now: Duration, bytes: &[u8], wakes: &mut Vec<Waker>) {
        self.statistics.bytes_received += bytes.len() as u64;
        match self.client.receive(now, bytes) {
            Progress::Answered => self.answered(now, wakes),
            Progress::TimedOut => self.timed_out(now, wakes),
            Progress::Pending | Progress::Broken(_) => {}
        }
        // An answer may stand in front of the bytes that break the stream.
        if self.client.fault().is_some() {
            self.hang_up(now, Cause::Garbage, wakes);
        }
    }

    /// The system took only `bytes` of the request so far.
    pub(crate) fn sent_only(&mut self, bytes: usize) {
        if let Some(exchange) = &mut self.exchange {
            exchange.sent = match bytes {
                0 => Sent::Nothing,
                _ => Sent::Part,
            };
        }
    }

    /// The system has taken the rest of the request.
    pub(crate) fn sent_rest(&mut self) {
        if let Some(exchange) = &mut self.exchange {
            exchange.sent = Sent::Whole;
        }
    }

    // What the task is to do.

    /// The next step; for `Step::Send` the frame is in `out`.
    pub(crate) fn step(&mut self, now: Duration, out: &mut Vec<u8>, wakes: &mut Vec<Waker>) -> Step {
        if self.closed {
            return Step::End;
        }
        if std::mem::take(&mut self.hang_up) {
            return Step::Disconnect;
        }
        match &mut self.phase {
            Phase::Connected => self.step_connected(now, out, wakes),
            Phase::Connecting { trying: trying @ false, since } => {
                if now < *since {
                    return Step::Wait(Some(*since));
                }
                *trying = true;
                Step::Connect
            }
            Phase::Connecting { since, .. } => {
                let since = *since;
                self.expire_waiting(now, since, wakes)
            }
            Phase::Down { trying: true, .. } => Step::Wait(None),
            Phase::Down { retry_at, trying, .. } => {
                if now < *retry_at {
                    return Step::Wait(Some(*retry_at));
                }
                *trying = true;
                Step::Connect
            }
        }
    }

    /// The next request, in `out`, and when to look after it; none when nothing can leave now.
    pub(crate) fn start_next(
        &mut self,
        now: Duration,
        out: &mut Vec<u8>,
        wakes: &mut Vec<Waker>,
    ) -> Option<Duration> {
        let free = matches!(self.phase, Phase::Connected) && self.exchange.is_none();
        if self.closed || self.hang_up || !free || now < self.earliest() {
            return None;
        }
        while let Some(place) = self.queue.pop(now) {
            match self.start(now, place, out) {
                Ok(()) => return self.client.deadline(),
                Err(error) => self.queue.finish(place, Err(error), wakes),
            }
        }
        None
    }

    /// The phase, if it has changed since this was last asked.
    pub(crate) fn news(&mut self) -> Option<&Phase> {
        std::mem::take(&mut self.news).then_some(&self.phase)
    }

    fn accepts(&self, priority: Priority) -> Result<(), LinkError> {
        if self.closed {
            return Err(LinkError::Closed);
        }
        if let Phase::Down { reason, .. } = &self.phase {
            return Err(LinkError::Down { reason: reason.clone() });
        }
        self.queue.room(priority)
    }

    fn step_connected(&mut self, now: Duration, out: &mut Vec<u8>, wakes: &mut Vec<Waker>) -> Step {
        if self.exchange.is_some() {
            if self.client.expire(now) != Progress::TimedOut {
                return Step::Wait(self.client.deadline());
            }
            self.timed_out(now, wakes);
            if std::mem::take(&mut self.hang_up) {
                return Step::Disconnect;
            }
        }
        match self.start_next(now, out, wakes) {
            Some(until) => Step::Send(Some(until)),
            None if self.queue.is_empty() => Step::Wait(None),
            None => Step::Wait(Some(self.earliest())),
        }
    }

    /// When the next request may leave.
    fn earliest(&self) -> Duration {
        self.earliest.max(self.client.quiet_until().unwrap_or_default())
    }

    fn start(&mut self, now: Duration, place: Place, out: &mut Vec<u8>) -> Result<(), LinkError> {
        let Some(entry) = self.queue.entry(place) else {
            return Err(LinkError::Closed);
        };
        let job = &entry.job;
        let (asked, answered) = job.ask.pdus();
        let timeout = job.timeout + self.line.time(self.line.frame(asked) + self.line.frame(answered));
        self.client.start(now, job.unit, &job.ask.request(), timeout, out)?;
        if job.short {
            self.client.accept_short();
        }
        self.statistics.requests += 1;
        self.statistics.retries += u64::from(entry.tries > 0);
        self.statistics.bytes_sent += out.len() as u64;
        entry.tries += 1;
        self.exchange = Some(Exchange {
            place,
            unit: job.unit,
            write: job.ask.is_write(),
            timeout: job.timeout,
            tries: entry.tries,
            started: now,
            sent: Sent::Whole,
            ear: Ear::new(self.client.counters()),
        });
        Ok(())
    }

    fn answered(&mut self, now: Duration, wakes: &mut Vec<Waker>) {
        let Some(response) = self.client.response() else {
            // It said that there is one.
            return self.hang_up(now, Cause::Garbage, wakes);
        };
        let Some(exchange) = self.exchange.take() else { return };
        self.silence.answered(exchange.unit);
        self.earliest = self.earliest.max(now + self.rules.spacing);
        self.statistics.answers += 1;
        self.statistics.latency.record(now.saturating_sub(exchange.started));

        let result = match response {
            Response::Exception { function, code } => {
                *self.statistics.exceptions.entry(code.0).or_default() += 1;
                Err(LinkError::Exception { unit: exchange.unit, function, code })
            }
            Response::ReadHoldingRegisters(values) | Response::ReadInputRegisters(values) => {
                if let Some(entry) = self.queue.entry(exchange.place) {
                    let registers = &mut entry.job.registers;
                    registers.resize(values.len(), 0);
                    registers.iter_mut().zip(values.iter()).for_each(|(register, value)| *register = value);
                }
                Ok(())
            }
            _ => Ok(()),
        };
        self.queue.finish(exchange.place, result, wakes);
    }

    fn timed_out(&mut self, now: Duration, wakes: &mut Vec<Waker>) {
        self.statistics.timeouts += 1;
        self.earliest = self.earliest.max(now + self.rules.spacing);
        if self.exchange.as_ref().is_some_and(|exchange| exchange.sent != Sent::Whole) {
            // Half a frame is in the connection: nothing may follow it.
            return self.hang_up(now, Cause::Stuck, wakes);
        }
        let Some(exchange) = self.exchange.take() else { return };
        let Exchange { place, unit, timeout: after, tries, .. } = exchange;
        let heard = exchange.ear.judge(self.line.is_rtu(), self.client.counters());
        let was_silent = tries == 1 && self.silence.is_silent(unit);
        self.silence.timed_out(unit);
        let waiting = self.queue.waiting().map(|entry| entry.job.unit);
        let dead = self.silence.is_dead(self.rules.timeouts_to_drop, waiting);
        // Who was silent before gets one try while others answer.
        let again = !was_silent || dead || !self.silence.has_answering();
        if exchange.write {
            let loss = Loss::TimedOut { after };
            self.queue.finish(place, Err(LinkError::Lost { unit, loss }), wakes);
        } else if !again || !self.retry(&exchange) {
            self.queue.finish(place, Err(LinkError::Timeout { unit, after, tries, heard }), wakes);
        }
        if dead {
            let requests = self.silence.timeouts();
            self.hang_up(now, Cause::Silent { requests }, wakes);
        }
    }

    /// Ends or requeues the exchange that a drop cut off.
    fn drop_exchange(&mut self, exchange: &Exchange, cause: Cause, wakes: &mut Vec<Waker>) {
        let reason = self.outage(cause);
        let error = match exchange.may_have_left() {
            true => LinkError::Lost { unit: exchange.unit, loss: Loss::Dropped(reason) },
            false => LinkError::Down { reason },
        };
        if !self.retry(exchange) {
            self.queue.finish(exchange.place, Err(error), wakes);
        }
    }

    /// Puts a read back behind the others of its class if it may be sent once more. The one place where
    /// anything is sent again, and no write gets past its first line.
    fn retry(&mut self, exchange: &Exchange) -> bool {
        if exchange.write || exchange.tries > self.rules.retries {
            return false;
        }
        let Some(entry) = self.queue.entry(exchange.place) else {
            return false;
        };
        entry.probe = entry.job.priority == Priority::Poll && !self.silence.is_answering(exchange.unit);
        self.queue.put_back(exchange.place);
        true
    }

    /// Whether the connection in use was good for something before it ended. Age alone proves nothing for one that
    /// left requests without an answer.
    fn is_proven(&self, now: Duration) -> bool {
        let answers = self.statistics.answers - self.answers_before;
        let is_old = now.saturating_sub(self.connected_at) >= PROVEN_AGE;
        answers >= PROVEN_ANSWERS || is_old && (answers > 0 || self.silence.timeouts() == 0)
    }

    /// When to connect again after a failure.
    fn next_attempt(&self, now: Duration) -> Duration {
        now + self.rules.backoff.delay(self.failures).min(LONGEST_WAIT)
    }

    /// Ends the connection by our own choice.
    fn hang_up(&mut self, now: Duration, cause: Cause, wakes: &mut Vec<Waker>) {
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
    fn expire_waiting(&mut self, now: Duration, since: Duration, wakes: &mut Vec<Waker>) -> Step {
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

    fn outage(&self, cause: Cause) -> Outage {
        Outage { endpoint: Arc::clone(&self.endpoint), cause }
    }
}

/// What the task has to do next.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Start an attempt to connect.
    Connect,
    /// Send the frame, and come again at the deadline or when something happens.
    Send(Option<Duration>),
    /// Come again at that time or when something happens.
    Wait(Option<Duration>),
    /// Drop the connection.
    Disconnect,
    /// End.
    End,
}

impl Step {
    /// When to come again if nothing happens before.
    pub(crate) fn until(&self) -> Option<Duration> {
        match self {
            Self::Send(until) | Self::Wait(until) => *until,
            Self::Connect | Self::Disconnect | Self::End => None,
        }
    }
}

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

/// The one request that is on the wire.
#[derive(Debug)]
struct Exchange {
    place: Place,
    unit: u8,
    write: bool,
    timeout: Duration,
    tries: u8,
    started: Duration,
    sent: Sent,
    ear: Ear,
}

impl Exchange {
    /// Whether it is a write of which the device may know.
    fn may_have_left(&self) -> bool {
        self.write && self.sent != Sent::Nothing
    }
}

/// How much of a request the system has taken.
#[derive(Debug, PartialEq, Eq)]
enum Sent {
    Nothing,
    Part,
    Whole,
}

#[derive(Debug)]
struct Rules {
    spacing: Duration,
    retries: u8,
    timeouts_to_drop: u32,
    backoff: Backoff,
}

#[cfg(test)]
mod pace;
#[cfg(test)]
mod promises;
#[cfg(test)]
mod script;
#[cfg(test)]
mod tests;
