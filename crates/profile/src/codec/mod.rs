//! Registers to values and back, compiled from a point's type and scale when the profile is loaded.

mod number;

use crate::number::Number;
use crate::terms::WordOrder;
use crate::value::{BitSet, Decoded, Value};

pub(crate) use number::NumberCodec;

/// As many sentinels as any manual has; unused places never match.
pub(crate) const MAX_SENTINELS: usize = 2;
const NO_SENTINEL: u64 = u64::MAX;

/// A value that cannot be written into a point's registers. The caller is at fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// Not the number of registers that the point has.
    #[error("the point has {expected} registers, {found} were given")]
    Registers {
        /// Registers of the point.
        expected: usize,
        /// Registers given.
        found: usize,
    },
    /// A value of another kind.
    #[error("the point takes {expected}, not {found}")]
    Kind {
        /// What the point takes.
        expected: &'static str,
        /// What was given.
        found: &'static str,
    },
    /// A number out of range.
    #[error("{value} is outside {min} to {max}")]
    Range {
        /// The number.
        value: Number,
        /// Least number the registers hold.
        min: Number,
        /// Greatest number the registers hold.
        max: Number,
    },
    /// A code that is too large for its field.
    #[error("code {code} is above {max}")]
    Code {
        /// The code.
        code: u32,
        /// The largest that fits.
        max: u32,
    },
    /// A bit that the point does not have, or that is reserved.
    #[error("bit {bit} is reserved or outside the point")]
    Bit {
        /// The lowest such bit.
        bit: u16,
    },
    /// A list of the wrong length.
    #[error("the point has {expected} elements, {found} were given")]
    Length {
        /// Elements of the point.
        expected: usize,
        /// Elements given.
        found: usize,
    },
    /// The raw word means "no value".
    #[error("the raw word {raw} means that there is no value")]
    Sentinel {
        /// The raw word.
        raw: u32,
    },
    /// The device has no way to say that there is no value.
    #[error("the point has no word for \"no value\"")]
    NoSentinel,
}

/// How the registers of one point are read and written. One cache line, so that a decode loads no more than that.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) enum Codec {
    Number(NumberCodec),
    Choice(Field, Sentinels),
    Bits(BitsCodec),
    Codes { registers: usize },
    Trace { registers: usize },
    Bytes { registers: usize },
}

impl Codec {
    #[inline]
    pub(crate) fn decode(&self, registers: &[u16], order: WordOrder) -> Decoded {
        match self {
            Self::Number(codec) => codec.decode(registers, order),
            _ => self.decode_other(registers),
        }
    }

    /// Out of line, so that the path of a number stays short enough to be inlined.
    #[inline(never)]
    fn decode_other(&self, registers: &[u16]) -> Decoded {
        if registers.len() != self.registers() {
            return Decoded::BAD;
        }
        Decoded::good(match self {
            Self::Choice(field, sentinels) => {
                let code = registers.first().map_or(0, |word| field.take(*word));
                if sentinels.contain(code) {
                    return Decoded::INVALID;
                }
                Value::Choice { code }
            }
            Self::Bits(codec) => codec.decode(registers),
            Self::Codes { .. } => Value::Codes(
                registers
                    .iter()
                    .flat_map(|word| (0..8).map(move |field| (word >> (2 * field) & 3) as u8))
                    .collect(),
            ),
            Self::Trace { .. } => Value::Trace(registers.iter().map(|&word| word as i16).collect()),
            _ => Value::Bytes(registers.iter().flat_map(|word| word.to_be_bytes()).collect()),
        })
    }

    pub(crate) fn encode(
        &self,
        value: &Value,
        order: WordOrder,
        registers: &mut [u16],
    ) -> Result<(), EncodeError> {
        if registers.len() != self.registers() {
            return Err(EncodeError::Registers { expected: self.registers(), found: registers.len() });
        }
        match (self, value) {
            (Self::Number(codec), Value::Number(number)) => codec.encode(*number, order, registers),
            (Self::Choice(field, sentinels), Value::Choice { code }) => {
                if *code > field.max() {
                    return Err(EncodeError::Code { code: *code, max: field.max() });
                }
                sentinels.refuse(*code)?;
                field.put(*code, registers);
                Ok(())
            }
            (Self::Bits(codec), Value::Bits(bits)) => codec.encode(bits, registers),
            (Self::Codes { .. }, Value::Codes(codes)) => encode_codes(codes, registers),
            (Self::Trace { .. }, Value::Trace(samples)) => {
                same_length(registers.len(), samples.len())?;
                for (register, sample) in registers.iter_mut().zip(samples) {
                    *register = *sample as u16;
                }
                Ok(())
            }
            (Self::Bytes { .. }, Value::Bytes(bytes)) => {
                same_length(registers.len() * 2, bytes.len())?;
                for (register, pair) in registers.iter_mut().zip(bytes.chunks_exact(2)) {
                    *register = u16::from_be_bytes([pair[0], pair[1]]);
                }
                Ok(())
            }
            (_, other) => Err(EncodeError::Kind { expected: self.kind(), found: other.kind() }),
        }
    }

