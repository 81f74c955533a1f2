//! The rules of one wire as a pure state machine: time, bytes and events in; the next step out.
//!
//! It has no clock and no socket, so every rule is tested as a script. `shared` does what it says and tells it what
//! happened.

mod connection;
mod exchange;

use std::sync::Arc;
use std::task::{Poll, Waker};
use std::time::Duration;

use busbar_modbus::client::DEFAULT_QUIET;
use busbar_modbus::{Client, Progress};

use crate::doubt::Doubts;
use crate::endpoint::Endpoint;
use crate::error::{Cause, LinkError, Loss};
use crate::job::{Job, Outcome, Priority};
use crate::line::Line;
use crate::options::{Backoff, Options};
use crate::queue::{Entry, Pick, Place, Queue, Ticket, Turn};
use crate::silence::Silence;
use crate::statistics::Statistics;
use crate::unit::{Unit, Units};
use exchange::{Exchange, Sent};

pub(crate) use connection::Phase;

/// Longer waits are cut to this, so that no sum of times overflows.
const LONGEST_WAIT: Duration = Duration::from_secs(24 * 60 * 60);

/// Who waits for a silent line waits so long at least: what is late may take as long.
const LEAST_PATIENCE: Duration = DEFAULT_QUIET.saturating_mul(2);

/// A poll of a unit that never answered goes ahead of another once it has waited so many of its time-outs, and one of a
/// silent unit after so many.
const NEW_PATIENCE: u32 = 3;
const SILENT_PATIENCE: u32 = 10;

/// One wire: what waits, what is under way, and what state the connection is in.
#[derive(Debug)]
pub(crate) struct Wire {
    endpoint: Arc<Endpoint>,
    rules: Rules,
    line: Line,
    client: Client,
    queue: Queue,
    phase: Phase,
    exchange: Option<Exchange>,
    /// Writes that belong together, in the middle of which nothing else leaves.
    together: Option<Place>,
    /// No request leaves before this: spacing, and the silence of the line.
    earliest: Duration,
    /// RTU: since when bytes that nobody asked for have kept the next request from leaving.
    disturbed: Option<Duration>,
    units: Units,
    silence: Silence,
    /// When the first request left since anybody answered.
    unanswered_since: Option<Duration>,
    doubts: Doubts,
    /// Exchanges started, which says what was served last.
    started: u64,
    /// Connections that failed since the last one that proved good.
    failures: u32,
    /// The connection in use is no good any more, and the task does not know yet.
    hang_up: bool,
    /// The phase has changed since the task last asked.
    news: bool,
    closed: bool,
    connections: u64,
    connected_at: Duration,
    /// Answers on this connection.
    answers: u64,
    /// Bytes that came while no answer was due.
    unasked_bytes: u64,
    /// Bad checksums and bytes of no frame that were put down to somebody.
    damage: (u64, u64),
    /// Own requests that came back and were found on the way in; the client has others.
    echoes: u64,
}

impl Wire {
    pub(crate) fn new(endpoint: Arc<Endpoint>, line: Line, options: &Options) -> Self {
        Self {
            endpoint,
            rules: Rules {
                spacing: options.spacing.min(LONGEST_WAIT),
                retries: options.retries,
                timeouts_to_drop: options.timeouts_to_drop,
                timeout_floor: options.timeout_floor,
                backoff: options.backoff,
                probes: options.probes,
            },
            line,
            client: Client::new(line.framing),
            queue: Queue::new(options.queue),
            phase: Phase::Connecting { trying: false, since: Duration::ZERO },
            exchange: None,
            together: None,
            earliest: Duration::ZERO,
            disturbed: None,
            units: Units::default(),
            silence: Silence::default(),
            unanswered_since: None,
            doubts: Doubts::default(),
            started: 0,
            failures: 0,
            hang_up: false,
            news: false,
            closed: false,
            connections: 0,
            connected_at: Duration::ZERO,
            answers: 0,
            unasked_bytes: 0,
            damage: (0, 0),
            echoes: 0,
        }
    }

    // What callers do.

