//! A seeded play of devices on a line, in virtual time: frames as they are, latency, loss, lateness, dead units, the
//! speed of the line and collisions on it. It drives a `Wire` just as its task does.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use busbar_modbus::{Registers, Response, mbap, rtu};

use super::*;
use crate::job::{Ask, Write};

/// Chance that comes out the same each time (SplitMix64).
pub(super) struct Chance(pub(super) u64);

impl Chance {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    pub(super) fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    /// Happens in so many of a thousand cases.
    pub(super) fn happens(&mut self, per_mille: u64) -> bool {
        self.below(1000) < per_mille
    }

    pub(super) fn between(&mut self, least: Duration, most: Duration) -> Duration {
        let span = u64::try_from((most - least).as_nanos()).unwrap();
        least + Duration::from_nanos(self.below(span + 1))
    }
}

/// What carries the frames.
pub(super) enum Medium {
    /// Half duplex: frames take their time, and two at once destroy each other.
    Line { character: Duration },
    /// TCP: each way takes so long, and a byte this much more; of a thousand packets so many are lost and sent again
    /// after `again`, which those behind them have to wait for.
    Network { trip: Duration, byte: Duration, lost_per_mille: u64, again: Duration },
}

/// What a device does with one request.
pub(super) struct Fate {
    /// How long it takes to answer; it may not at all.
    pub(super) answers: Option<Duration>,
    /// How long after its answer the same bytes come once more.
    pub(super) repeats: Option<Duration>,
}

/// One frame on its way to us.
struct Flight {
    begins: Duration,
    ends: Duration,
    bytes: Vec<u8>,
    destroyed: bool,
}

pub(super) struct Sim<Device> {
    pub(super) wire: Wire,
    pub(super) now: Duration,
    pub(super) chance: Chance,
    /// Values that devices took, as they took them.
    pub(super) written: Vec<u16>,
    medium: Medium,
    device: Device,
    out: Vec<u8>,
    wakes: Vec<Waker>,
    alarm: Option<Duration>,
    flights: Vec<Option<Flight>>,
    /// When something of a flight comes: its first byte, or all the rest.
    comes: BinaryHeap<Reverse<(Duration, usize, bool)>>,
    /// Until when the line is taken by our own request.
    own: Duration,
    /// When the last packet came, there and here.
    last_packet: [Duration; 2],
}

impl<Device: FnMut(&mut Chance, u8) -> Fate> Sim<Device> {
    pub(super) fn new(line: Line, options: &Options, medium: Medium, seed: u64, device: Device) -> Self {
        Self {
            wire: Wire::new(Arc::new("tcp://192.0.2.1".parse().unwrap()), line, options),
            now: Duration::ZERO,
            chance: Chance(seed),
            written: Vec::new(),
            medium,
            device,
            out: Vec::new(),
            wakes: Vec::new(),
            alarm: None,
            flights: Vec::new(),
            comes: BinaryHeap::new(),
            own: Duration::ZERO,
            last_packet: [Duration::ZERO; 2],
        }
    }

    pub(super) fn submit(&mut self, job: Job) -> Result<Ticket, LinkError> {
        let submitted = self.wire.submit(self.now, job, Waker::noop());
        submitted.map_err(|outcome| outcome.result.unwrap_err())
    }

    pub(super) fn outcome(&mut self, ticket: &Ticket) -> Option<Outcome> {
        match self.wire.take(ticket, Waker::noop()) {
            Poll::Ready(outcome) => Some(outcome),
            Poll::Pending => None,
        }
    }

    /// Lets the wire do all that it can do now, and then goes on to the next instant at which anything happens, but not
    /// past `limit`.
    pub(super) fn advance(&mut self, limit: Duration) {
        self.settle();
        let next = self.comes.peek().map(|Reverse((at, ..))| *at);
        let next = next.into_iter().chain(self.alarm).min().unwrap_or(limit).min(limit);
        assert!(next >= self.now, "time goes on");
        self.now = next;
        while let Some(Reverse((at, index, first))) = self.comes.peek().copied()
            && at <= self.now
        {
            self.comes.pop();
            self.deliver(index, first);
        }
        self.wakes.clear();
    }

    fn settle(&mut self) {
        loop {
            match self.wire.step(self.now, &mut self.out, &mut self.wakes) {
                Step::Connect => self.wire.connected(self.now),
                Step::Disconnect => {
                    self.comes.clear();
                    self.flights.clear();
                }
                Step::Send(until) => {
                    self.alarm = until;
                    self.transmit();
                    return;
                }
                Step::Wait(until) => {
                    assert!(until.is_none_or(|until| until > self.now), "a wait that is over");
                    self.alarm = until;
                    return;
                }
                Step::End => panic!("ended by itself"),
            }
        }
    }

