//! Read plans: the reads that cover what is wanted at the least cost, never leaving the readable map.
//!
//! A read costs a fixed part (header, silences, the device's answer delay) and a part for each register, so a
//! hole of documented registers is bridged when that is cheaper than another read. The plan is computed by
//! dynamic programming over the wanted items in address order, in O(items x registers a read).

use std::{collections::BTreeSet, time::Duration};

use crate::{Access, Profile};

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

    /// What reading `count` registers costs.
    pub fn of(self, count: u16) -> u64 {
        self.read.saturating_add(self.register.saturating_mul(u64::from(count)))
    }
}

/// Plans reads of one controller, and remembers where a device refused to be read across.
#[derive(Clone, Debug)]
pub struct Planner {
    cost: Cost,
    function: u8,
    limit: u16,
    map: Vec<(u16, u16)>,
    /// No read may hold both the register before such an address and the register at it.
    splits: BTreeSet<u16>,
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
        Self { cost, function: 3, limit: limit.max(1), map: map.to_vec(), splits: BTreeSet::new() }
    }

    /// Forbids reads across `address`: no later plan holds it together with the register before it.
    pub fn split_at(&mut self, address: u16) {
        self.splits.insert(address);
    }

    /// The cheapest reads that cover every item, in address order. An item is an address and a number of registers,
    /// and comes in one read unless it is longer than a read may be; then it comes in parts. Items outside the map
    /// are left out.
    pub fn reads(&self, items: impl IntoIterator<Item = (u16, u16)>) -> Vec<Read> {
        let items = self.pieces(items);
        // best[i]: the least cost of the first i items, the number of reads, and the item its last read starts with.
        let mut best = vec![(0_u64, 0_u32, 0_usize)];
        for last in 0..items.len() {
            let mut least = (u64::MAX, u32::MAX, last);
            let mut end = 0;
            for first in (0..=last).rev() {
                end = end.max(items[first].end());
                let count = end - u32::from(items[first].address);
                if items[first].range != items[last].range || !self.allowed(items[first].address, count) {
                    break;
                }
                let (cost, reads, _) = best[first];
                let whole = (cost.saturating_add(self.cost.of(count as u16)), reads + 1, first);
                if (whole.0, whole.1) < (least.0, least.1) {
                    least = whole;
                }
            }
            best.push(least);
        }
        self.unwind(&items, &best)
    }

    /// Cuts items that are longer than a read, drops those outside the map, sorts the rest.
    fn pieces(&self, items: impl IntoIterator<Item = (u16, u16)>) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for (address, registers) in items {
            let Some(range) = self.range(address, registers) else { continue };
            if self.allowed(address, u32::from(registers)) {
                pieces.push(Piece { address, registers, range });
            } else {
                pieces.extend((address..=address + (registers - 1)).map(|address| Piece {
                    address,
                    registers: 1,
                    range,
                }));
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

    fn allowed(&self, address: u16, count: u32) -> bool {
        count <= u32::from(self.limit)
            && self
                .splits
                .range(address.saturating_add(1)..)
                .next()
                .is_none_or(|split| u32::from(*split) >= u32::from(address) + count)
    }

    fn unwind(&self, items: &[Piece], best: &[(u64, u32, usize)]) -> Vec<Read> {
        let mut reads = Vec::new();
        let mut behind = items.len();
        while behind > 0 {
            let first = best[behind].2;
            let address = items[first].address;
            let end = items[first..behind].iter().map(|item| item.end()).max().unwrap_or_default();
            reads.push(Read { function: self.function, address, count: (end - u32::from(address)) as u16 });
            behind = first;
        }
        reads.reverse();
        reads
    }
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
        .filter(|point| point.access != Access::Write)
        .map(|point| (point.address, point.registers))
}

/// An item that one read must hold whole.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Piece {
    address: u16,
    registers: u16,
    range: usize,
}

impl Piece {
    fn end(self) -> u32 {
        u32::from(self.address) + u32::from(self.registers)
    }
}
