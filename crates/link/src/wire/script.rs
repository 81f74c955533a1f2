//! What a script of a wire is written with: steps, events and outcomes at given milliseconds.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::Wake;

use super::*;
use crate::endpoint::Serial;
use crate::error::Outage;
use crate::heard::Heard;
use crate::job::{Ask, Write};

pub(super) const TIMEOUT: u64 = 1000;
pub(super) const NOTHING: Heard = Heard::Nothing { serial: false };
const ADDRESS: u16 = 10246;

pub(super) fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

pub(super) struct Script {
    pub(super) wire: Wire,
    pub(super) out: Vec<u8>,
    pub(super) wakes: Vec<Waker>,
    woken: Arc<Woken>,
}

impl Script {
    pub(super) fn new() -> Self {
        Self::with(Options::default())
    }

    /// A wire whose time-outs are always the same, unless the options say otherwise.
    pub(super) fn with(options: Options) -> Self {
        Self::on(Line::tcp(), Options { timeout_floor: ms(TIMEOUT), ..options })
    }

    pub(super) fn on(line: Line, options: Options) -> Self {
        Self {
            wire: Wire::new(endpoint(), line, &options),
            out: Vec::new(),
            wakes: Vec::new(),
            woken: Arc::default(),
        }
    }

    pub(super) fn connected() -> Self {
        let mut script = Self::new();
        script.connect(0);
        script
    }

    pub(super) fn connect(&mut self, at: u64) {
        assert_eq!(self.step(at), Step::Connect);
        self.wire.connected(ms(at));
    }

    /// A serial line of 9600 baud, 8N1: 1.041667 ms a character, 3.645834 ms of silence. It has been silent already.
    pub(super) fn serial() -> Self {
        Self::serial_with(Options::default())
    }

    pub(super) fn serial_with(options: Options) -> Self {
        let mut script = Self::on(Line::rtu(&Serial::default()), options);
        script.connect(0);
        script.wire.earliest = Duration::ZERO;
        script
    }

    pub(super) fn step(&mut self, at: u64) -> Step {
        self.step_at(ms(at))
    }

    pub(super) fn step_at(&mut self, at: Duration) -> Step {
        self.wire.step(at, &mut self.out, &mut self.wakes)
    }

    /// Steps, and expects a frame to leave; gives back unit and address, and how long its answer is waited for.
    pub(super) fn asks(&mut self, at: u64) -> (u8, u16, Duration) {
        let Step::Send(Some(until)) = self.step(at) else { panic!("nothing leaves at {at} ms") };
        let front = if self.wire.line.is_rtu() { 0 } else { 6 };
        let address = u16::from_be_bytes([self.out[front + 2], self.out[front + 3]]);
        (self.out[front], address, until - ms(at))
    }

    /// Steps, and expects a frame to leave.
    pub(super) fn sends(&mut self, at: u64) -> Vec<u8> {
        assert_eq!(self.step(at), Step::Send(Some(ms(at + TIMEOUT))));
        self.out.clone()
    }

    pub(super) fn submit(&mut self, at: u64, priority: Priority, ask: Ask) -> Result<Ticket, LinkError> {
        self.submit_to(at, 1, priority, ask)
    }

    pub(super) fn submit_to(
        &mut self,
        at: u64,
        unit: u8,
        priority: Priority,
        ask: Ask,
    ) -> Result<Ticket, LinkError> {
        self.submit_job(at, Job { ask, priority, ..job(unit) })
    }

    pub(super) fn submit_job(&mut self, at: u64, job: Job) -> Result<Ticket, LinkError> {
        let waker = Waker::from(Arc::clone(&self.woken));
        let submitted = self.wire.submit(ms(at), job, &waker);
        submitted.map_err(|outcome| outcome.result.unwrap_err())
    }

    pub(super) fn read(&mut self, at: u64) -> Ticket {
        self.submit(at, Priority::Person, read(ADDRESS)).unwrap()
    }

    pub(super) fn write(&mut self, at: u64, value: u16) -> Ticket {
        self.submit(at, Priority::Command, write(value)).unwrap()
    }

    pub(super) fn hears(&mut self, at: u64, bytes: &[u8]) {
        self.wire.received(ms(at), bytes, &mut self.wakes);
    }

    pub(super) fn loses(&mut self, at: u64, cause: Cause) {
        self.wire.lost(ms(at), cause, &mut self.wakes);
    }

    pub(super) fn refuses(&mut self, at: u64, cause: Cause) {
        self.wire.refused(ms(at), cause, &mut self.wakes);
    }

    pub(super) fn outcome(&mut self, ticket: &Ticket) -> Option<Result<Vec<u16>, LinkError>> {
        match self.wire.take(ticket, &Waker::from(Arc::clone(&self.woken))) {
            Poll::Ready(outcome) => Some(outcome.result.map(|()| outcome.registers)),
            Poll::Pending => None,
        }
    }

    pub(super) fn statistics(&self) -> Statistics {
        self.wire.statistics(Duration::ZERO)
    }
}

pub(super) fn endpoint() -> Arc<Endpoint> {
    Arc::new("tcp://10.0.0.7".parse().unwrap())
}

pub(super) fn down(cause: Cause) -> LinkError {
    LinkError::Down { reason: Outage { endpoint: endpoint(), cause } }
}

pub(super) fn lost(cause: Cause) -> LinkError {
    LinkError::Lost { unit: 1, loss: Loss::Dropped(Outage { endpoint: endpoint(), cause }) }
}

/// A read that a person waits for.
pub(super) fn job(unit: u8) -> Job {
    Job {
        unit,
        ask: read(ADDRESS),
        priority: Priority::Person,
        timeout: ms(TIMEOUT),
        spacing: Duration::ZERO,
        short: false,
        registers: Vec::new(),
    }
}

pub(super) fn read(address: u16) -> Ask {
    Ask::Holding { address, count: 2 }
}

pub(super) fn write(value: u16) -> Ask {
    Ask::Write(Write::Register { address: 8193, value })
}

pub(super) fn frame(transaction: u16, pdu: &[u8]) -> Vec<u8> {
    let [high, low] = transaction.to_be_bytes();
    let length = u8::try_from(pdu.len() + 1).unwrap();
    [&[high, low, 0, 0, 0, length, 1], pdu].concat()
}

/// The answer of a unit on RTU.
pub(super) fn rtu_frame(unit: u8, pdu: &[u8]) -> Vec<u8> {
    let body = [&[unit], pdu].concat();
    [&body[..], &busbar_modbus::rtu::crc16(&body).to_le_bytes()].concat()
}

/// The answer of a unit to `read` on RTU.
pub(super) fn rtu_answer(unit: u8, first: u16) -> Vec<u8> {
    let [high, low] = first.to_be_bytes();
    rtu_frame(unit, &[0x03, 4, high, low, 0, 0])
}

/// The answer of a unit to `read`.
pub(super) fn answer_of(unit: u8, transaction: u16) -> Vec<u8> {
    let mut answer = answer(transaction);
    answer[6] = unit;
    answer
}

/// The answer to `read`.
pub(super) fn answer(transaction: u16) -> Vec<u8> {
    frame(transaction, &[0x03, 4, 0x08, 0xFE, 0, 0])
}

/// The answer to `write(4)`.
pub(super) fn echo(transaction: u16) -> Vec<u8> {
    frame(transaction, &[0x06, 0x20, 0x01, 0, 4])
}

#[derive(Default)]
pub(super) struct Woken(AtomicUsize);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}
