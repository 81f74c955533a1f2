//! One exchange from its request to its end: an answer, a time-out or a drop.

use std::task::Waker;
use std::time::Duration;

use busbar_modbus::client::DEFAULT_QUIET;
use busbar_modbus::{Progress, Response, Stray};

use super::{Wire, silent};
use crate::error::{Cause, LinkError, Loss};
use crate::heard::Ear;
use crate::job::{Priority, Question};
use crate::line::Line;
use crate::queue::Place;

/// For so many times the longest time-out after that is over, a request on RTU may still be answered.
const HORIZON: u32 = 2;

/// An answer has at least so many bytes on RTU. Fewer are noise, and the answer may still come.
const LEAST_ANSWER: u64 = 5;

/// The one request that is on the wire.
#[derive(Debug)]
pub(super) struct Exchange {
    pub(super) place: Place,
    question: Question,
    poll: bool,
    tries: u8,
    pub(super) sent: Sent,
    /// What came begins as the answer must.
    in_step: bool,
    /// Bytes that came.
    heard: u64,
    /// Bytes of no frame among them.
    garbage: u64,
    /// How long the answer is waited for.
    timeout: Duration,
    /// The longest that any try would wait.
    limit: Duration,
    spacing: Duration,
    started: Duration,
    deadline: Duration,
    /// What is heard instead of an answer.
    pub(super) ear: Ear,
    /// When silence will have ended what has come so far, if that does not look like the answer.
    silence: Option<Duration>,
}

impl Exchange {
    pub(super) fn unit(&self) -> u8 {
        self.question.unit
    }

    /// When what came is looked at again, if not only at the deadline.
    pub(super) fn next_look(&self) -> Option<Duration> {
        self.silence
    }

    /// Until when its answer may come.
    fn horizon(&self) -> Duration {
        let given_up = self.deadline + (self.limit - self.timeout);
        given_up + self.limit.saturating_mul(HORIZON)
    }

    /// Whether it is a write of which the device may know.
    pub(super) fn may_have_left(&self) -> bool {
        self.question.write && self.sent != Sent::Nothing
    }
}

/// How much of a request the system has taken.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Sent {
    Nothing,
    Part,
    Whole,
}

impl Wire {
    /// Begins an exchange; says when to look after it.
    pub(super) fn start(
        &mut self,
        now: Duration,
        place: Place,
        out: &mut Vec<u8>,
    ) -> Result<Duration, LinkError> {
        let has_slots = self.has_slots();
        let Some(entry) = self.queue.entry(place) else {
            return Err(LinkError::Closed);
        };
        let job = &entry.job;
        let question = job.question();
        let Some(request) = job.ask.request() else {
            return Err(LinkError::Closed);
        };
        let limit = job.timeout;
        let poll = job.priority == Priority::Poll;
        let floor = self.rules.timeout_floor;
        let timeout = match self.units.get(job.unit) {
            // Nothing is given up before one try has waited as long as the caller would.
            _ if question.write || entry.tries > 0 => limit,
            None => limit,
            // A probe is no reason to make the others wait long. Who turns out to be slower is heard late.
            Some(unit) if poll && has_slots && unit.is_silent() => {
                let own = unit.timing.probe(floor, limit);
                own.or_else(|| self.units.slowest(floor, limit)).unwrap_or(limit)
            }
            Some(unit) => unit.timing.timeout(floor, limit),
        };
        let patience = timeout + time_on_line(&self.line, &question);
        self.client.start(now, job.unit, &request, patience, out)?;
        if job.short {
            self.client.accept_short();
        }
        self.started += 1;
        let unit = self.units.record(job.unit);
        unit.served = self.started;
        unit.counts.requests += 1;
        unit.counts.retries += u64::from(entry.tries > 0);
        unit.counts.bytes_sent += out.len() as u64;
        entry.tries += 1;
        self.exchange = Some(Exchange {
            place,
            question,
            poll,
            tries: entry.tries,
            sent: Sent::Whole,
            in_step: true,
            heard: 0,
            garbage: 0,
            timeout,
            limit,
            spacing: job.spacing,
            started: now,
            deadline: now + patience,
            ear: Ear::new(self.client.counters()),
            silence: None,
        });
        Ok(now + patience)
    }

    /// Looks after what is under way, and says when to do so again; none when nothing is.
    pub(super) fn look_after(&mut self, now: Duration, wakes: &mut Vec<Waker>) -> Option<Duration> {
        let exchange = self.exchange.as_mut()?;
        let deadline = self.client.deadline()?;
        let next = exchange.silence.map_or(deadline, |silence| silence.min(deadline));
        if now < next {
            return Some(next);
        }
        exchange.silence = None;
        match self.client.silence(now) {
            Progress::Answered => self.answered(now, wakes),
            Progress::TimedOut => self.timed_out(now, wakes),
            Progress::Pending | Progress::Broken(_) => {}
        }
        while let Some(stray) = self.client.take_stray() {
            self.strayed(now, &stray);
        }
        self.exchange.as_ref().map(|_| deadline)
    }

