//! What a point's registers say, before labels and units are put to it.

use crate::number::Number;
use crate::terms::Quality;

/// A set of at most 256 bits, numbered as the manual numbers them: bit 0 of the first register is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BitSet {
    words: [u64; 4],
}

impl BitSet {
    /// How many bits fit.
    pub const CAPACITY: u16 = 256;

    /// No bit.
    pub const EMPTY: Self = Self { words: [0; 4] };

    /// The lowest bits of the registers, the first register lowest; registers past the capacity are ignored.
    #[inline]
    pub fn from_registers(registers: &[u16]) -> Self {
        let mut words = [0; 4];
        for (word, four) in words.iter_mut().zip(registers.chunks(4)) {
            for (i, register) in four.iter().enumerate() {
                *word |= u64::from(*register) << (16 * i);
            }
        }
        Self { words }
    }

    /// The 16 bits of the register `index`, 0 past the capacity.
    #[inline]
    pub fn register(&self, index: usize) -> u16 {
        let word = self.words.get(index / 4).copied().unwrap_or(0);
        (word >> (16 * (index % 4))) as u16
    }

    /// Whether a bit is in the set; bits past the capacity never are.
    pub fn contains(&self, bit: u16) -> bool {
        self.words.get(usize::from(bit / 64)).is_some_and(|word| word >> (bit % 64) & 1 == 1)
    }

    /// Adds a bit; a bit past the capacity is ignored.
    pub fn insert(&mut self, bit: u16) {
        if let Some(word) = self.words.get_mut(usize::from(bit / 64)) {
            *word |= 1 << (bit % 64);
        }
    }

    /// Takes a bit out.
    pub fn remove(&mut self, bit: u16) {
        if let Some(word) = self.words.get_mut(usize::from(bit / 64)) {
            *word &= !(1 << (bit % 64));
        }
    }

    /// Puts a bit in or out.
    pub fn set(&mut self, bit: u16, value: bool) {
        if value {
            self.insert(bit);
        } else {
            self.remove(bit);
        }
    }

    /// Whether no bit is in it.
    pub fn is_empty(&self) -> bool {
        self.words == [0; 4]
    }

    /// How many bits are in it.
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The bits in it, lowest first.
    pub fn iter(&self) -> impl Iterator<Item = u16> + use<> {
        let words = self.words;
        (0..4_u16).flat_map(move |index| {
            let mut rest = words[usize::from(index)];
            std::iter::from_fn(move || {
                if rest == 0 {
                    return None;
                }
                let bit = rest.trailing_zeros() as u16;
                rest &= rest - 1;
                Some(index * 64 + bit)
            })
        })
    }

    /// What is in both.
    #[inline]
    pub fn intersection(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a & b)
    }

    /// What is in either.
    pub fn union(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a | b)
    }

    /// What is in this one alone.
    pub fn difference(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a & !b)
    }

    #[inline]
    fn zip(&self, other: &Self, with: impl Fn(u64, u64) -> u64) -> Self {
        let mut words = self.words;
        for (word, other) in words.iter_mut().zip(other.words) {
            *word = with(*word, other);
        }
        Self { words }
    }
}

impl FromIterator<u16> for BitSet {
    fn from_iter<I: IntoIterator<Item = u16>>(bits: I) -> Self {
        let mut set = Self::EMPTY;
        for bit in bits {
            set.insert(bit);
        }
        set
    }
}

/// A decoded value.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Value {
    /// A number in the point's unit, exact.
    Number(Number),
    /// A code that the point's choices name, or not.
    Choice {
        /// The code itself.
        code: u32,
    },
    /// Single bits; reserved ones are never in it.
    Bits(BitSet),
    /// Two-bit codes, field 0 first.
    Codes(Vec<u8>),
    /// Samples of a waveform, before scale.
    Trace(Vec<i16>),
    /// Opaque bytes and pictures, the high byte of each register first.
    Bytes(Vec<u8>),
}

impl Value {
    /// What it is, for messages.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Number(_) => "a number",
            Self::Choice { .. } => "a code",
            Self::Bits(_) => "a set of bits",
            Self::Codes(_) => "a list of two-bit codes",
            Self::Trace(_) => "a list of samples",
            Self::Bytes(_) => "bytes",
        }
    }

    /// The number, when it is one.
    pub const fn as_number(&self) -> Option<Number> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// The code, when it is a choice.
    pub const fn as_code(&self) -> Option<u32> {
        match self {
            Self::Choice { code } => Some(*code),
            _ => None,
        }
    }

    /// The bits, when it is a set of them.
    pub const fn as_bits(&self) -> Option<&BitSet> {
        match self {
            Self::Bits(bits) => Some(bits),
            _ => None,
        }
    }
}

/// A value and how far it can be trusted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decoded {
    /// The value; none unless `quality` is good or stale.
    pub value: Option<Value>,
    /// Decoding gives good, invalid (a sentinel) or bad (not the registers of this point).
    pub quality: Quality,
}

impl Decoded {
    /// The device says it has no value.
    pub const INVALID: Self = Self { value: None, quality: Quality::Invalid };

    /// There is nothing to decode.
    pub const BAD: Self = Self { value: None, quality: Quality::Bad };

    /// A value as the device gave it.
    #[inline]
    pub const fn good(value: Value) -> Self {
        Self { value: Some(value), quality: Quality::Good }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bit_zero_is_the_lowest_of_the_first_register() {
        let set = BitSet::from_registers(&[0x8001, 0x0002, 0, 0, 0x0100]);
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 15, 17, 72]);
        assert_eq!(set.register(1), 2);
        assert_eq!(set.register(4), 0x0100);
        assert_eq!(set.register(16), 0);
        assert_eq!(set.len(), 4);
    }

    #[test]
    fn bits_past_the_capacity_are_ignored() {
        let mut set = BitSet::from_registers(&[0xFFFF; 20]);
        assert_eq!(set.len(), 256);
        set.insert(256);
        assert!(!set.contains(256));
        set.set(255, false);
        assert!(set.contains(254) && !set.contains(255));
    }
}
