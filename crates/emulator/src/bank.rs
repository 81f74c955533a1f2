//! The registers of one device, always ready to be read: the panel fills them on its tick, through the profile.

use busbar_profile::{BitSet, Number, Point, Profile, Value};

use crate::rules::Map;

/// Finer than any meter: the profile rounds to what the register holds.
const DECIMALS: u8 = 6;

/// Register image over the readable map; addresses between the ranges stay unreadable.
#[derive(Clone, Debug)]
pub(crate) struct Bank {
    profile: &'static Profile,
    first: u16,
    registers: Vec<u16>,
    /// Readable registers from here on without a hole; 0 where this one is not readable.
    readable_from: Vec<u16>,
    writable: Vec<u16>,
    /// Index of the point that starts here.
    point_at: Vec<Option<usize>>,
    pinned: Vec<bool>,
    /// Values the profile could not hold; a panel of ours has none.
    refused: u64,
}

impl Bank {
    pub(crate) fn new(profile: &'static Profile) -> Self {
        let readable = &profile.wire.readable;
        let first = readable.first().map_or(0, |range| range.0);
        let length = readable.last().map_or(0, |range| usize::from(range.1 - first) + 1);

        let mut readable_from = vec![0; length];
        for &(start, end) in readable {
            for address in start..=end {
                readable_from[usize::from(address - first)] = end - address + 1;
            }
        }
        let mut point_at = vec![None; length];
        for (index, point) in profile.points.iter().enumerate() {
            let slot =
                point.address.checked_sub(first).and_then(|offset| point_at.get_mut(usize::from(offset)));
            if let Some(slot) = slot.filter(|_| point.access.is_readable()) {
                *slot = Some(index);
            }
        }
        let writable = profile
            .points
            .iter()
            .filter(|point| point.access.is_writable())
            .flat_map(|point| (0..point.registers).map(|offset| point.address + offset))
            .collect();
        Self {
            profile,
            first,
            registers: vec![0; length],
            readable_from,
            writable,
            point_at,
            pinned: vec![false; profile.points.len()],
            refused: 0,
        }
    }