    fn deliver(&mut self, index: usize, first: bool) {
        let Some(flight) = &mut self.flights[index] else { return };
        if flight.destroyed {
            flight.bytes.iter_mut().for_each(|byte| *byte ^= 0x15);
        }
        let split = flight.bytes.len().min(1);
        if first {
            let byte = flight.bytes[..split].to_vec();
            return self.wire.received(self.now, &byte, &mut self.wakes);
        }
        let flight = self.flights[index].take().unwrap();
        let from = if matches!(self.medium, Medium::Line { .. }) { split } else { 0 };
        self.wire.received(self.now, &flight.bytes[from..], &mut self.wakes);
    }

    /// The frame in `out` leaves, and the device does what it does.
    fn transmit(&mut self) {
        let is_rtu = self.wire.line.is_rtu();
        let len = self.out.len();
        let (unit, at) = if is_rtu { (self.out[0], 1) } else { (self.out[6], 7) };
        let arrives = match self.medium {
            Medium::Line { character } => {
                let end = self.now + character * u32::try_from(len).unwrap();
                self.own = end;
                if self.collides(self.now, end) {
                    return;
                }
                end
            }
            Medium::Network { .. } => self.trip(0, self.now, len),
        };
        let word = |index: usize| u16::from_be_bytes([self.out[index], self.out[index + 1]]);
        let (address, count) = (word(at + 1), word(at + 3));
        let values: Vec<u16>;
        let response = match self.out[at] {
            0x03 => {
                values = (address..address + count).map(|address| register(unit, address)).collect();
                Response::ReadHoldingRegisters(Registers::from(&values[..]))
            }
            _ => {
                self.written.push(count);
                Response::WriteSingleRegister { address, value: count }
            }
        };
        let mut bytes = Vec::new();
        match is_rtu {
            true => rtu::encode_response(unit, &response, &mut bytes).unwrap(),
            false => mbap::encode_response(word(0), unit, &response, &mut bytes).unwrap(),
        }
        let fate = (self.device)(&mut self.chance, unit);
        let Some(delay) = fate.answers else { return };
        let ends = self.send_back(arrives + delay, bytes.clone());
        if let Some(again) = fate.repeats {
            self.send_back(ends + again, bytes);
        }
    }

    /// A device sends; says when the frame has come.
    fn send_back(&mut self, begins: Duration, bytes: Vec<u8>) -> Duration {
        let (ends, destroyed) = match self.medium {
            Medium::Line { character } => {
                let ends = begins + character * u32::try_from(bytes.len()).unwrap();
                (ends, begins < self.own && begins != self.own || self.collides(begins, ends))
            }
            Medium::Network { .. } => (self.trip(1, begins, bytes.len()), false),
        };
        let flight = Some(Flight { begins, ends, bytes, destroyed });
        let index = self.flights.iter().position(Option::is_none).unwrap_or(self.flights.len());
        match self.flights.get_mut(index) {
            Some(free) => *free = flight,
            None => self.flights.push(flight),
        }
        if let Medium::Line { character } = self.medium {
            self.comes.push(Reverse((begins + character, index, true)));
        }
        self.comes.push(Reverse((ends, index, false)));
        ends
    }

    /// Whether something else is on the line in this time; it is destroyed then.
    fn collides(&mut self, begins: Duration, ends: Duration) -> bool {
        let mut others =
            self.flights.iter_mut().flatten().filter(|other| other.begins < ends && begins < other.ends);
        others.by_ref().map(|other| other.destroyed = true).count() > 0
    }

    /// When a packet that leaves at `now` has come.
    fn trip(&mut self, way: usize, now: Duration, len: usize) -> Duration {
        let Medium::Network { trip, byte, lost_per_mille, again } = self.medium else { return now };
        // What TCP and IP put in front of it counts too.
        let mut at = now + trip + byte * u32::try_from(len + 40).unwrap();
        let mut wait = again;
        while self.chance.happens(lost_per_mille) {
            at += wait;
            wait *= 2;
        }
        if lost_per_mille > 0 {
            at = at.max(self.last_packet[way]);
            self.last_packet[way] = at;
        }
        at
    }
}

/// What stands in a register: which it is.
pub(super) fn register(unit: u8, address: u16) -> u16 {
    u16::from(unit) << 8 | address & 0xFF
}

/// A poll of registers side by side.
pub(super) fn poll(unit: u8, address: u16, count: u16, timeout: Duration) -> Job {
    Job {
        unit,
        ask: Ask::Holding { address, count },
        priority: Priority::Poll,
        timeout,
        spacing: Duration::ZERO,
        short: false,
        registers: Vec::new(),
    }
}

/// A command.
pub(super) fn command(unit: u8, address: u16, value: u16, timeout: Duration) -> Job {
    let ask = Ask::Write(Write::Register { address, value });
    Job { ask, priority: Priority::Command, ..poll(unit, 0, 0, timeout) }
}