    pub(crate) fn encode_invalid(&self, order: WordOrder, registers: &mut [u16]) -> Result<(), EncodeError> {
        if registers.len() != self.registers() {
            return Err(EncodeError::Registers { expected: self.registers(), found: registers.len() });
        }
        match self {
            Self::Number(codec) => codec.encode_invalid(order, registers)?,
            Self::Choice(field, sentinels) => {
                let raw = sentinels.first().ok_or(EncodeError::NoSentinel)?;
                field.put(raw, registers);
            }
            _ => return Err(EncodeError::NoSentinel),
        }
        Ok(())
    }

    /// The number before scale, a code, or the lowest 32 bits of a set.
    pub(crate) fn raw_code(&self, registers: &[u16], order: WordOrder) -> Option<u32> {
        match self {
            Self::Number(codec) => codec.take(registers, order),
            Self::Choice(field, _) => match registers {
                &[word] => Some(field.take(word)),
                _ => None,
            },
            Self::Bits(codec) => {
                let bits = codec.visible.intersection(&BitSet::from_registers(registers));
                Some(u32::from(bits.register(1)) << 16 | u32::from(bits.register(0)))
            }
            _ => None,
        }
    }

    pub(crate) fn registers(&self) -> usize {
        match self {
            Self::Number(codec) => codec.registers(),
            Self::Choice(..) => 1,
            Self::Bits(codec) => codec.registers,
            Self::Codes { registers } | Self::Trace { registers } | Self::Bytes { registers } => *registers,
        }
    }

    const fn kind(&self) -> &'static str {
        match self {
            Self::Number(_) => "a number",
            Self::Choice(..) => "a code",
            Self::Bits(_) => "a set of bits",
            Self::Codes { .. } => "a list of two-bit codes",
            Self::Trace { .. } => "a list of samples",
            Self::Bytes { .. } => "bytes",
        }
    }
}

fn encode_codes(codes: &[u8], registers: &mut [u16]) -> Result<(), EncodeError> {
    same_length(registers.len() * 8, codes.len())?;
    if let Some(code) = codes.iter().find(|code| **code > 3) {
        return Err(EncodeError::Code { code: u32::from(*code), max: 3 });
    }
    for (register, fields) in registers.iter_mut().zip(codes.chunks_exact(8)) {
        *register = fields.iter().rev().fold(0, |word, code| word << 2 | u16::from(*code));
    }
    Ok(())
}

fn same_length(expected: usize, found: usize) -> Result<(), EncodeError> {
    if expected == found { Ok(()) } else { Err(EncodeError::Length { expected, found }) }
}

/// Some bits of one register, shifted down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    shift: u8,
    mask: u16,
}

impl Field {
    /// The whole register.
    pub(crate) const WHOLE: Self = Self { shift: 0, mask: 0xFFFF };

    /// The low byte.
    pub(crate) const LOW_BYTE: Self = Self { shift: 0, mask: 0x00FF };

    /// Bits `high` to `low`; none unless 15 >= high >= low.
    pub(crate) const fn new(high: u8, low: u8) -> Option<Self> {
        if high > 15 || low > high {
            return None;
        }
        let width = high - low + 1;
        Some(Self { shift: low, mask: (0xFFFF_u32 >> (16 - width)) as u16 })
    }

    /// The bits it takes in the register.
    pub(crate) const fn bits(self) -> u16 {
        self.mask << self.shift
    }

    pub(crate) const fn max(self) -> u32 {
        self.mask as u32
    }

    #[inline]
    const fn take(self, word: u16) -> u32 {
        (word >> self.shift & self.mask) as u32
    }

    fn put(self, raw: u32, registers: &mut [u16]) {
        if let [register] = registers {
            *register = *register & !self.bits() | (raw as u16 & self.mask) << self.shift;
        }
    }
}