    /// Takes note of bytes before anybody looks at what they are.
    pub(super) fn hear(&mut self, now: Duration, bytes: &[u8]) {
        let len = bytes.len() as u64;
        if self.line.is_rtu() && len > 0 {
            self.break_silence(now);
        }
        let Some(exchange) = &mut self.exchange else {
            self.unasked_bytes += len;
            return;
        };
        self.units.record(exchange.question.unit).counts.bytes_received += len;
        if !self.line.is_rtu() {
            return;
        }
        // Its first two bytes say whether this is the answer, which has a length. What begins otherwise is noise or
        // half a frame; it may look as if more of it were to come, and keep the answer behind it waiting.
        let front = [exchange.question.unit, exchange.question.function];
        let rest = front.iter().skip(usize::try_from(exchange.heard).unwrap_or(usize::MAX));
        exchange.in_step &= rest.zip(bytes).all(|(due, found)| due == found || *due == found & 0x7F);
        exchange.heard += len;
        // Where the speed of the line is unknown, there is no telling how long a gap may be.
        let ends = !exchange.in_step && self.line.is_serial();
        exchange.silence = ends.then(|| now + DEFAULT_QUIET + self.line.silence);
    }

    /// A frame came that answers nothing under way.
    pub(super) fn strayed(&mut self, now: Duration, stray: &Stray) {
        if let Some(unit) = self.units.get_mut(stray.unit) {
            unit.answered_late(now);
        }
        if self.line.is_rtu() {
            self.doubts.seen(now, stray);
            // Who sends what nobody asked for may send more of it.
            self.earliest = self.earliest.max(now + DEFAULT_QUIET);
        }
    }

    /// Puts new damage down to the unit whose answer is due.
    fn note_damage(&mut self) {
        let seen = self.client.counters();
        let (crc_errors, garbage) = (seen.crc_errors - self.damage.0, seen.garbage_bytes - self.damage.1);
        self.damage = (seen.crc_errors, seen.garbage_bytes);
        if let Some(exchange) = &mut self.exchange {
            exchange.garbage += garbage;
            let counts = &mut self.units.record(exchange.question.unit).counts;
            counts.crc_errors += crc_errors;
            counts.garbage_bytes += garbage;
        }
    }

    /// The exchange is over, one way or another.
    fn end(&mut self, now: Duration) -> Option<Exchange> {
        if self.line.is_rtu() {
            self.note_damage();
        }
        let exchange = self.exchange.take()?;
        self.earliest = self.earliest.max(now + self.rules.spacing);
        self.units.record(exchange.unit()).exchanged(exchange.started, now, exchange.spacing);
        Some(exchange)
    }

    pub(super) fn answered(&mut self, now: Duration, wakes: &mut Vec<Waker>) {
        let Some(exchange) = self.end(now) else { return };
        let Some(response) = self.client.response() else {
            // It said that there is one.
            self.exchange = Some(exchange);
            return self.hang_up(now, Cause::Garbage, wakes);
        };
        let is_exception = matches!(response, Response::Exception { .. });
        let latency = now.saturating_sub(exchange.started);
        let reaction = latency.saturating_sub(time_on_line(&self.line, &exchange.question));
        // On RTU an answer to a retry may be the one to the first try.
        let is_certain = !self.line.is_rtu() || exchange.tries == 1;

        self.answers += 1;
        self.silence.answered(exchange.unit());
        self.unanswered_since = None;
        let unit = self.units.record(exchange.unit());
        unit.answered(is_certain.then_some(reaction));
        unit.counts.answers += 1;
        unit.counts.latency.record(latency);

        if let Response::Exception { function, code } = response {
            *unit.counts.exceptions.entry(code.0).or_default() += 1;
            let error = LinkError::Exception { unit: exchange.unit(), function, code };
            // An exception has no length: it may be the late answer to another question.
            let is_doubtful = self.line.is_rtu() && self.doubts.may_refuse(now, &exchange.question);
            if is_doubtful {
                self.doubt(now, &exchange);
            }
            if !(is_doubtful && self.retry(now, &exchange)) {
                self.queue.finish(exchange.place, Err(error), wakes);
            }
        } else {
            self.fulfil(&exchange, wakes);
        }
        if self.line.is_rtu() && !is_exception {
            self.doubts.answered(now, &exchange.question, exchange.horizon());
        }
    }

    /// Hands the answer over; of writes that belong together the next one follows.
    fn fulfil(&mut self, exchange: &Exchange, wakes: &mut Vec<Waker>) {
        if let Some(entry) = self.queue.entry(exchange.place) {
            if let Some(Response::ReadHoldingRegisters(values) | Response::ReadInputRegisters(values)) =
                self.client.response()
            {
                let registers = &mut entry.job.registers;
                registers.resize(values.len(), 0);
                registers.iter_mut().zip(values.iter()).for_each(|(register, value)| *register = value);
            }
            if entry.job.ask.advance() {
                entry.tries = 0;
                self.together = Some(exchange.place);
                return;
            }
        }
        self.queue.finish(exchange.place, Ok(()), wakes);
    }

