//! The registers of one device, always ready to be read: the panel fills them on its tick, through the profile.

use busbar_profile::{BitSet, DataType, Number, Point, Profile, Value};

use crate::random::Random;
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
    /// Places of registers with a high byte that means nothing.
    hollow: Vec<usize>,
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
            hollow: hollow(profile, first, length),
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

    /// Puts one word into every register, so that a test sees which ones a panel never stores.
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

    /// Lets a point follow the panel again; false where it was not pinned.
    pub(crate) fn unpin(&mut self, index: usize) -> bool {
        self.pinned.get_mut(index).is_some_and(std::mem::take)
    }

    /// The points that are pinned, by index in the profile.
    pub(crate) fn pinned(&self) -> impl Iterator<Item = usize> {
        (0..).zip(&self.pinned).filter(|(_, pinned)| **pinned).map(|(index, _)| index)
    }

    /// Fills the bytes that mean nothing anew: whoever takes them for a part of the value shall notice.
    pub(crate) fn stir(&mut self, random: &mut Random) {
        for place in &self.hollow {
            if let Some(register) = self.registers.get_mut(*place) {
                *register = *register & 0x00FF | random.bits() as u16 & 0xFF00;
            }
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

    /// Stores what the device sends where a sensor is broken: the last of the point's sentinels.
    pub(crate) fn broken(&mut self, address: u16) {
        let Some((index, point)) = self.indexed(address) else { return self.refuse() };
        if self.pinned[index] {
            return;
        }
        let sentinel = point.sentinels.last().and_then(|sentinel| u16::try_from(*sentinel).ok());
        let stored = match (sentinel, self.slots(point)) {
            (Some(sentinel), Some([register])) => {
                *register = sentinel;
                true
            }
            _ => false,
        };
        if !stored {
            self.refuse();
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

    /// Sets every bit of a point, so that a test sees whether a panel stores it.
    #[cfg(test)]
    pub(crate) fn spoil(&mut self, point: &Point) {
        if let Some(slots) = self.slots(point) {
            slots.fill(0xFFFF);
        }
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

/// Places of the registers whose low byte holds points and whose high byte holds none: the manual calls them 8 bits
/// wide, and what stands in the rest is nobody's business (DKG manual, rule for 8-bit data).
fn hollow(profile: &Profile, first: u16, length: usize) -> Vec<usize> {
    let mut taken = vec![0; length];
    for point in profile.points.iter().filter(|point| point.access.is_readable()) {
        let Some(from) = point.address.checked_sub(first).map(usize::from) else { continue };
        for (offset, bits) in taken.iter_mut().skip(from).take(usize::from(point.registers)).enumerate() {
            *bits |= bits_taken(point, offset);
        }
    }
    (0..length).filter(|place| taken[*place] != 0 && taken[*place] & 0xFF00 == 0).collect()
}

/// The bits of one of its registers that belong to a point.
fn bits_taken(point: &Point, register: usize) -> u16 {
    match (point.field, point.data_type) {
        (Some((high, low)), _) => lowest(usize::from(high) + 1) & !lowest(usize::from(low)),
        (None, DataType::U8 | DataType::I8 | DataType::Fraction8) => 0x00FF,
        (None, _) => lowest(point.size.map_or(16, |size| usize::from(size).saturating_sub(16 * register))),
    }
}

fn lowest(bits: usize) -> u16 {
    match bits {
        16.. => 0xFFFF,
        _ => (1 << bits) - 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bank(key: &str) -> Bank {
        Bank::new(busbar_profile::builtin(key).unwrap())
    }

    fn hollow_registers(key: &str) -> Vec<u16> {
        let bank = bank(key);
        bank.hollow.iter().map(|place| bank.first + *place as u16).collect()
    }

    #[test]
    fn the_registers_that_a_manual_calls_8_bits_wide_are_hollow() {
        let dkg = hollow_registers("datakom-dkg705");
        for (address, expected, what) in [
            (0x0014, true, "bits, size 8"),
            (0x0018, true, "a signed byte"),
            (0x0024, true, "a byte that can be written"),
            (0x0030, true, "a share in 8 bits"),
            (0x0039, true, "relays"),
            (0x003F, true, "a code in the low byte"),
            (0x0040, true, "the last key"),
            (0x0070, true, "an FMI"),
            (0x1026, true, "two points, both in the low byte"),
            (0x0000, false, "16 bits"),
            (0x0016, false, "32 bits, low word"),
            (0x0032, false, "alarm bits"),
            (0x003A, false, "16 relays"),
            (0x0041, false, "a share in 16 bits"),
            (0x102C, false, "declared as 16 bits, half of them named"),
            (0x102D, false, "another point in the high byte"),
        ] {
            assert_eq!(dkg.contains(&address), expected, "{address:04X}: {what}");
        }
        // The manual prints 60 rows of 8 bits, and two signed bytes in rows of 16.
        assert_eq!(dkg.len(), 62);
        for key in ["datakom-d", "smartgen-hat821si", "smartgen-acc1700"] {
            assert!(hollow_registers(key).is_empty(), "{key}");
        }
    }

    #[test]
    fn hollow_bytes_change_and_no_value_does() {
        let mut bank = bank("datakom-dkg705");
        let points = &bank.profile.points;
        let values = |bank: &Bank| -> Vec<_> {
            points
                .iter()
                .map(|point| {
                    point.decode(
                        bank.read(point.address, point.registers).unwrap(),
                        bank.profile.wire.word_order,
                    )
                })
                .collect()
        };
        bank.integer(0x0024, 26);
        bank.number(0x0018, -0.5);
        let before = values(&bank);
        let mut seen = std::collections::BTreeSet::new();
        for seed in 0..50 {
            bank.stir(&mut Random::new(seed));
            assert_eq!(values(&bank), before);
            seen.insert(bank.read(0x0024, 1).unwrap()[0]);
            bank.integer(0x0024, 26);
        }
        assert!(seen.len() > 30, "{seen:02X?}");
        assert_eq!(bank.refused(), 0);
        let once = bank.clone();
        bank.stir(&mut Random::new(49));
        assert_eq!(bank.registers, once.registers, "the same seed, the same noise");
    }
}