/// Raw words that mean "no value".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sentinels([u64; MAX_SENTINELS]);

impl Sentinels {
    /// At most [`MAX_SENTINELS`] are taken.
    pub(crate) fn new(words: &[u64]) -> Self {
        let mut places = [NO_SENTINEL; MAX_SENTINELS];
        for (place, word) in places.iter_mut().zip(words) {
            *place = *word;
        }
        Self(places)
    }

    #[inline]
    fn contain(&self, raw: u32) -> bool {
        let raw = u64::from(raw);
        // Without a branch a place; the list is short.
        self.0.iter().fold(false, |hit, word| hit | (*word == raw))
    }

    fn refuse(&self, raw: u32) -> Result<(), EncodeError> {
        if self.contain(raw) {
            return Err(EncodeError::Sentinel { raw });
        }
        Ok(())
    }

    fn first(&self) -> Option<u32> {
        u32::try_from(self.0[0]).ok()
    }
}

/// A point that holds single bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BitsCodec {
    pub(crate) registers: usize,
    /// The bits that belong to the point and are not reserved.
    pub(crate) visible: BitSet,
}

impl BitsCodec {
    fn decode(&self, registers: &[u16]) -> Value {
        Value::Bits(BitSet::from_registers(registers).intersection(&self.visible))
    }

    fn encode(&self, bits: &BitSet, registers: &mut [u16]) -> Result<(), EncodeError> {
        if let Some(bit) = bits.difference(&self.visible).iter().next() {
            return Err(EncodeError::Bit { bit });
        }
        for (i, register) in registers.iter_mut().enumerate() {
            *register = *register & !self.visible.register(i) | bits.register(i);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use WordOrder::{HighFirst, LowFirst};

    #[test]
    fn reserved_bits_are_neither_read_nor_written() {
        let codec = Codec::Bits(BitsCodec { registers: 1, visible: (0..8).collect() });
        let bits = codec.decode(&[0xFF81], LowFirst).value.unwrap();
        assert_eq!(bits, Value::Bits([0, 7].into_iter().collect()));
        let mut registers = [0xAA00];
        codec.encode(&bits, LowFirst, &mut registers).unwrap();
        assert_eq!(registers, [0xAA81]);
        let outside = Value::Bits([1, 9].into_iter().collect());
        assert_eq!(codec.encode(&outside, LowFirst, &mut registers), Err(EncodeError::Bit { bit: 9 }));
    }

    #[test]
    fn raw_codes_are_what_conditions_compare() {
        let bits = Codec::Bits(BitsCodec { registers: 2, visible: (0..24).collect() });
        assert_eq!(bits.raw_code(&[0x8001, 0xFF02], LowFirst), Some(0x0002_8001));
        let choice = Codec::Choice(Field::new(7, 0).unwrap(), Sentinels::new(&[]));
        assert_eq!(choice.raw_code(&[0xAB04], LowFirst), Some(4));
        assert_eq!(choice.raw_code(&[], LowFirst), None);
        assert_eq!(Codec::Trace { registers: 1 }.raw_code(&[1], LowFirst), None);
    }

    #[test]
    fn lists_round_trip_in_register_order() {
        let codec = Codec::Codes { registers: 2 };
        let value = codec.decode(&[0b11_10_01, 0x8000], LowFirst).value.unwrap();
        let Value::Codes(codes) = &value else { panic!("{value:?}") };
        assert_eq!(codes[..4], [1, 2, 3, 0]);
        assert_eq!((codes.len(), codes[15]), (16, 2));
        let mut registers = [0; 2];
        codec.encode(&value, LowFirst, &mut registers).unwrap();
        assert_eq!(registers, [0b11_10_01, 0x8000]);
        let bytes = Codec::Bytes { registers: 2 }.decode(&[0x0102, 0xA0FF], HighFirst);
        assert_eq!(bytes.value, Some(Value::Bytes(vec![1, 2, 0xA0, 0xFF])));
        let trace = Codec::Trace { registers: 2 };
        let value = trace.decode(&[0xFFFF, 5], LowFirst).value.unwrap();
        assert_eq!(value, Value::Trace(vec![-1, 5]));
        assert_eq!(
            trace.encode(&Value::Trace(vec![1]), LowFirst, &mut registers),
            Err(EncodeError::Length { expected: 2, found: 1 })
        );
    }
}