    /// Takes a job in, or refuses it at once.
    pub(crate) fn submit(&mut self, now: Duration, job: Job, waker: &Waker) -> Result<Ticket, Outcome> {
        if let Err(error) = self.accepts(now, job.unit, job.priority) {
            return Err(Outcome { result: Err(error), registers: job.registers, done: 0 });
        }
        let (timeout, spacing) = (job.timeout.min(LONGEST_WAIT), job.spacing.min(LONGEST_WAIT));
        let job = Job { timeout, spacing, ..job };
        let is_poll = job.priority == Priority::Poll;
        let modest_until = is_poll.then(|| self.modest_until(now, job.unit, job.timeout)).flatten();
        let waker = Some(waker.clone());
        Ok(self.queue.push(Entry { job, since: now, tries: 0, modest_until, waker }))
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
                true => LinkError::Lost { unit: exchange.unit(), loss: Loss::Closed },
                false => LinkError::Closed,
            };
            self.queue.finish(exchange.place, Err(error), wakes);
        }
        if let Some(place) = self.together.take() {
            self.queue.finish(place, Err(LinkError::Closed), wakes);
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
        let nobody_waits = self.queue.is_empty() && self.together.is_none();
        matches!(self.phase, Phase::Connected) && !self.hang_up && !self.news && nobody_waits
    }

    /// A copy of everything counted.
    pub(crate) fn statistics(&self, now: Duration) -> Statistics {
        let seen = self.client.counters();
        let mut statistics = Statistics {
            late: seen.late,
            wrong_unit: seen.wrong_unit,
            wrong_function: seen.wrong_function,
            wrong_length: seen.wrong_length,
            wrong_echo: seen.wrong_echo,
            wrong_protocol: seen.wrong_protocol,
            crc_errors: seen.crc_errors,
            garbage_bytes: seen.garbage_bytes,
            bytes_received: self.unasked_bytes,
            reconnects: self.connections.saturating_sub(1),
            echoes: self.echoes + seen.echoes,
            open_for: now,
            ..Statistics::default()
        };
        let slots = self.has_slots();
        for unit in self.units.iter() {
            let busy = self.line.time(unit.counts.bytes_sent + unit.counts.bytes_received);
            statistics.add(unit.statistics(now, busy, slots));
        }
        statistics.busy = self.line.time(statistics.bytes_sent + statistics.bytes_received);
        statistics
    }

    // What the task reports.

    /// RTU: so many bytes were on the line, whatever they are, and how long the echo of our own request is if they end
    /// one. The line has to be silent after them.
    pub(crate) fn heard(&mut self, now: Duration, bytes: usize, echo: Option<usize>) {
        self.echoes += u64::from(echo.is_some());
        self.break_silence(now);
        if let Some(exchange) = &mut self.exchange {
            exchange.ear.hears(bytes, echo);
        }
    }

    /// Bytes came.
    pub(crate) fn received(&mut self, now: Duration, bytes: &[u8], wakes: &mut Vec<Waker>) {
        self.hear(now, bytes);
        match self.client.receive(now, bytes) {
            Progress::Answered => self.answered(now, wakes),
            Progress::TimedOut => self.timed_out(now, wakes),
            Progress::Pending | Progress::Broken(_) => {}
        }
        while let Some(stray) = self.client.take_stray() {
            self.strayed(now, &stray);
        }
        // An answer may stand in front of the bytes that break the stream.
        if self.client.fault().is_some() {
            self.hang_up(now, Cause::Garbage, wakes);
        }
    }

    /// The line echoes, and the request that leaves looks like its confirmation.
    pub(crate) fn expect_echo(&mut self) {
        self.client.ignore_echo();
    }

    /// Answers on this connection.
    pub(crate) fn answers(&self) -> u64 {
        self.answers
    }

    /// When what came is looked at again, if not only at the deadline.
    pub(crate) fn next_look(&self) -> Option<Duration> {
        self.exchange.as_ref().and_then(Exchange::next_look)
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
        match self.start_or_wait(now, out, wakes) {
            Start::Sent(until) => Some(until),
            Start::Wait(_) => None,
        }
    }

    /// The phase, if it has changed since this was last asked.
    pub(crate) fn news(&mut self) -> Option<&Phase> {
        std::mem::take(&mut self.news).then_some(&self.phase)
    }

    fn accepts(&mut self, now: Duration, unit: u8, priority: Priority) -> Result<(), LinkError> {
        if self.closed {
            return Err(LinkError::Closed);
        }
        if let Phase::Down { reason, .. } = &self.phase {
            return Err(LinkError::Down { reason: reason.clone() });
        }
        self.queue.room(priority)?;
        if priority != Priority::Poll || !self.has_slots() {
            return Ok(());
        }
        let Some(unit) = self.units.get_mut(unit).filter(|unit| unit.is_silent()) else {
            return Ok(());
        };
        if now < unit.next_probe {
            unit.counts.held += 1;
            return Err(silent(now, unit.id, unit.next_probe));
        }
        // This poll takes the slot.
        unit.next_probe = now + self.rules.probes.delay(unit.probes()).min(LONGEST_WAIT);
        Ok(())
    }

    /// Whether silent units are polled in slots only: where others answer, who are held up otherwise, and on a serial
    /// line, where there is no connection whose end would help.
    fn has_slots(&self) -> bool {
        self.line.is_serial() || self.silence.has_answering()
    }

    fn step_connected(&mut self, now: Duration, out: &mut Vec<u8>, wakes: &mut Vec<Waker>) -> Step {
        if let Some(until) = self.look_after(now, wakes) {
            return Step::Wait(Some(until));
        }
        if std::mem::take(&mut self.hang_up) {
            return Step::Disconnect;
        }
        match self.start_or_wait(now, out, wakes) {
            Start::Sent(until) => Step::Send(Some(until)),
            Start::Wait(until) => Step::Wait(until),
        }
    }

    /// Starts the exchange whose turn it is, or says when to come again.
    fn start_or_wait(&mut self, now: Duration, out: &mut Vec<u8>, wakes: &mut Vec<Waker>) -> Start {
        let free = matches!(self.phase, Phase::Connected) && self.exchange.is_none();
        if self.closed || self.hang_up || !free {
            return Start::Wait(None);
        }
        let ready = self.ready();
        if now < ready {
            return Start::Wait(self.wait_for_silence(now, wakes).map(|until| until.min(ready)));
        }
        self.disturbed = None;
        loop {
            let place = match self.pick(now) {
                Pick::Job(place) => place,
                Pick::Wait(until) => return Start::Wait(Some(until)),
                Pick::Nobody => return Start::Wait(None),
            };
            match self.start(now, place, out) {
                Ok(until) => return Start::Sent(until),
                Err(error) => self.queue.finish(place, Err(error), wakes),
            }
        }
    }

    /// When the next request may leave if the line stays silent.
    fn ready(&self) -> Duration {
        self.client.quiet_until().map_or(self.earliest, |until| until.max(self.earliest))
    }

    /// RTU: something is on the line, which has to be silent after it.
    fn break_silence(&mut self, now: Duration) {
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
    fn wait_for_silence(&mut self, now: Duration, wakes: &mut Vec<Waker>) -> Option<Duration> {
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

    /// Until when a poll lets those of others go first, if nobody knows whether its unit will answer.
    fn modest_until(&self, now: Duration, unit: u8, timeout: Duration) -> Option<Duration> {
        let unit = self.units.get(unit);
        let timeouts = match unit.is_some_and(Unit::is_silent) {
            true => SILENT_PATIENCE,
            false => NEW_PATIENCE,
        };
        unit.is_none_or(Unit::is_doubtful).then(|| now + timeout.saturating_mul(timeouts))
    }

    fn pick(&mut self, now: Duration) -> Pick {
        let Self { queue, units, doubts, line, together, .. } = self;
        let mut turn = |entry: &Entry| {
            let job = &entry.job;
            let (mut until, served) = units
                .get(job.unit)
                .map_or_else(Default::default, |unit| (unit.rested(job.spacing), unit.served));
            if line.is_rtu() {
                let hold = doubts.hold(now, &job.question(), entry.tries > 0);
                until = hold.map_or(until, |hold| hold.max(until));
            }
            match until <= now {
                true => Turn::Now(served),
                false => Turn::At(until),
            }
        };
        let Some(place) = *together else {
            return queue.pick(now, turn);
        };
        match queue.entry(place).map(|entry| turn(entry)) {
            Some(Turn::At(until)) => Pick::Wait(until),
            Some(Turn::Now(_)) | None => {
                *together = None;
                Pick::Job(place)
            }
        }
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

/// What became of an attempt to start an exchange.
enum Start {
    /// The frame is to be sent, and looked after then.
    Sent(Duration),
    /// Come again then, if anybody waits.
    Wait(Option<Duration>),
}

#[derive(Debug)]
struct Rules {
    spacing: Duration,
    retries: u8,
    timeouts_to_drop: u32,
    timeout_floor: Duration,
    backoff: Backoff,
    probes: Backoff,
}

/// What a poll of a silent unit is told until its next slot.
fn silent(now: Duration, unit: u8, next_probe: Duration) -> LinkError {
    let millis = next_probe.saturating_sub(now).as_micros().div_ceil(1000);
    let next_probe = Duration::from_millis(u64::try_from(millis).unwrap_or(u64::MAX));
    LinkError::Silent { unit, next_probe }
}

#[cfg(test)]
mod lateness;
#[cfg(test)]
mod noise;
#[cfg(test)]
mod pace;
#[cfg(test)]
mod promises;
#[cfg(test)]
mod rtu;
#[cfg(test)]
mod script;
#[cfg(test)]
mod sim;
#[cfg(test)]
mod sweep;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod units;