    pub(super) fn timed_out(&mut self, now: Duration, wakes: &mut Vec<Waker>) {
        if self.exchange.as_ref().is_some_and(|exchange| exchange.sent != Sent::Whole) {
            // Half a frame is in the connection: nothing may follow it.
            return self.hang_up(now, Cause::Stuck, wakes);
        }
        let Some(exchange) = self.end(now) else { return };
        // What began as the answer and came garbled was the answer, unless somebody else's was still due.
        let is_garbled = exchange.in_step && exchange.garbage >= LEAST_ANSWER;
        let is_spent = is_garbled && !self.doubts.is_any(now);
        if self.line.is_rtu() && !is_spent {
            self.doubt(now, &exchange);
        }
        let Exchange { place, timeout: after, tries, .. } = exchange;
        let heard = exchange.ear.judge(self.line.is_rtu(), self.client.counters());
        let unit = exchange.unit();
        let was_silent = tries == 1 && self.silence.is_silent(unit);
        self.silence.timed_out(unit);
        self.units.record(unit).missed(exchange.started);
        let waiting = self.queue.waiting().map(|entry| entry.job.unit);
        let is_dead = self.silence.is_dead(self.rules.timeouts_to_drop, waiting);
        // Short time-outs come fast one after the other, and a connection may stall for longer than that.
        let since = *self.unanswered_since.get_or_insert(exchange.started);
        let is_long = now.saturating_sub(since) >= exchange.limit.saturating_mul(self.rules.timeouts_to_drop);
        let dead = is_dead && is_long && !self.line.is_serial();
        // Who was silent before gets one try while others answer.
        let again = !was_silent || dead || !self.has_slots();
        if exchange.question.write {
            let loss = Loss::TimedOut { after, heard };
            self.queue.finish(place, Err(LinkError::Lost { unit, loss }), wakes);
        } else if !again || !self.retry(now, &exchange) {
            self.queue.finish(place, Err(LinkError::Timeout { unit, after, tries, heard }), wakes);
        }
        if dead {
            let requests = self.silence.timeouts();
            self.hang_up(now, Cause::Silent { requests }, wakes);
        } else if self.has_slots() {
            self.give_slots(now, unit, exchange.poll, wakes);
        }
    }

    /// After a time-out: gives a unit that is silent its next slot, and nothing but that.
    fn give_slots(&mut self, now: Duration, id: u8, poll: bool, wakes: &mut Vec<Waker>) {
        let unit = self.units.record(id);
        // What a person or a command asked moves no slot.
        if !unit.is_silent() || !poll && unit.probes() > 0 {
            return;
        }
        let next_probe = now + self.rules.probes.delay(unit.missed_probe()).min(super::LONGEST_WAIT);
        unit.next_probe = next_probe;
        self.queue.fail_waiting(
            |entry| {
                let is_poll = entry.job.unit == id && entry.job.priority == Priority::Poll;
                is_poll.then(|| silent(now, id, next_probe))
            },
            wakes,
        );
    }

    /// The answer may still come, and must not be taken for another.
    fn doubt(&mut self, now: Duration, exchange: &Exchange) {
        self.doubts.lost(now, exchange.question, exchange.horizon());
    }

    /// Ends or requeues the exchange that a drop cut off.
    pub(super) fn drop_exchange(
        &mut self,
        now: Duration,
        exchange: &Exchange,
        cause: Cause,
        wakes: &mut Vec<Waker>,
    ) {
        if self.line.is_rtu() && exchange.sent != Sent::Nothing {
            self.doubt(now, exchange);
        }
        let unit = exchange.unit();
        self.units.record(unit).exchanged(exchange.started, now, exchange.spacing);
        let reason = self.outage(cause);
        let error = match exchange.may_have_left() {
            true => LinkError::Lost { unit, loss: Loss::Dropped(reason) },
            false => LinkError::Down { reason },
        };
        if !self.retry(now, exchange) {
            self.queue.finish(exchange.place, Err(error), wakes);
        }
    }

    /// Puts a read back behind the others of its class if it may be sent once more. The one place where
    /// anything is sent again, and no write gets past its first line.
    fn retry(&mut self, now: Duration, exchange: &Exchange) -> bool {
        if exchange.question.write || exchange.tries > self.rules.retries {
            return false;
        }
        let modest_until =
            exchange.poll.then(|| self.modest_until(now, exchange.unit(), exchange.limit)).flatten();
        let Some(entry) = self.queue.entry(exchange.place) else {
            return false;
        };
        entry.modest_until = modest_until;
        self.queue.put_back(exchange.place);
        true
    }
}

/// How long a request and its full answer are on the line.
fn time_on_line(line: &Line, question: &Question) -> Duration {
    let pdus = [question.request_pdu(), question.answer_pdu()];
    line.time(pdus.into_iter().map(|pdu| line.frame(pdu)).sum())
}
