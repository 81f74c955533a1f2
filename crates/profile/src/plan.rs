//! Read plans: the reads that cover what is wanted at the least cost, never leaving the readable map.
//!
//! A read costs a fixed part (header, silences, the device's answer delay) and a part for each register, so a
//! hole of documented registers is bridged when that is cheaper than another read. The plan is computed by
//! dynamic programming over the wanted items in address order, in O(items x registers a read).

use std::time::Duration;

use crate::{Profile, Rate};

/// One read request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Read {
    /// Function code, 3 or 4.
    pub function: u8,
    /// First register, as on the wire.
    pub address: u16,
    /// Number of registers, 1 to the controller's limit.
    pub count: u16,
}

impl Read {
    /// The address behind the last register of the read.
    fn end(self) -> u32 {
        u32::from(self.address) + u32::from(self.count)
    }

    /// Characters of the request (8) and of its full answer (5 and the registers) on a serial line.
    pub fn characters(self) -> u64 {
        Cost::RTU_READ_CHARACTERS + 2 * u64::from(self.count)
    }

    /// Bytes of the request (12) and of its full answer (9 and the registers) over Modbus TCP.
    pub fn tcp_bytes(self) -> u64 {
        21 + 2 * u64::from(self.count)
    }

    /// Whether all of `registers` registers from `address` on are part of this read.
    pub fn covers(self, address: u16, registers: u16) -> bool {
        address >= self.address && u32::from(address) + u32::from(registers) <= self.end()
    }
}

/// What a read costs, in nanoseconds: `read + register x count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// The part that every read pays, however short.
    pub read: u64,
    /// The part that each register adds.
    pub register: u64,
}

impl Cost {
    /// Characters of a read request (8) and of its answer without registers (5) on a serial line.
    pub const RTU_READ_CHARACTERS: u64 = 13;

    /// The cost on a serial line: `baud` in bits a second, `bits` a character with start, parity and stop bits
    /// (10 for 8N1), `answer_delay` as the controller's manual gives it.
    ///
    /// A read takes its characters, the larger of 3.5 characters and the answer delay before the answer, and 3.5
    /// characters after it (1.75 ms in place of 3.5 characters above 19200 baud).
    pub fn rtu(baud: u32, bits: u32, answer_delay: Duration) -> Self {
        let character = u64::from(bits) * 1_000_000_000 / u64::from(baud.max(1));
        let silence = if baud > 19_200 { 1_750_000 } else { character * 7 / 2 };
        let delay = u64::try_from(answer_delay.as_nanos()).unwrap_or(u64::MAX);
        Self {
            read: (Self::RTU_READ_CHARACTERS * character + silence).saturating_add(silence.max(delay)),
            register: 2 * character,
        }
    }

    /// The cost over TCP, where a round trip outweighs the bytes: `round_trip` a read, and 2 bytes a register at
    /// `bytes_per_second`.
    pub fn tcp(round_trip: Duration, bytes_per_second: u32) -> Self {
        Self {
            read: u64::try_from(round_trip.as_nanos()).unwrap_or(u64::MAX / 2),
            register: 2_000_000_000 / u64::from(bytes_per_second.max(1)),
        }
    }

    /// The same, with the pause that a device wants after each of its reads: for a wire that has nobody else to serve
    /// meanwhile, where few reads are worth more than few characters.
    pub fn spaced(self, spacing: Duration) -> Self {
        let spacing = u64::try_from(spacing.as_nanos()).unwrap_or(u64::MAX);
        Self { read: self.read.saturating_add(spacing), ..self }
    }

    /// What reading `count` registers costs.
    pub fn of(self, count: u16) -> u64 {
        self.read.saturating_add(self.register.saturating_mul(u64::from(count)))
    }

    /// What these reads cost together.
    pub fn total(self, reads: &[Read]) -> u64 {
        reads.iter().fold(0, |total, read| total.saturating_add(self.of(read.count)))
    }
}

/// Plans reads of one controller, and remembers where a device refused to be read across.
#[derive(Clone, Debug)]
pub struct Planner {
    cost: Cost,
    function: u8,
    limit: u16,
    map: Vec<(u16, u16)>,
    /// Ascending. No read of several items holds both the register before such an address and the register at it.
    splits: Vec<u16>,
}

impl Planner {
    /// A planner for the controller of `profile` on a wire that costs `cost`.
    pub fn new(profile: &Profile, cost: Cost) -> Self {
        Self {
            function: profile.wire.read_function(),
            ..Self::over(&profile.wire.readable, profile.wire.max_read, cost)
        }
    }

    /// A planner over any map of inclusive, ascending address ranges, with at most `limit` registers a read; reads
    /// use function 3.
    pub fn over(map: &[(u16, u16)], limit: u16, cost: Cost) -> Self {
        Self { cost, function: 3, limit: limit.max(1), map: map.to_vec(), splits: Vec::new() }
    }

    /// Forbids reads across `address`: no later plan holds it together with the register before it, unless one item
    /// does, which then is read alone.
    pub fn split_at(&mut self, address: u16) {
        if let Err(place) = self.splits.binary_search(&address) {
            self.splits.insert(place, address);
        }
    }