    pub(crate) fn profile(&self) -> &'static Profile {
        self.profile
    }

    /// How many values could not be stored; for tests.
    pub(crate) fn refused(&self) -> u64 {
        self.refused
    }

    /// What stood in the registers before anything was stored, to see what is.
    #[cfg(test)]
    pub(crate) fn fill(&mut self, word: u16) {
        self.registers.fill(word);
    }

    /// The registers asked for, when all of them are readable.
    pub(crate) fn read(&self, address: u16, count: u16) -> Option<&[u16]> {
        if !self.is_readable(address, count) {
            return None;
        }
        let from = usize::from(address - self.first);
        self.registers.get(from..from + usize::from(count))
    }

    /// Keeps these registers as they are, whatever the panel stores there later.
    pub(crate) fn pin(&mut self, index: usize, registers: &[u16]) {
        let Some(point) = self.profile.points.get(index) else { return };
        if let Some(slots) = self.slots(point).filter(|slots| slots.len() == registers.len()) {
            slots.copy_from_slice(registers);
            self.pinned[index] = true;
        }
    }

    /// Stores a number at the precision of its point.
    pub(crate) fn number(&mut self, address: u16, value: f64) {
        match Number::from_f64(value, DECIMALS) {
            Some(number) => self.store(address, &Value::Number(number)),
            None => self.refuse(),
        }
    }

    /// Stores numbers at addresses `stride` apart.
    pub(crate) fn numbers(&mut self, address: u16, stride: u16, values: impl IntoIterator<Item = f64>) {
        for (position, value) in (0..).zip(values) {
            self.number(address + stride * position, value);
        }
    }

    /// Stores a whole number.
    pub(crate) fn integer(&mut self, address: u16, value: i64) {
        self.store(address, &Value::Number(Number::integer(value)));
    }

    pub(crate) fn code(&mut self, address: u16, code: u16) {
        self.store(address, &Value::Choice { code: code.into() });
    }

    pub(crate) fn bits(&mut self, address: u16, bits: BitSet) {
        self.store(address, &Value::Bits(bits));
    }

    pub(crate) fn codes(&mut self, address: u16, codes: &[u8]) {
        self.store(address, &Value::Codes(codes.to_vec()));
    }

    pub(crate) fn trace(&mut self, address: u16, samples: &[i16]) {
        self.store(address, &Value::Trace(samples.to_vec()));
    }

    pub(crate) fn bytes(&mut self, address: u16, bytes: Vec<u8>) {
        self.store(address, &Value::Bytes(bytes));
    }

    /// Stores a value by the id of its point, for registers that hold several.
    pub(crate) fn put(&mut self, id: &str, value: &Value) {
        let profile = self.profile;
        match profile.points.iter().enumerate().find(|(_, point)| point.id == id) {
            Some((index, point)) => self.keep(index, point, value),
            None => self.refuse(),
        }
    }

    /// Stores what the device sends where it has no sensor: the point's sentinel, else 0.
    pub(crate) fn absent(&mut self, address: u16) {
        let Some((index, point)) = self.indexed(address) else { return self.refuse() };
        if self.pinned[index] {
            return;
        }
        let order = self.profile.wire.word_order;
        if let Some(slots) = self.slots(point) {
            slots.fill(0);
            // A point without a sentinel reads 0 where nothing is connected.
            let _ = point.encode_invalid(order, slots);
        }
    }

    /// The bits that stand at an address now, pinned or not.
    pub(crate) fn bits_shown(&self, address: u16) -> BitSet {
        let registers = self.point(address).and_then(|point| self.read(address, point.registers));
        BitSet::from_registers(registers.unwrap_or_default())
    }

    /// The number that stands at an address now, pinned or not.
    pub(crate) fn number_shown(&self, address: u16) -> Option<f64> {
        let point = self.point(address)?;
        let registers = self.read(address, point.registers)?;
        Some(point.decode(registers, self.profile.wire.word_order).value?.as_number()?.as_f64())
    }

    fn store(&mut self, address: u16, value: &Value) {
        match self.indexed(address) {
            Some((index, point)) => self.keep(index, point, value),
            None => self.refuse(),
        }
    }

    fn keep(&mut self, index: usize, point: &Point, value: &Value) {
        if self.pinned[index] {
            return;
        }
        let order = self.profile.wire.word_order;
        let stored = self.slots(point).is_some_and(|slots| point.encode(value, order, slots).is_ok());
        if !stored {
            self.refuse();
        }
    }

    fn slots(&mut self, point: &Point) -> Option<&mut [u16]> {
        let from = usize::from(point.address.checked_sub(self.first)?);
        self.registers.get_mut(from..from + usize::from(point.registers))
    }

    fn refuse(&mut self) {
        self.refused += 1;
    }

    fn point(&self, address: u16) -> Option<&'static Point> {
        self.indexed(address).map(|(_, point)| point)
    }

    fn indexed(&self, address: u16) -> Option<(usize, &'static Point)> {
        let index = *self.point_at.get(usize::from(address.checked_sub(self.first)?))?;
        index.and_then(|index| Some((index, self.profile.points.get(index)?)))
    }
}

impl Map for Bank {
    fn is_readable(&self, address: u16, count: u16) -> bool {
        address
            .checked_sub(self.first)
            .and_then(|offset| self.readable_from.get(usize::from(offset)))
            .is_some_and(|without_hole| count <= *without_hole && *without_hole > 0)
    }

    fn is_writable(&self, address: u16) -> bool {
        self.writable.contains(&address)
    }

    fn is_coil(&self, address: u16) -> bool {
        self.profile.coils.iter().any(|coil| coil.address == address)
    }
}