    /// The cheapest reads that cover every item, in address order. An item is an address and a number of registers,
    /// and comes in one read unless it is longer than a read may be; then it comes in parts. Items outside the map
    /// are left out.
    pub fn reads(&self, items: impl IntoIterator<Item = (u16, u16)>) -> Vec<Read> {
        let pieces = self.pieces(items);
        let best = self.best(&pieces);
        let mut reads = Vec::new();
        let mut behind = pieces.len();
        while behind > 0 {
            let Best { first, count, .. } = best[behind];
            reads.push(Read { function: self.function, address: pieces[first].address, count });
            behind = first;
        }
        reads.reverse();
        reads
    }

    /// The least that any reads which cover every item could cost.
    pub fn least(&self, items: impl IntoIterator<Item = (u16, u16)>) -> u64 {
        self.best(&self.pieces(items)).last().map_or(0, |best| best.cost)
    }

    /// One plan for all points of `profile` that are due at the same moment, whatever their rates: never dearer than
    /// a plan for each rate.
    pub fn due(&self, profile: &Profile, rates: &[Rate]) -> Due {
        let is_due = |index: &usize| rates.contains(&profile.points[*index].rate);
        let points: Vec<usize> = (0..profile.points.len()).filter(is_due).collect();
        let reads = self.reads(items(profile, &points));
        let brought = |index: &usize| {
            let point = &profile.points[*index];
            point.access.is_readable() && reads.iter().any(|read| read.covers(point.address, point.registers))
        };
        let besides = (0..profile.points.len()).filter(|index| !is_due(index)).filter(brought).collect();
        Due { reads, besides }
    }

    /// For each number of pieces, from none to all: the cheapest way to read the first so many.
    fn best(&self, pieces: &[Piece]) -> Vec<Best> {
        let mut best = Vec::with_capacity(pieces.len() + 1);
        best.push(Best { cost: 0, registers: 0, first: 0, count: 0 });
        for (last, piece) in pieces.iter().enumerate() {
            let mut least: Option<Best> = None;
            let mut end = 0;
            for (first, from) in pieces[..=last].iter().enumerate().rev() {
                end = end.max(from.end());
                let count = end - u32::from(from.address);
                if from.zones != piece.zones || count > u32::from(self.limit) {
                    break;
                }
                let count = count as u16;
                let cost = best[first].cost.saturating_add(self.cost.of(count));
                let registers = best[first].registers + u32::from(count);
                let way = Best { cost, registers, first, count };
                if least.is_none_or(|least| (way.cost, way.registers) < (least.cost, least.registers)) {
                    least = Some(way);
                }
            }
            // A piece alone is always allowed, so that there is a way.
            best.extend(least);
        }
        best
    }

    /// Cuts items that are longer than a read, drops those outside the map, sorts the rest.
    fn pieces(&self, items: impl IntoIterator<Item = (u16, u16)>) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for (address, registers) in items {
            let Some(range) = self.range(address, registers) else { continue };
            let last = address + (registers - 1);
            // Ranges and splits both ascend, so that their sum tells any two zones apart.
            let zone = |address: u16| range + self.splits.partition_point(|split| *split <= address);
            if registers <= self.limit {
                pieces.push(Piece { address, registers, zones: (zone(address), zone(last)) });
            } else {
                let part = |address| Piece { address, registers: 1, zones: (zone(address), zone(address)) };
                pieces.extend((address..=last).map(part));
            }
        }
        pieces.sort_unstable_by_key(|piece| (piece.address, piece.registers));
        pieces.dedup();
        pieces
    }

    /// The index of the readable range that holds all of an item.
    fn range(&self, address: u16, registers: u16) -> Option<usize> {
        let last = address.checked_add(registers.checked_sub(1)?)?;
        let range = self.map.partition_point(|(_, end)| *end < address);
        self.map.get(range).is_some_and(|(start, end)| *start <= address && last <= *end).then_some(range)
    }
}

/// The reads for what is due at one moment.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Due {
    /// The reads, in address order.
    pub reads: Vec<Read>,
    /// Indexes of the points that are not due and that one of the reads brings whole.
    pub besides: Vec<usize>,
}

/// The cheapest reads for the points with these indexes, at the cost of the controller's usual serial line
/// (9600 8N1). Write-only points are left out.
pub fn plan(profile: &Profile, points: &[usize]) -> Vec<Read> {
    let cost = Cost::rtu(9600, 10, profile.wire.answer_delay());
    Planner::new(profile, cost).reads(items(profile, points))
}

/// Address and length of the readable points among `points` (indexes into `Profile::points`).
pub fn items<'a>(profile: &'a Profile, points: &'a [usize]) -> impl Iterator<Item = (u16, u16)> + 'a {
    points
        .iter()
        .filter_map(|index| profile.points.get(*index))
        .filter(|point| point.access.is_readable())
        .map(|point| (point.address, point.registers))
}

/// An item that one read must hold whole.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Piece {
    address: u16,
    registers: u16,
    /// The stretches of the map, between gaps and splits, of its first and its last register.
    zones: (usize, usize),
}

impl Piece {
    fn end(self) -> u32 {
        u32::from(self.address) + u32::from(self.registers)
    }
}

/// The cheapest way to read a number of pieces.
#[derive(Clone, Copy)]
struct Best {
    cost: u64,
    /// Of equally cheap plans the one with the fewest characters is taken.
    registers: u32,
    /// The piece that its last read starts with.
    first: usize,
    /// Registers of its last read.
    count: u16,
}
